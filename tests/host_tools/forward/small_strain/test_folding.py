"""Small strain scales to any load; where it would turn matter inside out it is refused with what can be had."""

import re
from dataclasses import replace

import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Placement, Press, Scene, Tissue, Waveguide

INCLUSION = Inclusion(10.0, 6.0, 80.0)


def _refusal(scene):
    with pytest.raises(PressFailed, match="inside out") as refused:
        solve(scene, replace(model_plan(scene), grading="coarse"))
    return str(refused.value)


@pytest.mark.parametrize("dome_mm", [0.0, 0.5])
@pytest.mark.parametrize("force_n", [7.0, 1e4])
def test_a_force_out_of_reach_is_refused_with_the_largest_that_can_be_had(force_n, dome_mm):
    """7 N used to be an indentation of 34 mm in a slab of 30 mm."""
    told = _refusal(Scene(INCLUSION, Press(force_n=force_n), Waveguide(dome_mm=dome_mm)))
    largest_n = float(re.search(r"must be below ([\d.]+) N", told)[1])
    reachable = solve(Scene(INCLUSION, Press(force_n=0.98 * largest_n), Waveguide(dome_mm=dome_mm)))
    assert reachable.indentation_mm < 16.0
    with pytest.raises(PressFailed):
        solve(Scene(INCLUSION, Press(force_n=1.02 * largest_n), Waveguide(dome_mm=dome_mm)))


def test_an_indentation_inside_the_slab_that_folds_it_is_refused():
    assert "indentation_mm is 29.9 mm" in _refusal(Scene(INCLUSION, Press(indentation_mm=29.9)))


def test_the_probe_folds_first_on_tissue_that_does_not_give_way():
    """Ten millimetres of waveguide cannot be pressed 9.9 mm thin."""
    stiff = Tissue(youngs_modulus_kpa=500.0)
    assert "must be below" in _refusal(Scene(INCLUSION, Press(indentation_mm=9.9), tissue=stiff))


def test_the_limit_does_not_depend_on_the_mesh():
    """Rims are turned inside out under any load, in a volume that vanishes with the mesh."""
    limits = []
    for grading, order in (("coarse", 2), ("standard", 4)):
        scene = Scene(INCLUSION, Press(force_n=7.0))
        with pytest.raises(PressFailed) as refused:
            solve(scene, replace(model_plan(scene), grading=grading, order=order))
        limits.append(float(re.search(r"must be below ([\d.]+) N", str(refused.value))[1]))
    assert limits[0] == pytest.approx(limits[1], rel=0.02)


@pytest.mark.long
def test_a_solid_folds_too():
    scene = Scene(Inclusion(6.0, 3.0, 80.0), Press(force_n=50.0), placement=Placement(offset_x_mm=4.0))
    assert "force_n is 50 N" in _refusal(scene)
