"""Two orders on one mesh to the error that a solution states of its force and of O1-O3.

In axisymmetry the other order is higher: what is left to gain is about as much as the last step gained, since the
singular rims converge algebraically. In 3-D it is lower and its step is far too large, yet for single features it may
cross zero by chance: a share of the largest step of all is taken for each. `host_tools verify` measures how often the
true error lies within. Source: Babuska & Suri, SIAM Review 36(4), 1994, on the p version.
"""

from __future__ import annotations

from dataclasses import asdict

from host_tools.forward.deformation import deformation
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import ModelPlan
from host_tools.forward.press_model import Loaded

STEP_UP_FACTOR = 2.0
"""Stated error over the step to the next higher order, feature by feature."""
STEP_DOWN_FACTOR = 0.2
"""Stated error over the largest step, of any feature, from the next lower order."""
ROUNDING = 1e-12
"""A step below it is no step: that press was prescribed."""
CANCELLING = ("total_deformation_mm3", "deformation_area_mm2")
"""At equal force the total all but cancels, and the area steps when the half maximum leaves the window."""


def stated_error(plan: ModelPlan, rays: Rays, pressed: Loaded, bare: Loaded) -> dict[str, float]:
    """Return the estimated relative error by feature; empty when no other order was solved for.

    Of force and indentation the one that was prescribed has none.
    """
    if pressed.other is None or bare.other is None:
        return {}
    found, other = _numbers(rays, pressed.state, bare.state), _numbers(rays, pressed.other, bare.other)
    steps = {name: _step(value, other[name]) for name, value in found.items()}
    if plan.symmetry == "axisymmetric":
        return {name: STEP_UP_FACTOR * step for name, step in steps.items()}
    largest = max(step for name, step in steps.items() if name not in CANCELLING)
    return {name: STEP_DOWN_FACTOR * largest if step else 0.0 for name, step in steps.items()}


def _step(value: float, other: float) -> float:
    """Return the relative change from one order to the other; none where rounding alone differs."""
    step = abs(value - other) / abs(value) if value else 0.0
    return step if step > ROUNDING else 0.0


def _numbers(rays: Rays, pressed: FaceState, bare: FaceState) -> dict[str, float]:
    lump = deformation(rays.r_mm, pressed.w_mm - bare.w_mm, pressed.total_mm3 - bare.total_mm3)
    return {"force_n": pressed.force_n, "indentation_mm": pressed.indentation_mm, **asdict(lump)}
