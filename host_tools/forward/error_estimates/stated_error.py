"""Two orders on one mesh to the error that a solution states of its force and of O1-O3.

In axisymmetry the other order is higher: what is left to gain is about as much as the last step gained, since the
singular rims converge algebraically. Where the other order is lower its step is far too large, and a share of it is
enough. The step of a single feature may cross zero by chance, so each is given a part of the largest, or all of it.
`host_tools verify --effectivity` measures how often the true error lies within.
Source: Babuska & Suri, SIAM Review 36(4), 1994, on the p version.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from types import MappingProxyType
from typing import NamedTuple

from host_tools.forward.deformation import deformation
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import GRADED, SLIDING, ModelPlan
from host_tools.forward.press_model import Loaded


class Rule(NamedTuple):
    """What a kind of model states: a factor, by order where it differs, of steps to the other order."""

    factor: float
    share: float
    """Of the largest step of all, which each feature's own counts as at least: 0 is its own alone, 1 the largest."""
    by_order: Mapping[int, float] = MappingProxyType({})
    """Factors of the orders whose next step is far smaller, or larger, than the last."""

    def error(self, order: int, step: float, largest: float) -> float:
        """Return what is stated of a feature by its own relative step and the largest; of what is prescribed, 0."""
        return self.by_order.get(order, self.factor) * max(step, self.share * largest) if step else 0.0


ONE_MESH = Rule(3.0, 0.0)
"""Axisymmetry in small strain on the mesh that data sets share, from the next higher order."""
BLUNT = Rule(3.0, 1.0)
"""Finite strain on the meshes that data sets share, from the next higher order."""
CORRECTED = Rule(4.0, 0.0)
"""Finite strain in a climb, by one Newton correction at the next order; small strain foretells what it cannot see."""
SOLID_ONE_MESH = Rule(0.4, 1.0)
"""3-D on the mesh that data sets share, from the next lower order."""
CLIMBED = Rule(2.0, 1.0, {3: 0.5, 4: 0.5})
"""Flat faces on rims in layers, from the next lower order, as all that follow."""
SOLID_ORDER, SOLID = 3, Rule(0.3, 0.5)
"""The same in 3-D at `SOLID_ORDER`, whose next step is far smaller than in axisymmetry."""
MIXED = Rule(1.5, 0.25, {3: 0.12, 4: 0.5})
"""Axisymmetry where a pressure is solved for."""
CLOSED = Rule(0.75, 0.25, {3: 0.13, 4: 0.32})
"""A dome that touches everywhere, of displacements alone in axisymmetry."""
DOMED = Rule(4.0, 1.0, {3: 1.0, 4: 3.0})
"""Any other dome: at the edge of a contact that lifts off errors fall less from order to order."""
EDGE_ERROR = 2e-3
"""Least stated error where a dome lifts off: its edge lies inside an element, which no order sees."""
INTEGRAL, INTEGRAL_FACTOR = "central_deformation_mm3", 2.5
"""In finite strain under a force O2, what the face's lifted middle and lowered border leave of each other, states so
much more: the blunt rim moves both."""
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
    largest = max(step for name, step in steps.items() if name not in CANCELLING)
    lifts_off = plan.contact == "unilateral" and not all(_is_closed(one.state) for one in (pressed, baseline))
    rule = _rule(plan, lifts_off=lifts_off)
    stated = {name: rule.error(plan.order, step, largest) for name, step in steps.items()}
    if lifts_off and rule is not ONE_MESH:
        stated = {name: max(error, EDGE_ERROR) if error else 0.0 for name, error in stated.items()}
    if rule is BLUNT and by_force:
        stated[INTEGRAL] *= INTEGRAL_FACTOR
    return stated


def _rule(plan: ModelPlan, *, lifts_off: bool) -> Rule:
    """Return the rule of a kind of model."""
    is_round, is_mixed = plan.symmetry == "axisymmetric", plan.formulation == "mixed"
    if plan.grading in SLIDING:
        return CORRECTED
    if plan.grading != GRADED:
        return SOLID_ONE_MESH if not is_round else BLUNT if plan.strain == "finite" else ONE_MESH
    if plan.contact == "unilateral":
        return CLOSED if is_round and not is_mixed and not lifts_off else DOMED
    if is_round:
        return MIXED if is_mixed else CLIMBED
    return SOLID if plan.order == SOLID_ORDER and not is_mixed else CLIMBED


def at_force(corrected: FaceState, force_n: float) -> FaceState:
    """Return a face that was corrected at a fixed indentation at the force prescribed, both of them all but equal.

    At slightly different forces what an inclusion adds would be lost in what the force does.
    """
    return corrected.scaled(force_n / corrected.force_n)


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
