"""Presses at one force, as commissioning believes in probe and hand, to a commissioned probe's own mode quick.

Each press that the network learns from is of another probe that the phantoms allow, held by another hand on another
skin. So the network learns what of an image the inclusion alone makes, and its belts allow for all else. Mode quick has
no best fit that would tell a foreign press: what it refuses is an oblong spot, and contrast that no such press has.
Noise of the camera is the design's, of one frame. Source: docs/own_probe.md; training: `press_models/quick_training`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.bundle import ModelBundle
from device.measurement.parameters import normalise
from device.measurement.quick_mode.model import SEEN_BY
from device.measurement.quick_mode.profile import QUICK_FORCES_N, elongation_ratio
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    FIRST,
    FIRST_ACROSS,
    FORCES,
    SECOND,
    SECOND_ACROSS,
)
from device.measurement.ramp_modes.surrogate import MODULUS
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.believed_presses import BelievedAnswers, without_noise
from host_tools.press_models.confidence_belts import confidence_belts
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.quick_training import (
    CRITICAL_RATIO,
    QuickBudget,
    QuickOutcome,
    QuickPressSet,
    TrainedQuick,
    camera_of_a_hold,
    faintest_contrast,
    force_weights,
    quick_rows,
    spread_answers,
)
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_ensemble import train_ensemble

OWN_BUDGET = QuickBudget(trained_on=30_000, evaluated=15_000, test_recordings=0)
"""Presses that the networks learn from and are judged on: some four minutes on two cores."""
BLOCK = 250
"""Presses that one job draws."""
NOWHERE = np.zeros(0)


class OwnQuick(NamedTuple):
    """The trained parts of a commissioned probe's mode quick, and what its answers are worth by belief."""

    trained: TrainedQuick
    believed: BelievedAnswers


class BelievedHolds(NamedTuple):
    """Coordinates [n, 9] of presses as believed, their rows [n, 12] but for noise, and elongation ratios [n]."""

    normalised: Array
    rows: Array
    elongation: Array


def train_own_quick(
    answers: OwnAnswers,
    tables: ProbeTables,
    design: ModelBundle,
    *,
    budget: QuickBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> OwnQuick:
    """Return mode quick of the probe that `answers` are of; tables and bundle of mode quick are the design's."""
    budget = budget or OWN_BUDGET
    say(f"{budget.trained_on + budget.evaluated} presses at one force, for mode quick")
    camera = camera_of_a_hold(tables, budget.recordings, derived_seed(seed, "camera of quick"), jobs)

    def believed(count: int, purpose: str) -> tuple[BelievedHolds, QuickPressSet]:
        holds = believed_holds(answers, count, derived_seed(seed, purpose), jobs)
        normalised, rows = (part.astype(np.float32) for part in (holds.normalised, holds.rows))
        return holds, QuickPressSet(normalised, rows, camera, answers.noise.levels)

    _, training_set = believed(budget.trained_on, "training presses of own quick")
    ensemble = train_ensemble(training_set, seed=seed, members=budget.members, steps=budget.steps, jobs=jobs)
    fresh, fresh_set = believed(budget.evaluated, "judged presses of own quick")
    rng = np.random.default_rng(derived_seed(seed, "judged noise of own quick"))
    noisy = fresh_set.noisy(np.arange(budget.evaluated), rng).astype(np.float64)
    found, half = spread_answers(ensemble, noisy, fresh.normalised), budget.evaluated // 2
    seen, others = found.part(slice(half)), found.part(slice(half, None))
    belts = confidence_belts(seen.truth, seen.mean, seen.spread, seen.truth[:, MODULUS])
    of_design = float(design.card["modes"]["quick"]["elongation_ratio"])
    limit = max(of_design, float(np.quantile(fresh.elongation[:half], CRITICAL_RATIO)))
    outcome = QuickOutcome(belts, limit, others.within(belts))
    trained = TrainedQuick(ensemble, training_set, faintest_contrast(training_set), outcome, budget, seed)
    is_answered = _is_answered(trained, noisy[half:], fresh.elongation[half:])
    seconds = _seconds(lambda: ensemble.estimate(noisy[:1]))
    count = len(is_answered)
    worth = BelievedAnswers(outcome.simulated, np.ones(count, np.intp), is_answered, np.full(count, seconds))
    return OwnQuick(trained, worth)


def believed_holds(answers: OwnAnswers, count: int, seed: int, jobs: int) -> BelievedHolds:
    """Return presses at random forces of mode quick, of a probe and of hands as they are believed."""
    blocks = [min(BLOCK, count - start) for start in range(0, count, BLOCK)]
    drawn = in_parallel(lambda number: _block(answers, blocks[number], [seed, number]), len(blocks), jobs)
    return BelievedHolds(*(np.concatenate(parts) for parts in zip(*drawn, strict=True)))


def _block(answers: OwnAnswers, count: int, seed: list[int]) -> BelievedHolds:
    rng = np.random.default_rng(seed)
    normalised = normalise(draw_parameters(count, rng))
    seen = np.concatenate([without_noise(answers, at, NOWHERE, rng)[0] for at in normalised])
    force_n = rng.uniform(*QUICK_FORCES_N, count)
    return BelievedHolds(normalised, quick_rows(seen[:, :COLUMNS], force_n), elongation_ratios(seen, force_n))


def elongation_ratios(seen: Array, force_n: Array) -> Array:
    """Return the elongation ratio [n] at forces [n] of what is seen of presses [n, S], but for noise.

    As `quick_press` reads it of a frame, without the outermost ring of the second harmonic, which the frame cuts.
    """
    at_force = force_weights(force_n)

    def harmonic(along: slice, across: slice) -> Array:
        cosine, sine = (
            np.einsum("nk,nkj->nj", at_force, seen[:, part].reshape(len(seen), FORCES, -1)) for part in (along, across)
        )
        r_mm = RING_RADII_MM[1 : 1 + cosine.shape[1]]
        angle = np.arctan2(sine @ r_mm, cosine @ r_mm)[:, None]
        return np.asarray(cosine * np.cos(angle) + sine * np.sin(angle))

    parts = zip(harmonic(SECOND, SECOND_ACROSS), harmonic(FIRST, FIRST_ACROSS), strict=True)
    return np.array([elongation_ratio(second, first) for second, first in parts])


def _is_answered(trained: TrainedQuick, rows: Array, elongation: Array) -> NDArray[np.bool_]:
    """Return which rows [n, 12] get numbers, as `estimate_quick` decides."""
    contrast = rows[:, :RINGS]
    faintest = zip(SEEN_BY.values(), trained.faintest_contrast, strict=True)
    stands_out = np.any([contrast @ weights > least for weights, least in faintest], axis=0)
    low, high = trained.usual_rows
    inside = np.all((low <= rows) & (rows <= high), axis=1)
    return np.asarray(stands_out & inside & (elongation <= trained.outcome.elongation_ratio))


def _seconds(work: Callable[[], object], repeats: int = 20) -> float:
    began = time.thread_time()
    for _ in range(repeats):
        work()
    return (time.thread_time() - began) / repeats
