"""Everything behind the standard and the precise mode, from the virtual probe's tables to what the bundle holds.

Random presses make the surrogate, and the second harmonics of round inclusions; recordings of random presses the
camera's noise; surrogate and noise endless training presses for the networks. Inclusions around the trained ranges make
the networks that tell what lies outside. Presses that nobody has learned from give the belts of every interval;
recordings with every drift give the critical values of misfit, elongation and odds, and the errors that the card
states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.ramp_modes.ellipticity import EllipticityTest
from device.measurement.ramp_modes.model import RAMP_MODES, RampAnswers
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.surrogate import PressSurrogate
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.camera_noise import camera_noise
from host_tools.press_models.fit_surrogate import (
    fit_second_harmonics,
    fit_surrogate,
    held_out_error,
    held_out_second_harmonics,
)
from host_tools.press_models.mode_outcome import ModeOutcome, critical_log_odds, evaluate_mode
from host_tools.press_models.noisy_presses import random_press_set
from host_tools.press_models.press_samples import PressSamples, draw_parameters, sample_presses
from host_tools.press_models.recorded_presses import record_presses
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_ensemble import DenseEnsemble, train_ensemble
from host_tools.press_models.train_range import RangeBudget, TrainedRange, train_range
from host_tools.probe_tables.out_of_range_table import WideTable


@dataclass(frozen=True)
class TrainingBudget:
    """How many presses go into each step; the defaults take some ninety minutes on two cores."""

    presses: int = 10_000
    held_out: int = 600
    noise_recordings: int = 200
    trained_on: int = 120_000
    members: int = 4
    steps: int = 9_000
    evaluated: int = 30_000
    fitted: int = 14_000
    test_recordings: int = 1_200
    ranges: RangeBudget = field(default_factory=RangeBudget)


DRY_RUN = TrainingBudget(3_200, 100, 40, 20_000, 2, 900, 12_000, 1_200, 40, RangeBudget(4_600, 100, 20_000, 1, 900))
"""Enough to try the chain; the model is a poor one."""


@dataclass(frozen=True, eq=False)
class TrainedRamp:
    """All parts of the bundle."""

    surrogate: PressSurrogate
    surrogate_error: Array
    round_error: Array
    noise: dict[Mode, PressNoise]
    ensemble: DenseEnsemble
    ranges: TrainedRange
    ellipticity: EllipticityTest
    outcomes: dict[Mode, ModeOutcome]
    samples: PressSamples
    budget: TrainingBudget
    seed: int


def train_ramp(
    tables: ProbeTables,
    wide: WideTable,
    *,
    budget: TrainingBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> TrainedRamp:
    """Return the trained parts; `wide` are faces around the trained ranges, `say` hears what begins.

    The same seed gives the same parts whatever `jobs`.
    """
    asked = budget or TrainingBudget()
    say(f"{asked.presses} random presses")
    samples = sample_presses(tables, asked.presses + asked.held_out, seed=derived_seed(seed, "surrogate"), jobs=jobs)
    learned, kept = samples.split(asked.presses)
    surrogate = fit_surrogate(learned)
    say(f"{asked.noise_recordings} recordings for the noise of each mode")
    camera = {
        mode: camera_noise(
            tables, mode, asked.noise_recordings, seed=derived_seed(seed, f"camera of {mode}"), jobs=jobs
        )
        for mode in RAMP_MODES
    }
    noise = {mode: PressNoise(of_mode.rows) for mode, of_mode in camera.items()}
    ellipticity = EllipticityTest(
        surrogate,
        fit_second_harmonics(learned),
        {mode: of_mode.second_harmonics for mode, of_mode in camera.items()},
    )
    say(f"{asked.members} networks")
    training_set = random_press_set(
        surrogate, noise["standard"], asked.trained_on, derived_seed(seed, "training presses")
    )
    ensemble = train_ensemble(training_set, seed=seed, members=asked.members, steps=asked.steps, jobs=jobs)
    ranges = train_range(tables, wide, noise, budget=asked.ranges, seed=seed, jobs=jobs, say=say)
    answers = RampAnswers(surrogate, noise)
    outcomes = evaluate_modes(tables, ensemble, answers, ranges, ellipticity, asked, seed=seed, jobs=jobs, say=say)
    errors = held_out_error(surrogate, kept), held_out_second_harmonics(ellipticity, kept)
    return TrainedRamp(surrogate, *errors, noise, ensemble, ranges, ellipticity, outcomes, samples, asked, seed)


def evaluate_modes(
    tables: ProbeTables,
    ensemble: DenseEnsemble,
    answers: RampAnswers,
    ranges: TrainedRange,
    ellipticity: EllipticityTest,
    budget: TrainingBudget,
    *,
    seed: int,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> dict[Mode, ModeOutcome]:
    """Return what each mode makes of random presses with noise, and of recordings that drift."""
    simulating, recording = derived_seed(seed, "judged presses"), derived_seed(seed, "judged recordings")
    parameters = draw_parameters(budget.test_recordings, np.random.default_rng(recording))
    outcomes: dict[Mode, ModeOutcome] = {}
    for mode, simulated in zip(RAMP_MODES, (budget.evaluated, budget.fitted), strict=True):
        say(f"{simulated} presses and {len(parameters)} recordings for the limits of mode {mode}")
        evaluation_set = random_press_set(answers.surrogate, answers.noise[mode], simulated, simulating)
        recorded = record_presses(tables, parameters, mode, seed=recording, levels=ErrorLevels(), jobs=jobs)
        usual = critical_log_odds(ranges.networks[mode], recorded.rows, answers.noise[mode])
        outcomes[mode] = evaluate_mode(
            mode,
            ensemble,
            answers,
            evaluation_set,
            recorded,
            ellipticity,
            outside_log_odds=usual,
            seed=simulating,
            jobs=jobs,
        )
    return outcomes
