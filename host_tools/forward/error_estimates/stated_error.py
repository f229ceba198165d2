"""Two orders on one mesh to the error that a solution states of its force and of O1-O3.

In axisymmetry the other order is higher: what is left to gain is about as much as the last step gained, since the
singular rims converge algebraically. Where the other order is lower its step is far too large, and a share of it is
enough. The step of a single feature may cross zero by chance, so each is given a part of the largest, or all of it.
`host_tools verify --effectivity` measures how often the true error lies within.
Source: Babuska & Suri, SIAM Review 36(4), 1994, on the p version.
"""

from __future__ import annotations

from dataclasses import asdict

from host_tools.forward.deformation import deformation
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import GRADED, SLIDING, ModelPlan
from host_tools.forward.press_model import Loaded

STEP_UP_FACTOR = 3.0
"""Stated error over a feature's own step to the next higher order."""
BLUNT_FACTOR = 3.0
"""Stated error over the largest step to the next higher order, in finite strain."""
INTEGRAL, INTEGRAL_FACTOR = "central_deformation_mm3", 2.5
"""In finite strain under a force O2, what the face's lifted middle and lowered border leave of each other, states so
much more: the blunt rim moves both."""
STEP_DOWN_FACTOR = 0.4
"""Stated error over the largest step, of any feature, from the next lower order."""
CLIMBED_FACTOR = 2.0
"""Stated error over the largest step from the next lower order, on a mesh whose rims are in layers."""
LOW_ORDER, LOW_FACTOR = 4, 0.5
"""The same up to this order, where the next step is a tenth of the last."""
OWN_SHARE, SOLID_SHARE = 0.25, 0.5
"""Of the largest step each feature's own counts as at least in the kinds below, in axisymmetry and in 3-D."""
MIXED_FACTORS, MIXED_FACTOR = {3: 0.12, 4: 0.5}, 1.5
"""Stated error over a feature's own step where a pressure is solved for in axisymmetry, by order, and above."""
CLOSED_FACTORS, CLOSED_FACTOR = {3: 0.13, 4: 0.32}, 0.75
"""The same under a dome that touches everywhere, of displacements alone in axisymmetry."""
SOLID_FACTORS = {3: 0.3}
"""The same in 3-D, where from order 4 on the largest step is stated."""
CORRECTED_FACTOR = 4.0
"""Stated error over a feature's own step by one Newton correction, where small strain foretells what it cannot see."""
CONTACT_FACTORS, CONTACT_FACTOR = {3: 1.0, 4: 3.0}, 4.0
"""Over the largest step under a dome that lifts off: at the contact's edge errors fall less from order to order."""
EDGE_ERROR = 2e-3
"""Least stated error where a dome lifts off: its edge lies inside an element, which no order sees."""
CLOSED_RATIO = 30.0
"""Pressure at the rim over the mean from which on a dome counts as closed: a flat face has 100, one that all but lifts
off 15, and one that does so 0. A closed contact's pressure has no bound at the rim."""
ROUNDING = 1e-12
"""A step below it is no step: that press was prescribed."""
CANCELLING = ("total_deformation_mm3", "deformation_area_mm2")
"""At equal force the total all but cancels, and the area steps when the half maximum leaves the window."""

CANCELLING_UNDER_FORCE = "total_deformation_mm3"
"""At equal force what the centre gains the rim loses: its relative error says nothing, and counts nowhere."""


def stated_error(
    plan: ModelPlan, rays: Rays, pressed: Loaded, baseline: Loaded, *, by_force: bool = False
) -> dict[str, float]:
    """Return the estimated relative error by feature; empty when no other order was solved for.

    Of force and indentation the one that was prescribed has none.
    """
    if pressed.other is None or baseline.other is None:
        return {}
    others = pressed.other, baseline.other
    if by_force and plan.strain == "finite":
        others = at_force(pressed.other, pressed.state.force_n), at_force(baseline.other, baseline.state.force_n)
    found, other = numbers(rays, pressed.state, baseline.state), numbers(rays, *others)
    steps = {name: _step(value, other[name]) for name, value in found.items()}
    if plan.grading in SLIDING:
        return {name: CORRECTED_FACTOR * step for name, step in steps.items()}
    if plan.symmetry == "axisymmetric" and plan.strain == "small" and plan.grading != GRADED:
        return {name: STEP_UP_FACTOR * step for name, step in steps.items()}
    largest = max(step for name, step in steps.items() if name not in CANCELLING)
    lifts_off = plan.contact == "unilateral" and not all(_is_closed(one.state) for one in (pressed, baseline))
    if (own := _own_factor(plan)) and not lifts_off:
        share = OWN_SHARE if plan.symmetry == "axisymmetric" else SOLID_SHARE
        return {name: own * max(step, share * largest) if step else 0.0 for name, step in steps.items()}
    stated = max(_factor(plan) * largest, EDGE_ERROR if lifts_off else 0.0)
    shares = {INTEGRAL: INTEGRAL_FACTOR} if by_force and plan.strain == "finite" else {}
    return {name: shares.get(name, 1.0) * stated if step else 0.0 for name, step in steps.items()}


def at_force(corrected: FaceState, force_n: float) -> FaceState:
    """Return a face that was corrected at a fixed indentation at the force prescribed, both of them all but equal.

    At slightly different forces what an inclusion adds would be lost in what the force does.
    """
    return corrected.scaled(force_n / corrected.force_n)


def _own_factor(plan: ModelPlan) -> float | None:
    """Return stated error over a feature's own step; None where the largest step of all is stated."""
    if plan.grading != GRADED:
        return None
    is_domed, is_mixed = plan.contact == "unilateral", plan.formulation == "mixed"
    if plan.symmetry != "axisymmetric":
        return None if is_domed or is_mixed else SOLID_FACTORS.get(plan.order)
    if is_domed:
        return None if is_mixed else CLOSED_FACTORS.get(plan.order, CLOSED_FACTOR)
    return MIXED_FACTORS.get(plan.order, MIXED_FACTOR) if is_mixed else None


def _factor(plan: ModelPlan) -> float:
    """Return stated error over the largest step."""
    if plan.grading == GRADED and plan.contact == "unilateral":
        return CONTACT_FACTORS.get(plan.order, CONTACT_FACTOR)
    if plan.grading == GRADED:
        return LOW_FACTOR if plan.order <= LOW_ORDER else CLIMBED_FACTOR
    return BLUNT_FACTOR if plan.symmetry == "axisymmetric" else STEP_DOWN_FACTOR


def _is_closed(state: FaceState) -> bool:
    """Return whether a face presses well on all of its rim, where the pressure of a closed contact is largest."""
    return bool((state.p_kpa[:, -1] > CLOSED_RATIO * state.p_kpa.mean()).all())


def _step(value: float, other: float) -> float:
    """Return the relative change from one order to the other; none where rounding alone differs."""
    step = abs(value - other) / abs(value) if value else 0.0
    return step if step > ROUNDING else 0.0


def numbers(rays: Rays, pressed: FaceState, baseline: FaceState) -> dict[str, float]:
    """Return force, indentation and O1-O3 of the inclusion field by name."""
    inclusion = deformation(rays.r_mm, pressed.w_mm - baseline.w_mm, pressed.total_mm3 - baseline.total_mm3)
    return {"force_n": pressed.force_n, "indentation_mm": pressed.indentation_mm, **asdict(inclusion)}
