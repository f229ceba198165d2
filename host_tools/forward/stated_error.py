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


def stated_error(plan: ModelPlan, rays: Rays, pressed: Loaded, bare: Loaded) -> dict[str, float]:
    """Return the estimated relative error by feature; empty when no other order was solved for.

    Of force and indentation the one that was prescribed has none.
    """
    if pressed.other is None or bare.other is None:
        return {}
    found, other = _numbers(rays, pressed.state, bare.state), _numbers(rays, pressed.other, bare.other)
    steps = {name: abs(value - other[name]) / abs(value) if value else 0.0 for name, value in found.items()}
    if plan.symmetry == "axisymmetric":
        return {name: STEP_UP_FACTOR * step for name, step in steps.items()}
    prescribed = [name for name in ("force_n", "indentation_mm") if steps[name] < ROUNDING]
    largest = max(step for name, step in steps.items() if name not in CANCELLING)
    return {name: 0.0 if name in prescribed else STEP_DOWN_FACTOR * largest for name in steps}


ROUNDING = 1e-12
CANCELLING = ("total_deformation_mm3", "deformation_area_mm2")
"""At equal force the total all but cancels, and the area steps when the half maximum leaves the window."""


def _numbers(rays: Rays, pressed: FaceState, bare: FaceState) -> dict[str, float]:
    lump = deformation(rays.r_mm, pressed.w_mm - bare.w_mm, pressed.total_mm3 - bare.total_mm3)
    return {"force_n": pressed.force_n, "indentation_mm": pressed.indentation_mm, **asdict(lump)}
