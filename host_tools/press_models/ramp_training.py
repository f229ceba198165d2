"""Everything behind modes standard and precise, from the virtual probe's tables to what the bundle holds.

Random presses, near the inclusion and beside it, make the surrogate; recordings of random presses the camera's noise;
presses kept apart and inclusions solved anew what polynomials and tables miss; surrogate and noise endless training
presses for the networks that say where a fit begins. Inclusions around the trained ranges make the networks that tell
what lies outside. Presses that nobody has learned from tell how often intervals hold; recordings with every drift give
the critical values of misfit, elongation and odds, and the errors that the card states.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from device.measurement.arrays import Array
from device.measurement.mode import Mode
from device.measurement.parameters import normalise
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.radial_profile import network_rows
from device.measurement.ramp_modes.surrogate import OFFSET
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.fit_surrogate import fit_surrogate, held_out_error
from host_tools.press_models.measured_noise import camera_noise, surrogate_error, table_error
from host_tools.press_models.mode_outcome import THREE, Guess, ModeOutcome, answers_to, evaluated, outcome_of
from host_tools.press_models.noisy_presses import NetworkPresses, random_press_set, random_scan
from host_tools.press_models.press_samples import PressSamples, draw_beside, draw_parameters, sample_presses
from host_tools.press_models.recorded_presses import in_parallel, record_presses
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_ensemble import DenseEnsemble, train_ensemble
from host_tools.press_models.train_range import RangeBudget, TrainedRange, train_range
from host_tools.probe_tables.out_of_range_table import WideTable

FURTHER_MM, STRAY_MM, NEAREST_MM = (3.0, 4.0, 2.0, 5.0), 1.0, 0.5
"""Where the further ramps of a scan are meant to lie, how far a hand strays from there, and the least that counts."""


@dataclass(frozen=True)
class TrainingBudget:
    """How many presses go into each step; the defaults take 100 minutes on two cores.

    `presses` and `beside` are many times the polynomials' terms: with a third of them those miss large, shallow and
    soft inclusions by far more than a scan's noise, and its intervals hold too seldom.
    """

    presses: int = 30_000
    beside: int = 36_000
    held_out: int = 600
    noise_recordings: int = 1_200
    noise_recordings_beside: int = 1_000
    solved_anew: int = 120
    trained_on: int = 120_000
    members: int = 4
    steps: int = 9_000
    evaluated: int = 20_000
    evaluated_scans: int = 2_000
    test_recordings: int = 600
    test_scans: int = 600
    ranges: RangeBudget = field(default_factory=RangeBudget)
    detail_ratio: float = 1.0
    """Reach of the polynomials' degrees over that of the probe's own (`fit_surrogate`)."""


DRY_RUN = TrainingBudget(
    400, 400, 40, 24, 24, 2, 20_000, 1, 400, 30, 6, 10, 6, RangeBudget(400, 30, 20_000, 1, 400, 0.32), 0.32
)
"""Enough to try the chain; the model is a poor one."""


@dataclass(frozen=True, eq=False)
class TrainedRamp:
    """All parts of the bundle; errors [P] of the surrogate's columns on presses kept apart, near and beside."""

    answers: RampAnswers
    surrogate_error: Array
    beside_error: Array
    ensemble: DenseEnsemble
    ranges: TrainedRange
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
    say(f"{asked.presses} random presses near the inclusion and {asked.beside} beside it")
    near = sample_presses(tables, asked.presses + asked.held_out, seed=derived_seed(seed, "surrogate"), jobs=jobs)
    beside = sample_presses(
        tables,
        asked.beside + asked.held_out,
        seed=derived_seed(seed, "surrogate beside"),
        draw=draw_beside,
        jobs=jobs,
    )
    (learned, kept), (learned_beside, kept_beside) = near.split(asked.presses), beside.split(asked.beside)
    surrogate = fit_surrogate(learned, learned_beside, asked.detail_ratio)
    say(f"{asked.noise_recordings + asked.noise_recordings_beside} recordings for the noise")
    camera = camera_noise(tables, asked.noise_recordings, asked.noise_recordings_beside, seed=seed, jobs=jobs)
    say(f"{asked.solved_anew} inclusions solved anew, for what the tables miss")
    missed = table_error(tables, asked.solved_anew, seed=derived_seed(seed, "inclusions solved anew"), jobs=jobs)
    forward = surrogate_error(surrogate, kept, kept_beside) + missed
    answers = RampAnswers(surrogate, PressNoise(camera, forward=forward))
    say(f"{asked.members} networks")
    training_set = random_press_set(surrogate, answers.noise, asked.trained_on, derived_seed(seed, "training presses"))
    ensemble = train_ensemble(
        NetworkPresses(training_set), seed=seed, members=asked.members, steps=asked.steps, jobs=jobs
    )
    ranges = train_range(tables, wide, answers.noise, budget=asked.ranges, seed=seed, jobs=jobs, say=say)
    evaluation = ModeEvaluation(tables, answers, guess_of(ensemble), log_odds_of(ranges), seed, jobs, say)
    outcomes = evaluation.outcomes(asked)
    errors = held_out_error(surrogate, kept), held_out_error(surrogate, kept_beside)
    return TrainedRamp(answers, *errors, ensemble, ranges, outcomes, near, asked, seed)


