"""The dual-weighted residual against what it must be: its sum the step between two orders, its size the error."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.feature_slopes import feature_slopes
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import GRADED, model_plan
from host_tools.forward.solve import solve
from host_tools.forward.tiers import build
from host_tools.scenes.scene import Press, Scene, Tissue

ORDER = 4
UNRESOLVED = 1e-5
"""The truth's own error."""


def _graded(scene, order):
    return replace(model_plan(scene), mesh="remeshed", grading=GRADED, order=order)


@pytest.fixture(scope="module")
def loaded():
    """The lesion and the baseline at two orders, pressed by 1 mm."""
    scene = Scene(Inclusion(10.0, 6.0, 80.0))
    meshed = build(scene, _graded(scene, ORDER))
    materials = with_inclusion(scene), baseline(scene)
    return meshed.rays, *(meshed.model.press(one, [scene.press], estimate_error=True)[0] for one in materials)


def test_the_parts_of_all_elements_add_up_to_the_step_between_the_orders(loaded):
    """Galerkin: exactly, for a sum over the face; the area moves by its slope, to the second order of the step."""
    rays, pressed, plain = loaded
    high, low = (numbers(rays, *states) for states in ((pressed.state, plain.state), (pressed.other, plain.other)))
    added_mm = (pressed.state.w_mm - plain.state.w_mm)[0]
    for name, slope in feature_slopes(rays.r_mm[0], added_mm).items():
        owed = pressed.residual.of(*slope) - plain.residual.of(*slope)
        assert owed.sum() == pytest.approx(high[name] - low[name], rel=2e-3), name


def test_the_parts_of_the_force_are_of_one_sign_and_add_up_to_how_much_too_stiff_the_lower_order_is(loaded):
    """A force is a compliance: its error is the energy of the displacement's error."""
    _, pressed, _ = loaded
    assert (pressed.residual.force_n > -1e-12).all()
    assert pressed.residual.force_n.sum() == pytest.approx(pressed.other.force_n - pressed.state.force_n, rel=2e-3)


@pytest.mark.parametrize(
    "scene",
    [
        Scene(Inclusion(10.0, 6.0, 80.0), Press(force_n=0.5)),
        Scene(Inclusion(3.0, 1.0, 400.0), Press(indentation_mm=1.0), tissue=Tissue(thickness_mm=14.0)),
        Scene(Inclusion(20.0, 12.0, 2.0), Press(force_n=0.3), tissue=Tissue(thickness_mm=60.0)),
    ],
)
@pytest.mark.parametrize("order", [3, 4, 5])
def test_the_true_error_is_within_the_stated_one_and_not_far_below(scene, order):
    true = numbers_of(solve(scene, _graded(scene, order + 3)))
    solution = solve(scene, _graded(scene, order), estimate_error=True)
    found = numbers_of(solution)
    ratios = []
    for name, stated in solution.stated_error.items():
        error = abs(found[name] - true[name]) / abs(true[name]) if true[name] else 0.0
        assert error <= max(stated, UNRESOLVED), name
        if stated and error > UNRESOLVED:
            ratios.append(stated / error)
    assert np.median(ratios) < 10


def test_what_is_owed_falls_less_from_order_to_order_near_the_rims():
    """There stress is singular: a ninth is left of it from order 3 to 4, and a fortieth of what the others owe."""
    scene = Scene(Inclusion(10.0, 6.0, 80.0))
    near, elsewhere = (low / high for low, high in zip(_owed_of_o2(scene, 4), _owed_of_o2(scene, 3), strict=True))
    assert 0.05 < near < 0.2
    assert elsewhere < near / 3


def _owed_of_o2(scene, order):
    """Return what elements near the rims and all others owe to O2."""
    meshed = build(scene, _graded(scene, order))
    materials = with_inclusion(scene), baseline(scene)
    pressed, plain = (meshed.model.press(one, [scene.press], estimate_error=True)[0] for one in materials)
    added_mm = (pressed.state.w_mm - plain.state.w_mm)[0]
    slope = feature_slopes(meshed.rays.r_mm[0], added_mm)["central_deformation_mm3"]
    owed = np.abs(pressed.residual.of(*slope) - plain.residual.of(*slope))
    near = pressed.residual.is_near_rim
    return owed[near].sum(), owed[~near].sum()


def numbers_of(solution):
    return numbers(solution.rays, solution.pressed, solution.baseline)
