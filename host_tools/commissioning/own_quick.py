"""Presses at one force, as commissioning believes in probe and hand, to a commissioned probe's own mode quick.

Each press that the network learns from is of another probe that the phantoms allow, held by another hand on another
skin. So the network learns what of an image the inclusion alone makes, and its belts allow for all else. Mode quick has
no best fit that would tell a foreign press: what it refuses is an oblong spot, contrast that no such press has, and
contrast that hand and skin make where there is no inclusion. Noise of the camera is the design's, of one frame.
Source: docs/own_probe.md; training: `press_models/quick_training`.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.bundle import ModelBundle
from device.measurement.parameters import PARAMETERS, denormalise, normalise
from device.measurement.quick_mode.model import SEEN_BY
from device.measurement.quick_mode.profile import QUICK_FORCES_N, quick_press
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import COLUMNS
from device.measurement.recording.ring_means import RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.commissioning.believed_presses import BelievedAnswers, inclusion_free, without_noise
from host_tools.press_models.confidence_belts import confidence_belts
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.quick_training import (
    CRITICAL_RATIO,
    HarmonicNoise,
    HeldHarmonics,
    QuickBudget,
    QuickOutcome,
    QuickPressSet,
    TrainedQuick,
    camera_of_a_hold,
    held_harmonics,
    quick_rows,
    spread_answers,
)
from host_tools.press_models.recorded_presses import in_parallel, recorded_press
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_ensemble import DenseEnsemble, train_ensemble

OWN_BUDGET = QuickBudget(trained_on=30_000, belts_of=7_500, evaluated=7_500, test_recordings=0)
"""Presses that networks and belts are made of, and are judged on: some four minutes on two cores."""
BLOCK = 250
"""Presses that one job draws."""
INCLUSION_FREE = 4_000
"""Presses without an inclusion, of which the faintest contrast that counts is told."""
MIDDLE: Array = denormalise(np.zeros((1, len(PARAMETERS))))[0]
REPEATS = 9
NOWHERE = np.zeros(0)


class OwnQuick(NamedTuple):
    """The trained parts of a commissioned probe's mode quick, and what its answers are worth by belief."""

    trained: TrainedQuick
    believed: BelievedAnswers


class BelievedHolds(NamedTuple):
    """Coordinates [n, 9] of presses as believed, their rows [n, 12] but for noise, and their harmonics."""

    normalised: Array
    rows: Array
    harmonics: HeldHarmonics


class SeenHolds(NamedTuple):
    """Rows [n, 12] of held presses with noise, and elongation ratios [n]."""

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
    noise = answers.noise

    def seeded(purpose: str) -> int:
        return derived_seed(seed, f"{purpose} of own quick")

    others_of = budget.belts_of + budget.evaluated
    say(f"{budget.trained_on + others_of} presses at one force, for mode quick")
    camera = camera_of_a_hold(tables, budget.recordings, derived_seed(seed, "camera of quick"), jobs)
    known = believed_holds(answers, budget.trained_on, seeded("training presses"), jobs)
    training_set = _press_set(known, camera, noise)
    say(f"{budget.members} networks of mode quick")
    ensemble = train_ensemble(training_set, seed=seed, members=budget.members, steps=budget.steps, jobs=jobs)
    say("limits of mode quick")
    fresh = believed_holds(answers, others_of, seeded("judged presses"), jobs)
    seen = with_noise(fresh, camera, noise, seeded("judged noise"))
    empty = believed_holds(answers, INCLUSION_FREE, seeded("inclusion-free presses"), jobs, are_inclusion_free=True)
    faintest = faintest_that_counts(with_noise(empty, camera, noise, seeded("inclusion-free noise")).rows)
    found, of_belts = spread_answers(ensemble, seen.rows, fresh.normalised), budget.belts_of
    first, others = found.part(slice(of_belts)), found.part(slice(of_belts, None))
    belts = confidence_belts(first)
    of_design = float(design.card["modes"]["quick"]["elongation_ratio"])
    limit = max(of_design, float(np.quantile(seen.elongation[:of_belts], CRITICAL_RATIO)))
    outcome = QuickOutcome(belts, limit, others.within(belts))
    trained = TrainedQuick(ensemble, training_set, faintest, outcome, budget, seed)
    is_answered = has_numbers(trained, SeenHolds(*(part[of_belts:] for part in seen)))
    seconds = np.full(len(is_answered), _seconds(tables, ensemble))
    return OwnQuick(
        trained, BelievedAnswers(outcome.simulated, np.ones(len(is_answered), np.intp), is_answered, seconds)
    )