def guess_of(ensemble: DenseEnsemble) -> Guess:
    """Return an ensemble's first guesses of presses, rows [N, P]."""
    return lambda rows: ensemble.estimate(network_rows(rows))[0]


def log_odds_of(ranges: TrainedRange) -> Callable[[Array], Array]:
    """Return the log odds of presses, rows [n, P]."""
    return lambda rows: ranges.network.log_odds(network_rows(rows))


@dataclass(frozen=True, eq=False)
class ModeEvaluation:
    """What modes make of random presses with noise, and of recordings that drift."""

    tables: ProbeTables
    answers: RampAnswers
    guess: Guess
    log_odds: Callable[[Array], Array]
    seed: int = 1
    jobs: int = -1
    say: Callable[[str], None] = lambda step: None

    def outcomes(self, budget: TrainingBudget) -> dict[Mode, ModeOutcome]:
        """Return the outcome of modes standard and precise."""
        return {
            "standard": self.of_mode("standard", budget.evaluated, budget.test_recordings),
            "precise": self.of_mode("precise", budget.evaluated_scans, budget.test_scans),
        }

    def of_mode(self, mode: Mode, simulated: int, recordings: int) -> ModeOutcome:
        """Return the outcome of a mode on simulated presses or scans, and on recordings of as many."""
        self.say(f"{simulated} presses and {recordings} recordings of mode {mode}")
        seed = derived_seed(self.seed, "judged presses" if mode == "standard" else "judged scans")
        rng = np.random.default_rng(seed)
        at = normalise(draw_parameters(simulated, rng))
        further = further_offsets_mm(simulated, rng) if mode == "precise" else [np.zeros(0)] * simulated
        answers = self.answers  # what says what begins may hold a lock, which no process takes along
        drawn = in_parallel(lambda i: _simulated(answers, at[i], further[i], [seed, i]), simulated, self.jobs)
        rows, directions = zip(*drawn, strict=True)
        answered = evaluated(at[:, :THREE], answers_to(self.answers, self.guess, rows, directions, self.jobs))
        recording = derived_seed(self.seed, "judged recordings" if mode == "standard" else "judged recorded scans")
        rng = np.random.default_rng(recording)
        parameters = draw_parameters(recordings, rng)
        recorded = record_presses(
            self.tables,
            parameters,
            mode,
            seed=recording,
            levels=ErrorLevels(),
            further_mm=further_offsets_mm(recordings, rng) if mode == "precise" else (),
            jobs=self.jobs,
        )
        seen_in = [one.direction_rad for one in recorded.seen]
        found = answers_to(self.answers, self.guess, recorded.rows, seen_in, self.jobs)
        ramps = np.array([1 + len(offsets_mm) for offsets_mm in further])
        return outcome_of(answered, recorded, found, self.answers, self.log_odds, ramps)


def _simulated(answers: RampAnswers, at: Array, further_mm: Array, seed: list[int]) -> tuple[Array, Array]:
    """Return rows and directions of a press or scan with noise."""
    offsets_mm = np.append(at[OFFSET] + 1, further_mm)
    return random_scan(answers.surrogate, answers.noise, at, offsets_mm, np.random.default_rng(seed))


def further_offsets_mm(count: int, rng: np.random.Generator) -> list[Array]:
    """Return the offsets of the further ramps of scans: one to four of them in turn, where a hand puts them."""
    farthest_mm = float(np.max(FURTHER_MM)) + STRAY_MM
    meant = [np.array(FURTHER_MM[: 1 + number % len(FURTHER_MM)]) for number in range(count)]
    return [np.clip(mm + STRAY_MM * rng.standard_normal(len(mm)), NEAREST_MM, farthest_mm) for mm in meant]
