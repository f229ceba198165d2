"""Hayes' punch: a rigid flat cylinder on a bonded layer needs P = 2 E a delta kappa / (1 - nu2)."""

from math import pi

import pytest

from host_tools.verification import hayes
from host_tools.verification.hayes import kappa


@pytest.mark.parametrize(
    ("nu", "ratio"), [(0.3, 0.4), (0.3, 1.0), (0.45, 1.0), (0.49, 0.4), (0.49, 1.0), (0.49, 2.0), (0.49999, 1.0)]
)
def test_the_force_on_a_rigid_probe_is_hayes(nu, ratio):
    benchmark = hayes.benchmark(nu, ratio)
    assert benchmark.measured == pytest.approx(kappa(nu, ratio), rel=1e-3)
    assert benchmark.measured > kappa(nu, ratio)  # displacements that are not exact are too stiff


def test_a_layer_much_thicker_than_the_punch_is_a_half_space():
    """kappa -> 1 + c a/h: the departure halves with the ratio."""
    near, far = kappa(0.49, 0.02) - 1, kappa(0.49, 0.01) - 1
    assert near == pytest.approx(2 * far, rel=0.03)
    assert far < 0.012


def test_a_layer_much_thinner_than_the_punch_is_in_uniaxial_strain():
    """P -> pi a2 M w / h with the confined modulus M = E (1 - nu) / ((1 + nu)(1 - 2 nu)); the edge adds O(h/a)."""
    nu = 0.3
    over_confined = [kappa(nu, ratio) / (pi / 2 * ratio * (1 - nu) ** 2 / (1 - 2 * nu)) for ratio in (5.0, 10.0)]
    assert 2 * over_confined[1] - over_confined[0] == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("nu", hayes.PUBLISHED)
def test_the_integral_equation_is_the_published_table_to_one_per_cent(nu):
    for ratio, published in zip(hayes.RATIOS, hayes.PUBLISHED[nu], strict=True):
        assert kappa(nu, ratio) == pytest.approx(published, rel=0.01)
