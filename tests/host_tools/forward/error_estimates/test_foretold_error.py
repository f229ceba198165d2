"""What small strain foretells of a mesh holds what finite strain errs on it."""

from dataclasses import replace

import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.foretold_error import foretold_error
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.ladder import climb
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Press, Scene, Tissue

TRUE = {"force_n": 0.2, "indentation_mm": 1.0, "max_deformation_mm": 0.02, "central_deformation_mm3": 3.0}
STEPS = {"force_n": 0.001, "indentation_mm": 0.0, "max_deformation_mm": 0.02, "central_deformation_mm3": 0.0}


def test_each_feature_states_three_times_its_own_error_or_its_step_and_half_of_the_largest_at_least():
    same_mesh = TRUE | {"force_n": 0.202, "max_deformation_mm": 0.0201, "central_deformation_mm3": 3.0001}
    stated = foretold_error(same_mesh, TRUE, STEPS)
    assert stated["force_n"] == pytest.approx(0.03)
    assert stated["max_deformation_mm"] == pytest.approx(0.02)
    assert stated["central_deformation_mm3"] == pytest.approx(0.015)
    assert stated["indentation_mm"] == 0.0


def test_what_small_strain_foretells_nothing_of_states_half_of_the_largest_unless_it_is_prescribed_or_zero():
    """The area of a deep inclusion is all of the window in small strain, and less where finite strain lifts it."""
    true = TRUE | {"deformation_area_mm2": 200.0, "total_deformation_mm3": 0.0}
    same_mesh = true | {"force_n": 0.202}
    stated = foretold_error(same_mesh, true, STEPS | {"deformation_area_mm2": 0.0, "total_deformation_mm3": 0.0})
    assert stated["deformation_area_mm2"] == pytest.approx(0.015)
    assert (stated["total_deformation_mm3"], stated["indentation_mm"]) == (0.0, 0.0)


def test_under_a_force_the_integral_states_a_quarter_more():
    same_mesh = TRUE | {"indentation_mm": 1.01, "max_deformation_mm": 0.0201, "central_deformation_mm3": 3.09}
    stated = foretold_error(same_mesh, TRUE, STEPS | {"force_n": 0.0})
    assert stated["force_n"] == 0.0
    assert stated["indentation_mm"] == pytest.approx(0.045)
    assert stated["central_deformation_mm3"] == pytest.approx(1.25 * 3 * 0.03)


@pytest.mark.long
@pytest.mark.parametrize(
    ("scene", "tolerance"),
    [
        (Scene(Inclusion(10.0, 6.0, 80.0), Press(indentation_mm=1.0)), 0.02),
        (Scene(Inclusion(12.0, 4.0, 40.0), Press(force_n=0.2), tissue=Tissue(thickness_mm=40.0)), 0.2),
    ],
)
def test_the_true_error_in_finite_strain_is_within_the_stated_one(scene, tolerance):
    climbed = climb(scene, [scene.press], tolerance=tolerance, strain="finite")
    [found] = climbed.solutions
    assert climbed.missed == ""
    finer = solve(scene, replace(found.plan, grading="sliding_fine", order=4))
    true = numbers(finer.rays, finer.pressed, finer.baseline)
    for name, value in numbers(found.rays, found.pressed, found.baseline).items():
        if name not in ("total_deformation_mm3", "force_n" if scene.press.force_n else "indentation_mm"):
            assert abs(value / true[name] - 1) <= found.stated_error[name] <= tolerance
