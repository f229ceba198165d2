"""Whether a tolerance that was asked for is held: random scenes far beyond the training box, climbed and solved again.

What `host_tools simulate` would answer at each tolerance is compared with finite strain on its finest level. Off the
axis, where there is no finite strain, with small strain two orders higher. A scene is answered within the tolerance, or
refused in words; what would be silent is an answer outside it.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from joblib import Memory, Parallel, delayed

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.ladder import FINITE_RUNGS, climb, held
from host_tools.forward.plan import GRADED, Level
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_least
from host_tools.scenes.scene import Placement, Press, Scene, Tissue
from host_tools.verification.truths import true_numbers

TOLERANCES = (0.05, 0.01, 0.002)
REQUIRED_SHARE = 0.97
SCENES, SEED = 30, 2611
WITHIN_S = 600.0
"""Generous: a share of scenes is counted here, not the time of a machine."""
FARTHEST_MM = 12.0
"""Random offsets of inclusions: to just beyond the face."""
TRUE_FINITE = (*reversed(FINITE_RUNGS[3:]), Level("sliding_coarse", 4))
"""True is the first of these that takes the press."""
FINER, HIGHEST_SOLID = 2, 6
"""Off the axis: how many orders above the tightest answer the true one is, and what fits into a workstation."""
UNRESOLVED = 1e-5
"""The true answer's own error."""
STIFFNESS_N_PER_MM = 0.2
"""Of the default scene in tissue of 5 kPa, about: random forces are of the random indentations."""


@dataclass(frozen=True)
class ToleranceAnswer:
    """One scene at one tolerance: what was stated and true of every feature, how it was got, and why it was refused."""

    tolerance: float
    place: str
    level: str
    seconds: float
    stated_and_true: dict[str, tuple[float, float]]
    refusal: str = ""

    @property
    def is_judged(self) -> bool:
        """Whether it was answered, and a truth could be had."""
        return bool(self.stated_and_true) and not self.refusal

    @property
    def is_held(self) -> bool:
        """Whether every feature that is compared with the tolerance is truly within it."""
        return all(true <= max(self.tolerance, UNRESOLVED) for _, true in self.stated_and_true.values())


def random_scene(rng: np.random.Generator) -> Scene:
    """Return a centred scene of the enlarged box, half of them pressed by force."""
    while True:
        size_mm, slab_mm, indentation_mm = rng.uniform(1, 25), rng.uniform(12, 80), rng.uniform(0.1, 4)
        depth_mm, modulus_kpa, tissue_kpa = np.exp(rng.uniform(np.log((0.5, 1, 2)), np.log((20, 1000, 30))))
        by_force = rng.random() < 0.5
        if size_mm + depth_mm < 0.95 * slab_mm:
            break
    force_n = indentation_mm * STIFFNESS_N_PER_MM * tissue_kpa / 5
    return Scene(
        Inclusion(size_mm, float(depth_mm), float(modulus_kpa)),
        Press(force_n=float(force_n)) if by_force else Press(indentation_mm=indentation_mm),
        tissue=Tissue(youngs_modulus_kpa=float(tissue_kpa), thickness_mm=slab_mm),
    )


def moved(scene: Scene, rng: np.random.Generator) -> Scene:
    """Return the scene with its inclusion off the axis."""
    return replace(scene, placement=Placement(offset_x_mm=float(rng.uniform(1.0, FARTHEST_MM))))


def measure(
    scenes: int = SCENES, seed: int = SEED, jobs: int = -1, keep: Path | None = None
) -> list[list[ToleranceAnswer]]:
    """Return every scene's answers, one a tolerance; a process a scene.

    A folder to `keep` true numbers in, which take most of the time, lets an interrupted run go on, and another
    statement of errors be counted without them. It knows a scene again, not a change of what solves it.
    """
    true_of = Memory(keep, verbose=0).cache(true_numbers_of) if keep else true_numbers_of
    drawn = (drawn_scene(seed, number) for number in range(scenes))
    return list(Parallel(n_jobs=jobs)(delayed(answers)(scene, true_of) for scene in drawn))


def drawn_scene(seed: int, number: int) -> Scene:
    """Return a scene by its number, whatever others are drawn; every other one is off the axis."""
    rng = np.random.default_rng([seed, number])
    scene = random_scene(rng)
    return moved(scene, rng) if number % 2 else scene


def true_numbers_of(scene: Scene, highest_order: int) -> dict[str, float]:
    """Return numbers as good as true, none where they cannot be had; off the axis orders of answers matter."""
    if not scene.placement.offset_mm:
        return true_numbers(scene, TRUE_FINITE, "finite")[1]
    true_order = min(highest_order + FINER, HIGHEST_SOLID)
    return true_numbers(scene, [Level(GRADED, true_order)], "small")[1] if true_order > highest_order else {}


TrueNumbers = Callable[[Scene, int], dict[str, float]]


def answers(scene: Scene, true_of: TrueNumbers = true_numbers_of) -> list[ToleranceAnswer]:
    """Return what is answered at each tolerance, from the loosest on; what is refused at one is not tried tighter."""
    found: list[tuple[Solution | None, ToleranceAnswer]] = []
    for tolerance in TOLERANCES:
        looser = found[-1][1] if found else None
        if looser and looser.refusal:
            found.append((None, replace(looser, tolerance=tolerance)))
        else:
            found.append(_answer(scene, tolerance))
    given = [solution for solution, _ in found if solution]
    highest_order = max((one.plan.order for one in given), default=0) if scene.placement.offset_mm else 0
    truth = true_of(scene, highest_order) if given else {}
    return [replace(one, stated_and_true=_pairs(solution, truth)) if solution else one for solution, one in found]


