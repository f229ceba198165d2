"""The plan takes the model that a scene requires, and says why."""

import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.plan import STANDARD, aligned, model_plan
from host_tools.scenes.scene import Placement, Scene, Tissue, TissueLayer, Waveguide

INCLUSION = Inclusion(10.0, 6.0, 80.0)
SQUARE, DOMED, EDGE = Waveguide(face="square"), Waveguide(dome_mm=0.5), Tissue(edge_mm=20.0)


@pytest.mark.parametrize(
    ("scene", "symmetry", "because"),
    [
        (Scene(INCLUSION), "axisymmetric", "every section is the same"),
        (Scene(INCLUSION, placement=Placement(0.0, 0.0, 1.5, 1.5)), "axisymmetric", "every section"),
        (Scene(INCLUSION, waveguide=DOMED), "axisymmetric", "every section"),
        (Scene(Inclusion(0.0, 6.0, 80.0), placement=Placement(6.0)), "axisymmetric", "every section"),
        (Scene(Inclusion(10.0, 6.0, 5.0), placement=Placement(6.0)), "axisymmetric", "every section"),
        (Scene(INCLUSION, waveguide=SQUARE), "quarter", "the face is square"),
        (Scene(INCLUSION, placement=Placement(0.0, 0.0, 1.0, 2.0)), "quarter", "ellipsoid"),
        (Scene(INCLUSION, placement=Placement(6.0)), "half", "6 mm off the axis"),
        (Scene(INCLUSION, placement=Placement(3.0, -4.0)), "half", "5 mm off the axis"),
        (Scene(INCLUSION, tissue=EDGE), "half", "plane edge"),
        (Scene(INCLUSION, waveguide=SQUARE, placement=Placement(3.0, 4.0)), "full", "no plane"),
        (Scene(INCLUSION, tissue=EDGE, placement=Placement(0.0, 4.0)), "full", "no plane"),
        (Scene(INCLUSION, placement=Placement(3.0, 4.0, 1.0, 2.0)), "full", "no plane"),
    ],
)
def test_the_symmetry_is_the_largest_that_the_scene_has(scene, symmetry, because):
    plan = model_plan(scene)
    assert plan.symmetry == symmetry
    assert because in plan.reasons["symmetry"]


def test_an_inclusion_anywhere_round_the_axis_is_turned_onto_x():
    turned, angle_rad = aligned(Scene(INCLUSION, placement=Placement(0.0, -5.0)))
    assert (turned.placement.offset_x_mm, turned.placement.offset_y_mm) == (5.0, 0.0)
    assert angle_rad == pytest.approx(-1.5707963)


def test_contact_is_searched_for_only_under_a_dome():
    assert model_plan(Scene(INCLUSION)).contact == "closed_sliding"
    assert model_plan(Scene(INCLUSION, waveguide=DOMED)).contact == "unilateral"


def test_a_pressure_is_solved_for_only_where_displacements_lock():
    nearly = Scene(INCLUSION, tissue=Tissue(poisson_ratio=0.4995))
    assert model_plan(Scene(INCLUSION)).formulation == "displacement"
    assert model_plan(nearly).formulation == "mixed"


def test_the_topology_is_fixed_over_the_training_box_only():
    assert model_plan(Scene(Inclusion(2.0, 12.0, 40.0))).mesh == "morphed"
    assert model_plan(Scene(Inclusion(1.9, 12.0, 40.0))).mesh == "remeshed"
    layered = Scene(INCLUSION, tissue=Tissue(layers=(TissueLayer("skin", 1.5, 20.0),)))
    assert model_plan(layered).mesh == "remeshed"


def test_every_scene_of_a_data_set_has_the_same_level():
    plans = [model_plan(Scene(Inclusion(size, 6.0, 80.0))) for size in (1.0, 5.0, 20.0)]
    assert {(plan.grading, plan.order) for plan in plans} == {STANDARD}


@pytest.mark.parametrize(
    ("scene", "quantity"),
    [
        (Scene(INCLUSION, placement=Placement(6.0)), "strain"),
        (Scene(INCLUSION, waveguide=DOMED), "strain"),
        (Scene(INCLUSION, tissue=Tissue(poisson_ratio=0.4999)), "poisson_ratio"),
    ],
)
def test_finite_strain_is_refused_where_no_model_has_it(scene, quantity):
    with pytest.raises(InvalidQuantity) as refused:
        model_plan(scene, strain="finite")
    assert refused.value.quantity == quantity
