"""Whether a tolerance that was asked for is held: random scenes far beyond the training box, climbed and solved again.

What `host_tools simulate` would answer at each tolerance is compared with the answer two orders higher. A scene is
answered within the tolerance, or it is refused in words; what would be silent is an answer outside it.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from joblib import Parallel, delayed

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.ladder import climb
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Chapter, Table, at_least, at_most
from host_tools.scenes.scene import Press, Scene, Tissue

TOLERANCES = (0.05, 0.01, 0.002)
REQUIRED_SHARE = 0.97
WITHIN_S = 600.0
"""Generous: a share of scenes is counted here, not the time of a machine."""
FINER = 2
"""How many orders above the tightest answer the true one is taken to be."""
UNRESOLVED = 1e-5
"""The true answer's own error."""
STIFFNESS_N_PER_MM = 0.2
"""Of the default scene in tissue of 5 kPa, about: random forces are of the random indentations."""


@dataclass(frozen=True)
class ToleranceAnswer:
    """One scene at one tolerance: what was stated and true of every feature, how it was got, and why it was refused."""

    tolerance: float
    order: int
    seconds: float
    stated_and_true: dict[str, tuple[float, float]]
    refusal: str = ""

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


def measure(scenes: int = 30, seed: int = 2027, jobs: int = -1) -> list[list[ToleranceAnswer]]:
    """Return every scene's answers, one a tolerance; a process a scene."""
    rng = np.random.default_rng(seed)
    chosen = [random_scene(rng) for _ in range(scenes)]
    return list(Parallel(n_jobs=jobs)(delayed(answers)(scene) for scene in chosen))


def answers(scene: Scene) -> list[ToleranceAnswer]:
    """Return what is answered at each tolerance, from the loosest on."""
    found: list[tuple[Solution | None, ToleranceAnswer]] = [_answer(scene, tolerance) for tolerance in TOLERANCES]
    last = next((solution for solution, _ in reversed(found) if solution), None)
    if last is None:
        return [answered for _, answered in found]
    truth = _numbers(solve(scene, replace(last.plan, order=last.plan.order + FINER)))
    return [replace(one, stated_and_true=_pairs(solution, truth)) if solution else one for solution, one in found]


def _answer(scene: Scene, tolerance: float) -> tuple[Solution | None, ToleranceAnswer]:
    began = time.perf_counter()
    try:
        climbed = climb(scene, [scene.press], tolerance=tolerance, strain="small", within_s=WITHIN_S)
    except PressFailed as failed:
        return None, ToleranceAnswer(tolerance, 0, time.perf_counter() - began, {}, str(failed))
    solution = climbed.solutions[0]
    return solution, ToleranceAnswer(tolerance, solution.plan.order, time.perf_counter() - began, {}, climbed.missed)


def _pairs(solution: Solution, truth: dict[str, float]) -> dict[str, tuple[float, float]]:
    """Return stated and true relative error of every feature that counts and is not prescribed."""
    by_force = solution.scene.press.force_n is not None
    uncounted = ("total_deformation_mm3", "force_n") if by_force else ("indentation_mm",)
    found = _numbers(solution)
    return {
        name: (stated, abs(found[name] - truth[name]) / abs(truth[name]))
        for name, stated in solution.stated_error.items()
        if name not in uncounted and truth[name]
    }


def _numbers(solution: Solution) -> dict[str, float]:
    return numbers(solution.rays, solution.pressed, solution.baseline)


def tolerances_chapter(scenes: int = 30, jobs: int = -1) -> Chapter:
    """Return the chapter on tolerances asked for, held and refused, and on stated over true errors by order."""
    return as_chapter(measure(scenes, jobs=jobs))


def as_chapter(found: Sequence[Sequence[ToleranceAnswer]]) -> Chapter:
    """Return the chapter of measured answers."""
    judged, rows = [], []
    for i, tolerance in enumerate(TOLERANCES):
        asked = [scene[i] for scene in found]
        given = [one for one in asked if not one.refusal]
        case = f"{100 * tolerance:g} %, {len(asked)} scenes"
        held = sum(one.is_held for one in given) / max(len(given), 1)
        judged.append(at_least(case, "share of answers truly within the tolerance", held, REQUIRED_SHARE))
        silent = sum(not one.is_held for one in given) / len(asked)
        judged.append(at_most(case, "share of scenes answered outside it without a word", silent, 1 - REQUIRED_SHARE))
        seconds = np.median([one.seconds for one in given]) if given else np.nan
        orders = f"{min(one.order for one in given)}-{max(one.order for one in given)}" if given else ""
        rows.append((f"{100 * tolerance:g} %", str(len(given)), str(len(asked) - len(given)), orders, f"{seconds:.2f}"))
    header = ("tolerance", "answered", "refused", "orders", "median seconds")
    return Chapter(
        "Tolerances",
        f"{len(found)} random centred scenes far beyond the training box, in small strain: what is answered is within "
        "the tolerance, all else is refused in words. Inclusions of 1-25 mm, 0.5-20 mm deep, of 1-1000 kPa, in tissue "
        "of 2-30 kPa and slabs of 12-80 mm. Indentations of 0.1-4 mm, half of them by force.",
        "No reference: the same model two orders higher.",
        tuple(judged),
        (
            Table("By tolerance", header, tuple(rows)),
            Table(
                "Stated over true error of every answer, by order",
                ("order", "statements", "held", "median of stated over true", "least"),
                tuple(_by_order(found)),
            ),
        ),
    )


def _by_order(found: Sequence[Sequence[ToleranceAnswer]]) -> list[tuple[str, ...]]:
    given = [one for scene in found for one in scene if one.stated_and_true]
    rows: list[tuple[str, ...]] = []
    for order in sorted({one.order for one in given}):
        pairs = [pair for one in given if one.order == order for pair in one.stated_and_true.values()]
        stated, true = np.array(pairs).T
        ratio = stated / np.maximum(true, UNRESOLVED)
        held = true <= np.maximum(stated, UNRESOLVED)
        shown = (f"{held.mean():.3f}", f"{np.median(ratio):.1f}", f"{ratio.min():.2g}")
        rows.append((str(order), str(len(pairs)), *shown))
    return rows
