"""Joint regions of samples whose law is known on paper."""

import numpy as np
import pytest

from device.measurement.ramp_modes.joint_region import joint_region

EVEN = np.full(4, 0.25)


@pytest.mark.parametrize(("dimensions", "chi_square"), [(2, 4.605), (3, 6.251)])
def test_the_region_of_a_gaussian_ends_at_nine_in_ten_of_chi_square(dimensions, chi_square):
    at = np.random.default_rng(1).standard_normal((40_000, dimensions))
    region = joint_region(at, np.full(len(at), 1 / len(at)))
    assert region.square == pytest.approx(chi_square, rel=0.03)
    assert region.holds(np.zeros(dimensions))
    edge = np.zeros(dimensions)
    edge[0] = np.sqrt(chi_square)
    assert region.holds(0.97 * edge)
    assert not region.holds(1.03 * edge)


def test_it_is_an_ellipse_along_what_hangs_together():
    rng = np.random.default_rng(2)
    along, across = rng.normal(0, 1.0, 20_000), rng.normal(0, 0.1, 20_000)
    region = joint_region(np.column_stack([along + across, along - across]), np.full(20_000, 1 / 20_000))
    assert region.holds(np.array([1.0, 1.0]))
    assert not region.holds(np.array([1.0, -1.0]))


def test_samples_count_by_their_weight_and_the_one_at_the_edge_belongs_to_it():
    """Squared distances are as 1, 1, 4 and 4; the inner two weigh more than nine in ten."""
    at = np.array([[1.0, 0.0], [-1.0, 0.0], [0.0, 2.0], [0.0, -2.0]])
    region = joint_region(at, np.array([0.46, 0.46, 0.04, 0.04]))
    np.testing.assert_allclose(region.middle, 0.0, atol=1e-15)
    assert region.holds(at[0])
    assert not region.holds(at[2])
    assert joint_region(at, EVEN).holds(at[2])
