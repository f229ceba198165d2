"""A solution to the same solution, if it can be one: no number leaves the solver that no press could have.

That no matter is turned inside out is the models' own check (`small_strain/folding.py`; Newton's method in finite
strain), since only they have the displacements.
"""

from __future__ import annotations

import math

import numpy as np

from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution

BALANCE_RATIO = 1e-5
"""Largest relative difference of the contact force and the reaction of the back."""
TOUCHING_RATIO = 1e-3
"""Pressure over its largest above which a point of a dome touches."""
FEWEST_SAMPLES = 4
"""Samples of a ray, 0.05 mm apart on the default face, that a contact must reach over."""


def require_sound(solution: Solution) -> Solution:
    """Return the solution; raise `PressFailed` for one that breaks a law, with the law and what to do."""
    _require_finite(solution)
    _require_inside_slab(solution)
    _require_balance(solution)
    _require_pushed(solution)
    _require_contact(solution)
    return solution


def _require_finite(solution: Solution) -> None:
    states = (solution.pressed, solution.baseline)
    numbers = [number for one in states for number in (one.force_n, one.indentation_mm, one.total_mm3)]
    fields = [field for one in states for field in (one.w_mm, one.p_kpa)]
    if not all(map(math.isfinite, numbers)) or not all(np.isfinite(field).all() for field in fields):
        raise PressFailed("a number of the solution is not finite: make moduli and sizes of the scene less extreme")


def _require_inside_slab(solution: Solution) -> None:
    slab_mm = solution.scene.tissue.thickness_mm
    for state in (solution.pressed, solution.baseline):
        if not 0 < state.indentation_mm < slab_mm:
            raise PressFailed(
                f"the indentation found is {state.indentation_mm:.4g} mm, but must be above 0 and below the slab's "
                f"thickness of {slab_mm:g} mm: press less"
            )


def _require_balance(solution: Solution) -> None:
    for state in (solution.pressed, solution.baseline):
        if state.force_n <= 0:
            raise PressFailed(f"the force found is {state.force_n:.4g} N, but a press takes one above 0: press deeper")
        if abs(state.contact_force_n / state.force_n - 1) > BALANCE_RATIO:
            raise PressFailed(
                f"face and back carry {state.contact_force_n:.6g} N and {state.force_n:.6g} N, but must carry the same "
                f"to {BALANCE_RATIO:g}: make moduli and sizes of the scene less extreme"
            )


def _require_pushed(solution: Solution) -> None:
    if not solution.pressure_is_positive:
        raise PressFailed(
            "the tissue pulls at a ring of the face, but contact can only push: give the face a dome of 0.001 mm, "
            "whose contact may open"
        )


def _require_contact(solution: Solution) -> None:
    """Refuse a dome that touches over less than its samples can tell."""
    if solution.plan.contact != "unilateral":
        return
    for state in (solution.pressed, solution.baseline):
        touching = state.p_kpa > TOUCHING_RATIO * state.p_kpa.max()
        if touching.sum(axis=-1).max() < FEWEST_SAMPLES:
            step_mm = solution.r_mm[1]
            raise PressFailed(
                f"the dome touches over a radius below {FEWEST_SAMPLES * step_mm:.2g} mm, narrower than "
                f"{FEWEST_SAMPLES} samples of the face: press deeper, or make the dome flatter"
            )
