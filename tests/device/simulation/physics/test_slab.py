"""The tissue under the probe: its bounds, and the mismatch of an inclusion in it on paper."""

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.slab import NOMINAL, Slab


def test_the_nominal_slab_is_the_papers_tissue_30_mm_thick():
    assert (NOMINAL.youngs_modulus_kpa, NOMINAL.thickness_mm, NOMINAL.stiffness_ratio) == (5.0, 30.0, 1.0)


@pytest.mark.parametrize(
    ("tissue", "quantity"),
    [
        ({"youngs_modulus_kpa": 3.9}, "tissue_modulus_kpa"),
        ({"youngs_modulus_kpa": 6.3}, "tissue_modulus_kpa"),
        ({"thickness_mm": 26.9}, "slab_thickness_mm"),
        ({"thickness_mm": float("nan")}, "slab_thickness_mm"),
    ],
)
def test_tissue_outside_the_tables_is_refused_by_what_is_outside(tissue, quantity):
    with pytest.raises(InvalidQuantity, match=f"^{quantity} is .*range of the virtual probe's tables"):
        Slab(**tissue)


def test_the_elastic_mismatch_is_none_for_tissue_and_one_for_a_rigid_sphere():
    assert Slab(4.0).elastic_mismatch(4.0) == 0.0
    assert Slab(4.0).elastic_mismatch(1e9) == pytest.approx(1.0)
    assert NOMINAL.elastic_mismatch(30.0) == pytest.approx(25.0 / 37.5)


@pytest.mark.parametrize("modulus_kpa", [8.0, 60.0, 200.0])
def test_a_modulus_comes_back_from_its_elastic_mismatch(modulus_kpa):
    slab = Slab(6.0, 28.0)
    assert slab.modulus_kpa(slab.elastic_mismatch(modulus_kpa)) == pytest.approx(modulus_kpa)


def test_the_nominal_equivalent_has_the_same_elastic_mismatch_and_place():
    slab, inclusion = Slab(4.0), Inclusion(9.0, 5.0, 60.0)
    equivalent = slab.nominal_equivalent(inclusion)
    assert equivalent == Inclusion(9.0, 5.0, 75.0)
    assert NOMINAL.elastic_mismatch(equivalent.youngs_modulus_kpa) == pytest.approx(slab.elastic_mismatch(60.0))
    assert NOMINAL.nominal_equivalent(inclusion) == inclusion


def test_tissue_that_changed_holds_the_inclusions_of_its_slab_with_a_mismatch_of_its_own():
    slab, inclusion = Slab(4.0, 28.0), Inclusion(9.0, 5.0, 60.0)
    softer = slab.changed(0.9)
    assert (softer.youngs_modulus_kpa, softer.thickness_mm, softer.stated) == (pytest.approx(3.6), 28.0, slab)
    assert softer.elastic_mismatch(60.0) == pytest.approx((60.0 - 3.6) / (60.0 + 5.4))
    assert softer.nominal_equivalent(inclusion) == slab.nominal_equivalent(inclusion)
    assert slab.changed(1.0) is slab
