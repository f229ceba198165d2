"""The forward model against balance laws, limits and an independent converged solution."""

import numpy as np
import pytest

from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve, solve_ramp, solve_ramps
from host_tools.scenes.scene import Press, Scene, Tissue, Waveguide


@pytest.fixture(scope="module")
def default():
    return solve(Scene(Inclusion(10.0, 6.0, 80.0)))


def test_the_reference_problem_matches_an_independent_converged_solution():
    """Soft layer on the tissue, slab 40 x 30 mm, d 10, h 6, E 100, 3 mm: converged by two other codes to 5 digits."""
    probe = Waveguide(layer_thicknesses_mm=(5.0, 3.0, 2.0), layer_moduli_kpa=(20.0, 40.0, 60.0))
    scene = Scene(Inclusion(10.0, 6.0, 100.0), Press(indentation_mm=3.0), probe, Tissue(half_width_mm=40.0))
    solution = solve(scene)
    assert solution.w_mm[0] == pytest.approx(0.34664, rel=5e-4)
    assert solution.w_baseline_mm[0] == pytest.approx(0.26686, rel=5e-4)
    assert solution.raw.total_deformation_mm3 == pytest.approx(181.55, rel=5e-4)
    assert solution.force_n == pytest.approx(0.56850, rel=5e-4)


def test_the_contact_pressure_balances_the_force(default):
    """2 pi int p r dr = F = 2 W / delta: the recovered pressure against the energy (Clapeyron)."""
    assert default.pressed.contact_force_n == pytest.approx(default.force_n, rel=1e-6)


@pytest.mark.parametrize("truth", [(10.0, 4.0, 120.0), (15.0, 4.0, 120.0), (2.0, 12.0, 40.0), (15.0, 12.0, 1e-3)])
def test_the_contact_pressure_is_positive_everywhere(truth):
    """Closed contact is the unilateral solution only in compression; even a near-void keeps it closed."""
    solution = solve(Scene(Inclusion(*truth)))
    assert solution.pressure_is_positive
    assert solution.p_kpa.min() > 0.1


def test_no_inclusion_is_the_limit_of_a_vanishing_one():
    baseline, tiny = solve(Scene(None)), solve(Scene(Inclusion(0.001, 6.0, 80.0)))
    assert baseline.inclusion_field.max_deformation_mm == 0.0
    assert abs(tiny.inclusion_field.max_deformation_mm) < 1e-9
    np.testing.assert_allclose(tiny.w_mm, baseline.w_mm, rtol=2e-4)


def test_an_inclusion_of_tissue_is_no_inclusion():
    same, baseline = solve(Scene(Inclusion(10.0, 6.0, 5.0))), solve(Scene(None))
    np.testing.assert_array_equal(same.w_mm, baseline.w_mm)
    assert same.inclusion_field.total_deformation_mm3 == 0.0


def test_the_solution_is_proportional_to_the_press(default):
    """Small strain: twice the indentation, twice everything but the area."""
    twice = solve(Scene(Inclusion(10.0, 6.0, 80.0), Press(indentation_mm=2.0)))
    assert twice.force_n == pytest.approx(2 * default.force_n, rel=1e-9)
    np.testing.assert_allclose(twice.w_mm, 2 * default.w_mm, rtol=1e-9)
    assert twice.inclusion_field.deformation_area_mm2 == pytest.approx(
        default.inclusion_field.deformation_area_mm2, rel=1e-9
    )


def test_a_prescribed_force_is_carried_by_both_presses():
    solution = solve(Scene(Inclusion(10.0, 6.0, 80.0), Press(force_n=0.5)))
    assert solution.force_n == pytest.approx(0.5)
    assert solution.baseline.force_n == pytest.approx(0.5)
    assert solution.indentation_mm < solution.baseline.indentation_mm  # the inclusion stiffens the tissue


def test_the_stated_error_is_small_and_not_nothing():
    errors = solve(Scene(Inclusion(10.0, 6.0, 80.0)), estimate_error=True).stated_error
    assert 0 < errors["force_n"] < 5e-4
    assert 0 < errors["max_deformation_mm"] < 1e-3


@pytest.mark.parametrize(
    ("deeper", "shallower"), [((10, 8, 80), (10, 6, 80)), ((8, 6, 80), (10, 6, 80)), ((10, 6, 40), (10, 6, 80))]
)
def test_the_inclusion_field_rises_with_size_and_modulus_and_falls_with_depth(deeper, shallower):
    """Lee & Won 2013, section III-B: O1 rises with d, falls with h, rises with E."""
    less, more = (solve(Scene(Inclusion(*map(float, truth)))).inclusion_field for truth in (deeper, shallower))
    assert less.max_deformation_mm < more.max_deformation_mm
    assert less.total_deformation_mm3 < more.total_deformation_mm3


@pytest.mark.parametrize("strain", ["small", pytest.param("finite", marks=pytest.mark.long)])
def test_scenes_of_one_mesh_solved_together_are_those_solved_alone(strain):
    scenes, presses = [Scene(Inclusion(10.0, 6.0, E)) for E in (40.0, 120.0)], [Press(force_n=0.3)]
    plan = model_plan(scenes[0].with_press(presses[0]), strain=strain)
    for scene, (together,) in zip(scenes, solve_ramps(scenes, presses, plan), strict=True):
        (alone,) = solve_ramp(scene, presses, plan)
        assert together.scene == alone.scene
        difference = (together.w_mm - together.w_baseline_mm) - (alone.w_mm - alone.w_baseline_mm)
        assert np.abs(difference).max() < 1e-5 * np.abs(alone.w_mm - alone.w_baseline_mm).max()


def test_scenes_that_need_meshes_of_their_own_are_refused():
    with pytest.raises(InvalidQuantity, match="alike but for the inclusion's modulus"):
        solve_ramps([Scene(Inclusion(10.0, 6.0, 80.0)), Scene(Inclusion(10.0, 7.0, 80.0))], [Press(force_n=0.3)])
