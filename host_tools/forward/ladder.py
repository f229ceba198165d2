"""A scene and a tolerance to a solution that states no more than it: plan, solve, compare, and climb.

Each kind of model has its rungs. In small strain they are orders on one mesh, which beats refining it and keeps
features smooth in the scene; in finite strain, where the contact's rim must stay blunt, meshes and orders, whose errors
the same meshes foretell in small strain. The first rung is what usually holds; the climb ends where the stated error is
within the tolerance, or the rungs or the time are used up, and then what is missing is said. Data sets to
train from do not climb: all their scenes share one level.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import inf, isfinite
from typing import Any, get_args

from device.measurement.quantities import Bound, InvalidQuantity, require
from host_tools.forward.error_estimates.foretold_error import foretold_error
from host_tools.forward.error_estimates.stated_error import CANCELLING_UNDER_FORCE, numbers
from host_tools.forward.model_departures import CONVERGED_LEVEL, largest_departure, small_strain_press, strain_departure
from host_tools.forward.plan import (
    FINITE_IS_LIMITED,
    GRADED,
    Level,
    ModelPlan,
    StrainModel,
    has_finite_strain,
    model_plan,
)
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve_ramp
from host_tools.scenes.scene import WITHIN_S, AskedStrain, Press, Scene

NEXT_RUNG = 2.0
"""A rung takes about so many times as long as the one below it."""
FLAT_ORDERS, DOMED_ORDERS, SOLID_ORDERS = range(3, 10), range(3, 7), range(3, 7)
FINITE_RUNGS = (
    Level("sliding_coarse", 2),
    Level("sliding_coarse", 3),
    Level("sliding", 3),
    Level("sliding", 4),
    Level("sliding_fine", 4),
    Level("sliding_fine", 5),
)
WIDEST_RIM = (Level("sliding_coarse", 2), Level("sliding_coarse", 3), Level("sliding_coarse", 4))
"""What is tried where the tissue slips further along the rim than elements there are long. The first one reaches
furthest: at 2 N of the default scene 8.9 mm, the next one 8.1 mm and the last one 6 mm."""
FIRST_ORDERS = {0.01: 3, 1e-3: 4, 1e-4: 5, 0.0: 6}
"""By the tolerance from which on it is worth beginning there."""
FIRST_SOLID = {0.025: 3, 0.005: 4, 0.001: 5, 0.0: 6}
"""The same in 3-D, whose lower orders state far more than they err: a rung that cannot hold costs half of the next."""
FIRST_FINITE = {0.15: 0, 0.02: 1, 0.005: 2, 0.002: 3, 0.0: 4}
"""The same for the rungs of finite strain."""
LIGHT_RATIO = 0.01
"""Share of a press at which small strain foretells: its relative errors are of any press, and none folds at this."""
MESH_SHARE = 0.25
"""Where small strain departs by more than was asked for, a mesh that errs by so much of that adds little to it."""
SIZES_MM = Bound(0.001, 100.0, "mm")
"""Of smaller inclusions nothing shows, and meshing around them does not come to an end."""
SMALL_IS_ENOUGH = "ask for small strain (--strain small), which then states its own errors alone"
TAKE_THE_BEST = "take the best as it is (--best)"


@dataclass(frozen=True)
class Climb:
    """What was reached: solutions, one a press, and the error that they state, of which feature; relative."""

    solutions: tuple[Solution, ...]
    tolerance: float
    reached: float
    feature: str
    was_chosen: bool = False
    """Whether small strain was chosen here, and not asked for: its departure is then part of every stated error."""
    ended: str = ""
    """Why the climb ended without the tolerance."""
    advice: str = "allow a larger tolerance"
    """What to do about that."""

    def as_record(self) -> dict[str, Any]:
        """Return what was asked and reached, as the JSON object in `host_tools simulate --json`."""
        return {
            "asked": self.tolerance,
            "reached": self.reached,
            "feature": self.feature,
            "held": not self.missed,
            "not_compared": [CANCELLING_UNDER_FORCE] if self.solutions[-1].scene.press.force_n is not None else [],
            "small_strain_departure": self.departure,
            "departure_is_stated": self.was_chosen,
            "missed": self.missed,
        }

    @cached_property
    def departure(self) -> float:
        """By how much small strain may depart from finite strain at the deepest press, relative; 0 in finite strain."""
        deepest = self.solutions[-1]
        return largest_departure(deepest.scene) if deepest.plan.strain == "small" else 0.0

    @property
    def missed(self) -> str:
        """One sentence on what was asked for and is not held; empty where it is."""
        if self.was_chosen and self.departure > self.tolerance:
            return _departs_by_more(self.tolerance, self.departure)
        if self.reached <= self.tolerance:
            return ""
        known = f"{self.feature} is only good to {100 * self.reached:.3g} %"
        if not isfinite(self.reached):
            known = "what this press errs is not known"
        return f"tolerance is {100 * self.tolerance:.3g} %, but {known} ({self.ended}): {self.advice}."


class ToleranceMissed(PressFailed):
    """A tolerance that no model held; `climb` has the best, if anything was solved."""

    def __init__(self, missed: str, climb: Climb | None = None) -> None:
        self.climb = climb
        super().__init__(missed)


def climb(
    scene: Scene,
    presses: Sequence[Press],
    *,
    tolerance: float,
    strain: AskedStrain = "auto",
    within_s: float = WITHIN_S,
    best: bool = True,
) -> Climb:
    """Solve a scene at presses, as `solve_ramp`, on higher rungs until what is stated is within a relative tolerance.

    `within_s` is wall time; the first rung is solved in any case. Raise as `model_plan` and `solve_ramp` do; without
    `best` also `ToleranceMissed` where small strain alone departs by more and finite strain does not serve the scene.
    """
    began = time.perf_counter()
    plan, departure = _plan(scene.with_press(presses[-1]), tolerance, strain)
    if departure > tolerance and not best:
        raise ToleranceMissed(_departs_by_more(tolerance, departure))
    reached, told = None, ""
    rung = _Rung(scene, presses, plan, tolerance, was_chosen=strain == "auto")
    is_out_of_reach = departure > tolerance
    of_mesh = max(tolerance, MESH_SHARE * departure) if is_out_of_reach else tolerance - departure
    aim = of_mesh + departure
    for level in _rungs(plan, of_mesh):
        took = time.perf_counter()
        try:
            found = rung.solved(level, told)
        except PressFailed as failed:
            reached = rung.at_widest_rim(reached, failed, level)
            break
        reached = min((one for one in (reached, found) if one), key=lambda one: one.reached)
        if found.reached <= aim:
            break
        told = f"{level.grading}, order {level.order} stated {100 * found.reached:.2g} %"
        now = time.perf_counter()
        if now + NEXT_RUNG * (now - took) > began + within_s:
            ended = f"the next level would take longer than the {within_s:g} s allowed"
            reached = replace(reached, ended=ended, advice=f"{reached.advice} or more time (--within-s)")
            break
    else:
        reached = replace(reached, ended="no level holds more") if reached else None
    assert reached is not None  # every plan has rungs
    return reached


def _plan(scene: Scene, tolerance: float, asked: AskedStrain) -> tuple[ModelPlan, float]:
    """Return the plan, its strain measure chosen by the tolerance unless told, and what that choice costs."""
    if asked not in get_args(AskedStrain):
        one_of = ", ".join(get_args(AskedStrain))
        raise InvalidQuantity("strain", repr(asked), f"one of {one_of}", "choose one of them")
    if scene.inclusion and scene.has_inclusion:
        require("size_mm", scene.inclusion.size_mm, SIZES_MM, "leave so small an inclusion out: --size-mm 0")
    if asked != "auto":
        plan = model_plan(scene, strain=asked)
        if asked == "finite":
            small_strain_press(scene)  # refuses in a tenth of a second what finite strain would follow in vain
        return plan, 0.0
    departure = largest_departure(scene)
    known = _departs(departure)
    if departure <= tolerance:
        return model_plan(scene, because=known), departure
    known += f", more than the tolerance of {100 * tolerance:g} %"
    if has_finite_strain(scene):
        return model_plan(scene, strain="finite", because=known), 0.0
    return model_plan(scene, because=f"{known}, but {FINITE_IS_LIMITED}"), departure


def _departs(departure: float) -> str:
    if departure == inf:
        return "what small strain departs from finite strain by could not be found"
    return f"small strain may depart from finite strain by {100 * departure:.2g} % here"


def _departs_by_more(tolerance: float, departure: float) -> str:
    return (
        f"tolerance is {100 * tolerance:.3g} %, but {_departs(departure)}, and {FINITE_IS_LIMITED}: press less deep, "
        f"or {SMALL_IS_ENOUGH}."
    )


def solved_at(scene: Scene, level: Level, *, strain: StrainModel) -> Solution:
    """Solve a scene at one rung of a climb, with the errors that the climb would compare; raise as `climb` does."""
    plan = model_plan(scene, strain=strain)
    return _Rung(scene, [scene.press], plan, 1.0).solved(level, "").solutions[0]


def _rungs(plan: ModelPlan, tolerance: float) -> Sequence[Level]:
    if plan.strain == "finite":
        return FINITE_RUNGS[next(rung for at_least, rung in FIRST_FINITE.items() if tolerance >= at_least) :]
    orders, firsts = FLAT_ORDERS, FIRST_ORDERS
    if plan.contact == "unilateral":
        orders = DOMED_ORDERS
    elif plan.symmetry != "axisymmetric":
        orders, firsts = SOLID_ORDERS, FIRST_SOLID
    first = next(order for at_least, order in firsts.items() if tolerance >= at_least)
    return [Level(GRADED, order) for order in orders if order >= min(first, orders[-1])]


class _Rung:
    """Solves one scene and plan at one level after another."""

    def __init__(
        self, scene: Scene, presses: Sequence[Press], plan: ModelPlan, tolerance: float, *, was_chosen: bool = False
    ) -> None:
        self.scene, self.presses, self.plan, self.tolerance = scene, presses, plan, tolerance
        self.was_chosen = was_chosen and plan.strain == "small"
        self.tried: set[Level] = set()

    def solved(self, level: Level, told: str) -> Climb:
        """Return what one level reaches; `told` is what the one below stated."""
        self.tried.add(level)
        plan = self._plan(level, told)
        if plan.strain == "finite":
            solutions = self._foretold(plan)
        else:
            solutions = solve_ramp(self.scene, self.presses, plan, estimate_error=True)
        if self.was_chosen:
            solutions = tuple(_with_departure(one, solutions[-1]) for one in solutions)
        feature, reached = max((worst_error(one) for one in solutions), key=lambda pair: pair[1])
        return Climb(solutions, self.tolerance, reached, feature, self.was_chosen)

    def at_widest_rim(self, best: Climb | None, failed: PressFailed, level: Level) -> Climb:
        """Return what is best where a rung gave way: its rim slips too far, and wider ones may still hold.

        These are not told to make haste: the widest takes seconds, and is the last resort. Where one finds a press, and
        not what it errs, that is infinite. Raise the failure that got furthest where nothing can be had.
        """
        furthest = failed
        for wider in self._wider(best):
            try:
                found = self.solved(wider, f"finer rims give way: {failed}")
            except PressFailed as another:
                if (another.has_solution, another.reached_mm) > (furthest.has_solution, furthest.reached_mm):
                    furthest, level = another, wider
                break  # higher orders reach less far
            best = min((one for one in (best, found) if one), key=lambda one: one.reached)
            if best.reached <= self.tolerance:
                break
        if best:
            ended = f"the next level gives way: {str(furthest).removesuffix('.')}"
            return replace(best, ended=ended, advice=f"{best.advice} or press less")
        if furthest.has_solution:
            return self._of_unknown_error(level, str(furthest).removesuffix(": press less."))
        raise furthest

    def _of_unknown_error(self, level: Level, ended: str) -> Climb:
        """Return presses at a level whose errors are not known: infinite for all, but for what was prescribed."""
        plan = self._plan(level, "")
        plan = replace(plan, reasons=plan.reasons | {"level": "it finds the press, and nobody knows what it errs"})
        prescribed = "force_n" if self.presses[0].force_n is not None else "indentation_mm"
        solutions = solve_ramp(self.scene, self.presses, plan)
        stated = dict.fromkeys(numbers(solutions[0].rays, solutions[0].pressed, solutions[0].baseline), inf)
        unknown = tuple(replace(one, stated_error=stated | {prescribed: 0.0}) for one in solutions)
        feature, reached = worst_error(unknown[-1])
        return Climb(unknown, self.tolerance, reached, feature, self.was_chosen, ended, "press less")

    def _wider(self, best: Climb | None) -> list[Level]:
        """Return the levels of the widest rim that are left to try; none where a finer rim has an answer."""
        if self.plan.strain != "finite" or (best and best.solutions[0].plan.grading != WIDEST_RIM[0].grading):
            return []
        return [level for level in WIDEST_RIM if level not in self.tried]

    def _plan(self, level: Level, told: str) -> ModelPlan:
        why = f"the lowest that may state {100 * self.tolerance:g} %" + (f"; {told}" if told else "")
        mesh = "its rims in layers" if level.grading == GRADED else "the contact's rim no finer than it slips"
        reasons = self.plan.reasons | {"level": why, "mesh": f"meshed for this scene, {mesh}"}
        return replace(
            self.plan,
            grading=level.grading,
            order=level.order,
            mesh="remeshed",
            reasons=reasons,
        )

    def _foretold(self, plan: ModelPlan) -> tuple[Solution, ...]:
        """Return solutions in finite strain, with the errors that the same mesh has in small strain."""
        solutions = solve_ramp(self.scene, self.presses, plan, estimate_error=True)
        same_mesh = self._in_small_strain(Level(plan.grading, plan.order))
        return tuple(
            replace(one, stated_error=foretold_error(same_mesh, self._converged, one.stated_error)) for one in solutions
        )

    @cached_property
    def _converged(self) -> dict[str, float]:
        return self._in_small_strain(CONVERGED_LEVEL)

    def _in_small_strain(self, level: Level) -> dict[str, float]:
        """Return force, indentation and O1-O3 of a light press of the same kind."""
        plan = replace(self._plan(level, ""), strain="small", contact="closed_sliding")
        [light] = solve_ramp(self.scene, [lightened(self.presses[0])], plan)
        return numbers(light.rays, light.pressed, light.baseline)


def _with_departure(solution: Solution, deepest: Solution) -> Solution:
    """Return a solution in small strain that states what it departs from finite strain by as well.

    The departure was measured at the deepest press, and is in proportion to the press.
    """
    departure, share = strain_departure(deepest.scene), solution.indentation_mm / deepest.indentation_mm
    stated = {name: error + share * departure[name] for name, error in solution.stated_error.items()}
    return replace(solution, stated_error=stated)


def lightened(press: Press) -> Press:
    """Return `LIGHT_RATIO` of a press, by what it is prescribed by."""
    return press.scaled(LIGHT_RATIO)


def worst_error(solution: Solution) -> tuple[str, float]:
    """Return the feature with the largest stated error, and that error; a number that is none counts as infinite."""
    by_force = solution.scene.press.force_n is not None
    stated = {
        name: error if error == error else inf
        for name, error in solution.stated_error.items()
        if not (by_force and name == CANCELLING_UNDER_FORCE)
    }
    return max(stated.items(), key=lambda pair: pair[1])


def held(climbed: Climb, *, best: bool) -> Climb:
    """Return a climb that holds its tolerance, or with `best` any; raise `ToleranceMissed` otherwise."""
    if climbed.missed and not best:
        raise ToleranceMissed(f"{climbed.missed.removesuffix('.')}, or {TAKE_THE_BEST}.", climbed)
    return climbed
