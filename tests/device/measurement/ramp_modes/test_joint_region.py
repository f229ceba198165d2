"""Joint regions of samples whose law is known on paper."""

import numpy as np
import pytest

from device.measurement.ramp_modes.joint_region import joint_region, profiled_region

EVEN = np.full(4, 0.25)


@pytest.mark.parametrize(("dimensions", "chi_square"), [(2, 4.605), (3, 6.251)])
def test_the_region_of_a_gaussian_ends_at_nine_in_ten_of_chi_square(dimensions, chi_square):
    at = np.random.default_rng(1).standard_normal((40_000, dimensions))
    region = joint_region(at, np.full(len(at), 1 / len(at)))
    assert region.square[0] == pytest.approx(chi_square, rel=0.03)
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
    np.testing.assert_allclose(region.middle[0], 0.0, atol=1e-15)
    assert region.holds(at[0])
    assert not region.holds(at[2])
    assert joint_region(at, EVEN).holds(at[2])


def in_cells(shares, middles, spreads, count=40_000):
    """Samples whose cells have these shares, each a round Gaussian of two unknowns."""
    rng = np.random.default_rng(3)
    cell = rng.choice(len(shares), count, p=shares)
    at = np.array(middles)[cell] + np.array(spreads)[cell, None] * rng.standard_normal((count, 2))
    return profiled_region(at, np.full(count, 1 / count), cell)


def test_a_profiled_region_of_one_cell_ends_at_nine_in_ten_of_chi_square():
    region = in_cells([1.0], [[0.3, 0.1]], [0.2])
    for angle in np.linspace(0, 6, 7):
        edge = 0.2 * np.sqrt(4.605) * np.array([np.cos(angle), np.sin(angle)])
        assert region.holds([0.3, 0.1] + 0.97 * edge)
        assert not region.holds([0.3, 0.1] + 1.03 * edge)


def test_a_cell_of_few_inclusions_has_its_ellipse_as_long_as_it_is_dense():
    """Its density in the middle against the densest one's: a third of it is a deviance of 2.2, a hundredth of 9.2."""
    a_third, a_hundredth = 1 / 3 * 0.5**2, 1 / 100 * 0.5**2
    shares = np.array([1.0, a_third, a_hundredth])
    region = in_cells(shares / shares.sum(), [[0.0, 0.0], [2.0, 0.0], [-2.0, 0.0]], [0.2, 0.1, 0.1])
    end = 0.1 * np.sqrt(4.605 - 2 * np.log(3))
    assert region.holds(np.array([2.0, 0.95 * end]))
    assert not region.holds(np.array([2.0, 1.05 * end]))
    assert not region.holds(np.array([-2.0, 0.0]))


def test_one_lone_sample_of_a_cell_is_no_dense_one():
    """By itself it would have no width at all, and would outshine everything."""
    at = np.vstack([np.random.default_rng(4).standard_normal((1000, 2)), [[1.0, 1.0]]])
    region = profiled_region(at, np.full(1001, 1 / 1001), np.append(np.zeros(1000, int), 1))
    assert region.holds(np.array([-1.0, 1.5]))
    assert not region.holds(np.array([1.0, 3.0]))