def believed_holds(
    answers: OwnAnswers, count: int, seed: int, jobs: int, *, are_inclusion_free: bool = False
) -> BelievedHolds:
    """Return presses at random forces of mode quick, of a probe and of hands as they are believed.

    Those that `are_inclusion_free` are as of `inclusion_free`.
    """
    blocks = [min(BLOCK, count - start) for start in range(0, count, BLOCK)]

    def drawn(number: int) -> BelievedHolds:
        return _block(
            answers, blocks[number], np.random.default_rng([seed, number]), are_inclusion_free=are_inclusion_free
        )

    parts = in_parallel(drawn, len(blocks), jobs)
    waves = zip(*(part.harmonics for part in parts), strict=True)
    return BelievedHolds(
        np.concatenate([part.normalised for part in parts]),
        np.concatenate([part.rows for part in parts]),
        HeldHarmonics(*map(np.concatenate, waves)),
    )


def _block(answers: OwnAnswers, count: int, rng: np.random.Generator, *, are_inclusion_free: bool) -> BelievedHolds:
    normalised = normalise(draw_parameters(count, rng))
    normalised = inclusion_free(normalised) if are_inclusion_free else normalised
    each = [without_noise(answers, at, NOWHERE, rng)[0] for at in normalised]
    seen, force_n = np.concatenate(each), rng.uniform(*QUICK_FORCES_N, count)
    return BelievedHolds(normalised, quick_rows(seen[:, :COLUMNS], force_n), held_harmonics(seen, force_n))


def _press_set(holds: BelievedHolds, camera: Array, noise: PressNoise) -> QuickPressSet:
    return QuickPressSet(holds.normalised.astype(np.float32), holds.rows.astype(np.float32), camera, noise.levels)


def with_noise(holds: BelievedHolds, camera: Array, noise: PressNoise, seed: int) -> SeenHolds:
    """Return what is seen of presses, with noise of the camera (contrast's covariance [11, 11]) and smooth errors."""
    rng = np.random.default_rng(seed)
    rows = _press_set(holds, camera, noise).noisy(np.arange(len(holds.rows)), rng).astype(np.float64)
    harmonics = HarmonicNoise(noise, camera).add(holds.harmonics, holds.rows[:, :RINGS], rng)
    return SeenHolds(rows, harmonics.elongation_ratios())


def faintest_that_counts(rows: Array) -> tuple[float, ...]:
    """Return the contrasts of `SEEN_BY` that presses [n, 12] without an inclusion exceed together in a share of
    1 - `CRITICAL_RATIO` at most."""
    of_each = 1 - (1 - CRITICAL_RATIO) / len(SEEN_BY)
    return tuple(float(np.quantile(rows[:, :RINGS] @ weights, of_each)) for weights in SEEN_BY.values())


def has_numbers(trained: TrainedQuick, seen: SeenHolds) -> NDArray[np.bool_]:
    """Return which presses get numbers [n], as `estimate_quick` decides."""
    low, high = trained.usual_rows
    inside = np.all((low <= seen.rows) & (seen.rows <= high), axis=1)
    return np.asarray(stands_out(trained, seen.rows) & inside & (seen.elongation <= trained.outcome.elongation_ratio))


def stands_out(trained: TrainedQuick, rows: Array) -> NDArray[np.bool_]:
    """Return in which rows [n, 12] contrast exceeds that of the camera's noise and hands alone [n]."""
    faintest = zip(SEEN_BY.values(), trained.faintest_contrast, strict=True)
    return np.asarray(np.any([rows[:, :RINGS] @ weights > least for weights, least in faintest], axis=0))


def _seconds(tables: ProbeTables, ensemble: DenseEnsemble) -> float:
    """Return the processor's time of an answer to one recorded press: frames to numbers."""
    recording = recorded_press(tables, MIDDLE, "quick", 1)
    took = []
    for _ in range(REPEATS):
        began = time.thread_time()
        ensemble.estimate(quick_press(recording).row[None])
        took.append(time.thread_time() - began)
    return float(np.median(took))