def _answer(scene: Scene, tolerance: float) -> tuple[Solution | None, ToleranceAnswer]:
    began = time.perf_counter()
    place = "off the axis" if scene.placement.offset_mm else "centred"
    try:
        climbed = held(climb(scene, [scene.press], tolerance=tolerance, within_s=WITHIN_S, best=False), best=False)
    except PressFailed as failed:
        return None, ToleranceAnswer(tolerance, place, "", time.perf_counter() - began, {}, str(failed))
    solution = climbed.solutions[0]
    return solution, ToleranceAnswer(tolerance, place, solution.plan.level, time.perf_counter() - began, {})


def _pairs(solution: Solution, truth: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Return stated and true relative error of every feature that counts and is not prescribed."""
    by_force = solution.scene.press.force_n is not None
    uncounted = ("total_deformation_mm3", "force_n") if by_force else ("indentation_mm",)
    found = numbers(solution.rays, solution.pressed, solution.baseline)
    return {
        name: (stated, abs(found[name] - truth[name]) / abs(truth[name]))
        for name, stated in solution.stated_error.items()
        if name not in uncounted and truth.get(name)
    }


def tolerances_chapter(scenes: int = SCENES, seed: int = SEED, jobs: int = -1, keep: Path | None = None) -> Chapter:
    """Return the chapter on tolerances asked for, held and refused, and on stated over true errors by level."""
    return as_chapter(measure(scenes, seed, jobs, keep))


def as_chapter(found: Sequence[Sequence[ToleranceAnswer]]) -> Chapter:
    """Return the chapter of measured answers."""
    flat = [one for scene in found for one in scene]
    return Chapter(
        "Tolerances",
        f"{len(found)} random scenes far beyond the training box, every other one off the axis: what is answered is "
        "within the tolerance, all else is refused in words. Inclusions of 1-25 mm, 0.5-20 mm deep, of 1-1000 kPa, in "
        "tissue of 2-30 kPa and slabs of 12-80 mm. Indentations of 0.1-4 mm, half of them by force. "
        "The strain measure is chosen by the tolerance. Centred answers are compared with finite strain on the finest "
        "level that takes the press, without what its mesh errs in small strain. Off the axis there is no finite "
        "strain: answers are compared with small strain two orders higher, at most order 6, and what small strain "
        "departs by is not judged. What is refused at one tolerance is not tried at a tighter one.",
        "No reference: a finer level of the same model.",
        tuple(_judged(flat, len(found))),
        (
            Table(
                "By place and tolerance",
                ("place", "tolerance", "scenes", "answered", "judged", "held", "refused", "median seconds"),
                tuple(_rows(flat, lambda one: (one.place, f"{100 * one.tolerance:g} %"), _shares)),
            ),
            Table(
                "Stated over true error of every answer, by level",
                ("place", "level", "statements", "held", "median of stated over true", "least"),
                tuple(_rows([one for one in flat if one.is_judged], lambda one: (one.place, one.level), _ratios)),
            ),
            Table("Why scenes were refused at 5 %", ("place", "scenes", "reason"), tuple(_refusals(flat))),
        ),
    )


def _judged(flat: Sequence[ToleranceAnswer], scenes: int) -> Iterable[Benchmark]:
    for tolerance in TOLERANCES:
        given = [one for one in flat if one.tolerance == tolerance and one.is_judged]
        case = f"{100 * tolerance:g} %, {scenes} scenes"
        share = sum(one.is_held for one in given) / len(given) if given else float("nan")
        yield at_least(case, f"share of {len(given)} answers truly within the tolerance", share, REQUIRED_SHARE)


def _rows(
    answered: Sequence[ToleranceAnswer],
    key: Callable[[ToleranceAnswer], tuple[str, str]],
    shown: Callable[[Sequence[ToleranceAnswer]], tuple[str, ...]],
) -> list[tuple[str, ...]]:
    return [
        (*name, *shown([one for one in answered if key(one) == name])) for name in dict.fromkeys(map(key, answered))
    ]


def _shares(mine: Sequence[ToleranceAnswer]) -> tuple[str, ...]:
    given = [one for one in mine if not one.refusal]
    judged = [one for one in given if one.is_judged]
    seconds = f"{np.median([one.seconds for one in given]):.2f}" if given else ""
    within = str(sum(one.is_held for one in judged))
    return str(len(mine)), str(len(given)), str(len(judged)), within, str(len(mine) - len(given)), seconds


def _ratios(mine: Sequence[ToleranceAnswer]) -> tuple[str, ...]:
    stated, true = np.array([pair for one in mine for pair in one.stated_and_true.values()]).T
    ratio, within = stated / np.maximum(true, UNRESOLVED), true <= np.maximum(stated, UNRESOLVED)
    return str(len(ratio)), f"{within.mean():.3f}", f"{np.median(ratio):.1f}", f"{ratio.min():.2g}"


REASONS = {
    "small strain may depart": "small strain departs by more, and finite strain does not serve the scene",
    "is only good to": "no level states less within the time",
    "turn probe or tissue inside out": "small strain turns matter inside out",
    "could be followed only to": "out of reach in finite strain",
}
"""What a refusal says, in short."""


def _refusals(flat: Sequence[ToleranceAnswer]) -> list[tuple[str, ...]]:
    refused = [one for one in flat if one.tolerance == TOLERANCES[0] and one.refusal]
    named = [
        (one.place, next((why for said, why in REASONS.items() if said in one.refusal), one.refusal)) for one in refused
    ]
    return [(place, str(named.count((place, why))), why) for place, why in dict.fromkeys(named)]
