"""The tissue under the probe: its bounds, and the mismatch of an inclusion in it on paper."""

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.slab import NOMINAL, Slab


def test_the_nominal_slab_is_the_papers_tissue_30_mm_thick():
    assert (NOMINAL.youngs_modulus_kpa, NOMINAL.thickness_mm) == (5.0, 30.0)


@pytest.mark.parametrize(
    ("tissue", "quantity"),
    [
        ({"youngs_modulus_kpa": 1.9}, "tissue_modulus_kpa"),
        ({"youngs_modulus_kpa": 30.1}, "tissue_modulus_kpa"),
        ({"thickness_mm": 14.9}, "slab_thickness_mm"),
        ({"thickness_mm": 60.1}, "slab_thickness_mm"),
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


def test_tissue_that_changed_holds_the_inclusions_of_its_slab_with_a_mismatch_of_its_own():
    slab = Slab(4.0, 28.0)
    softer = slab.changed(0.9)
    assert (softer.youngs_modulus_kpa, softer.thickness_mm, softer.stated) == (pytest.approx(3.6), 28.0, slab)
    assert softer.elastic_mismatch(60.0) == pytest.approx((60.0 - 3.6) / (60.0 + 5.4))
    assert slab.changed(1.0) is slab


def test_tissue_that_changed_is_refused_where_the_tables_do_not_hold_it():
    with pytest.raises(InvalidQuantity, match=r"^tissue_modulus_kpa is 1\.8"):
        Slab(2.0).changed(0.9)


@pytest.mark.parametrize("inclusion", [Inclusion(10.0, 4.5, 60.0), Inclusion(2.1, 12.0, 60.0)])
def test_an_inclusion_at_the_base_of_a_thin_slab_is_refused_and_in_a_thicker_one_it_is_not(inclusion):
    with pytest.raises(InvalidQuantity, match=r"^depth_mm \+ size_mm is 14\.\d, but must be .*at most 14 mm.*thicker"):
        Slab(5.0, 15.0).require_held(inclusion)
    Slab(5.0, 15.6).require_held(inclusion)


@pytest.mark.parametrize("slab", [Slab(3.9), Slab(6.3), Slab(5.0, 26.0), Slab(5.0, 37.0)])
def test_what_is_known_near_the_nominal_slab_only_is_refused_elsewhere(slab):
    with pytest.raises(InvalidQuantity, match=r"^world\.layers is given in tissue of .*27-36 mm"):
        slab.require_near_nominal("world.layers")
    Slab(4.0, 36.0).changed(0.9).require_near_nominal("world.layers")
