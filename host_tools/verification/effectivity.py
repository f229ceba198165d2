"""Whether the stated error holds the true one: random scenes against the finest tier, feature by feature."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed

from device.measurement.quantities import Inclusion
from host_tools.forward.accuracy import prescribed
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.plan import ModelPlan, model_plan
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Placement, Press, Scene
from host_tools.verification.level_tables import FEATURES, finest_plan

SMALLEST_SIZE_MM = 1.0
"""Inclusions below it move the face by less than a thousandth of what it is pressed: nobody sees them."""
REQUIRED_SHARE = 0.95
REFERENCE_NOISE = 1e-4
"""The finest tier's own error: a true error below it is not resolved, and counts as held."""


class Effectivity(NamedTuple):
    """One feature of one kind of solution over all scenes."""

    kind: str
    feature: str
    held_share: float
    median_ratio: float
    """Stated over true error: above 1 the statement is on the safe side."""
    worst_true: float


class _Case(NamedTuple):
    scene: Scene
    plan: ModelPlan
    truth_plan: ModelPlan


def measure_effectivity(
    *,
    scenes: int = 60,
    finite_scenes: int = 10,
    solid_scenes: int = 4,
    seed: int = 2026,
    jobs: int = -1,
    on_step: Callable[[str], None] = lambda what: None,
) -> list[Effectivity]:
    """Return the share of random scenes whose true error lies within the stated one, for every kind and feature."""
    rng = np.random.default_rng(seed)
    found: list[Effectivity] = []
    for kind, cases, processes in (
        ("small strain", [_small(rng) for _ in range(scenes)], jobs),
        ("finite strain", [_finite(rng) for _ in range(finite_scenes)], jobs),
        ("3-D", [_solid(rng) for _ in range(solid_scenes)], 1),
    ):
        if not cases:
            continue
        on_step(kind)
        rows = Parallel(n_jobs=processes)(delayed(_stated_and_true)(case) for case in cases)
        features = dict.fromkeys(feature for row in rows for feature in row)
        found += [_summary(kind, name, [row[name] for row in rows if name in row]) for name in features]
    return found


def _inclusion(rng: np.random.Generator) -> Inclusion:
    low, high = (SMALLEST_SIZE_MM, *PAPER_BOX_LOW[1:]), PAPER_BOX_HIGH
    return Inclusion(*(float(value) for value in rng.uniform(low, high)))


def _press(rng: np.random.Generator) -> Press:
    return Press(indentation_mm=1.0) if rng.random() < 0.5 else Press(force_n=0.5)


def _small(rng: np.random.Generator) -> _Case:
    scene = Scene(_inclusion(rng), _press(rng))
    return _Case(scene, model_plan(scene), finest_plan(scene))


def _finite(rng: np.random.Generator) -> _Case:
    scene = Scene(_inclusion(rng), Press(indentation_mm=float(rng.uniform(0.5, 2.0))))
    plan = model_plan(scene, strain="finite")
    return _Case(scene, plan, replace(plan, grading="blunt_fine", order=4))


def _solid(rng: np.random.Generator) -> _Case:
    """An inclusion off the axis, half symmetry; truth is one level finer.

    That is 0.1 % on the force, 0.01 % on the inclusion field.
    """
    inclusion = Inclusion(*(float(value) for value in rng.uniform((4.0, 4.0, 40.0), (12.0, 9.0, 120.0))))
    scene = Scene(inclusion, _press(rng), placement=Placement(offset_x_mm=float(rng.uniform(1.0, 9.0))))
    plan = model_plan(scene)
    return _Case(scene, plan, replace(plan, grading="fine"))


def _stated_and_true(case: _Case) -> dict[str, tuple[float, float]]:
    solution = solve(case.scene, case.plan, estimate_error=True)
    found, truth = _numbers(solution), _numbers(solve(case.scene, case.truth_plan))
    errors = {name: abs(value - truth[name]) / abs(truth[name]) for name, value in found.items() if truth[name]}
    scored = FEATURES[prescribed(case.scene)]
    return {name: (solution.stated_error[name], error) for name, error in errors.items() if name in scored}


def _numbers(solution: Solution) -> dict[str, float]:
    return numbers(solution.rays, solution.pressed, solution.baseline)


def _summary(kind: str, feature: str, pairs: list[tuple[float, float]]) -> Effectivity:
    stated, true = np.array(pairs).T
    held = true <= np.maximum(stated, REFERENCE_NOISE)
    return Effectivity(
        kind, feature, float(held.mean()), float(np.median(stated / np.maximum(true, 1e-12))), float(true.max())
    )
