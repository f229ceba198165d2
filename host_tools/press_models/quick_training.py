"""Everything behind mode quick: the surrogate of the ramps, read at one force, to a network of one held press.

Two networks are enough: at one force the press says less than they could tell apart. The contrast at a force between
the profile's is the cubic through them. Light and cell drift, and smooth errors add to it, as `PressNoise` says for a
ramp; the camera's part is measured on recordings of mode quick.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array, Single
from device.measurement.confidence_belt import Belt
from device.measurement.parameters import normalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.quick_mode.model import SEEN_BY
from device.measurement.quick_mode.profile import QUICK_FORCES_N, QuickPress, elongation_ratio, quick_press
from device.measurement.ramp_modes.estimate import VISIBLE_DEVIATIONS
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise, smooth_ring_errors
from device.measurement.ramp_modes.radial_profile import (
    CONTRAST,
    FIRST,
    FIRST_ACROSS,
    PROFILE_FORCES_N,
    SECOND,
    SECOND_ACROSS,
)
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, PressRows
from device.measurement.recording.reference_light import EXPONENT
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.calibration.phantom import TARGET_N
from host_tools.press_models.confidence_belts import SpreadAnswers, confidence_belts, widened
from host_tools.press_models.measured_noise import exact_rows, shrunk_covariance
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.press_models.noisy_presses import Index, PressSet, random_press_set
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.recorded_presses import EXACT, in_parallel, recorded_press
from host_tools.press_models.seeds import derived_seed, press_seed
from host_tools.press_models.train_ensemble import DenseEnsemble, train_ensemble

CRITICAL_RATIO = 0.985
"""Share of recorded presses inside the trained ranges whose elongation is below the critical value: the only
rejection of its kind in mode quick, which has neither a best fit nor networks of the ranges."""


@dataclass(frozen=True)
class QuickBudget:
    """How many presses go into each step; the defaults take some five minutes on two cores."""

    recordings: int = 300
    trained_on: int = 60_000
    members: int = 2
    steps: int = 5_000
    belts_of: int = 150_000
    evaluated: int = 50_000
    test_recordings: int = 600


@dataclass(frozen=True, eq=False)
class QuickOutcome:
    """Belts and critical elongation; `simulated` presses that the belts have not seen, and `recorded` ones.

    Of a commissioned probe none were recorded but on phantoms.
    """

    belts: tuple[Belt, ...]
    elongation_ratio: float
    simulated: EvaluatedPresses
    recorded: EvaluatedPresses | None = None


@dataclass(frozen=True, eq=False)
class TrainedQuick:
    """All parts of the bundle."""

    ensemble: DenseEnsemble
    training_set: QuickPressSet
    faintest_contrast: tuple[float, ...]
    outcome: QuickOutcome
    budget: QuickBudget
    seed: int

    @cached_property
    def usual_rows(self) -> Array:
        """Return the ends [2, 12] between which rows with noise lie, but for one in two thousand at each."""
        every = np.arange(len(self.training_set.rows))
        rng = np.random.default_rng(derived_seed(self.seed, "usual rows of quick"))
        return np.quantile(self.training_set.noisy(every, rng).astype(np.float64), [0.0005, 0.9995], axis=0)


@dataclass(frozen=True, eq=False)
class RecordedHolds:
    """Parameters [n, 9], rows [n, 12] and elongation ratios [n] of recorded held presses."""

    parameters: Array
    rows: Array
    elongation: Array


def train_quick(
    tables: ProbeTables,
    surrogate: PressRows,
    noise: PressNoise,
    *,
    budget: QuickBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> TrainedQuick:
    """Return the trained parts; `noise` is of mode standard, whose camera's part is replaced by that of one frame."""
    asked = budget or QuickBudget()

    def press_set(count: int, purpose: str) -> QuickPressSet:
        drawn = derived_seed(seed, purpose)
        return quick_press_set(random_press_set(surrogate, noise, count, drawn), camera, drawn)

    say(f"{asked.recordings} recordings of held presses")
    camera = camera_of_a_hold(tables, asked.recordings, derived_seed(seed, "camera of quick"), jobs)
    say(f"{asked.members} networks")
    training_set = press_set(asked.trained_on, "training presses of quick")
    ensemble = train_ensemble(training_set, seed=seed, members=asked.members, steps=asked.steps, jobs=jobs)

    def answers_to(count: int, purpose: str) -> SpreadAnswers:
        presses = press_set(count, f"{purpose} presses of quick")
        rng = np.random.default_rng(derived_seed(seed, f"{purpose} noise of quick"))
        rows = presses.noisy(np.arange(count), rng).astype(np.float64)
        return spread_answers(ensemble, rows, presses.normalised.astype(np.float64))

    say(f"belts of {asked.belts_of} presses, judged on {asked.evaluated} others and {asked.test_recordings} recordings")
    of_belts, fresh = answers_to(asked.belts_of, "belts'"), answers_to(asked.evaluated, "judged")
    recording = derived_seed(seed, "judged recordings of quick")
    recorded = recorded_holds(tables, asked.test_recordings, recording, ErrorLevels(), jobs)
    faintest = faintest_contrast(training_set)
    return TrainedQuick(ensemble, training_set, faintest, _outcome(ensemble, of_belts, fresh, recorded), asked, seed)


def faintest_contrast(training_set: QuickPressSet) -> tuple[float, ...]:
    """Return the contrast of each of `SEEN_BY` below which nothing stands out from the noise."""
    none = training_set.typical_noise()[:RINGS, :RINGS]
    return tuple(VISIBLE_DEVIATIONS * float(np.sqrt(weights @ none @ weights)) for weights in SEEN_BY.values())


def recorded_holds(tables: ProbeTables, count: int, seed: int, levels: ErrorLevels, jobs: int) -> RecordedHolds:
    """Return what mode quick reads of random presses that are recorded."""
    parameters = draw_parameters(count, np.random.default_rng(seed))

    def read(i: int) -> QuickPress:
        return quick_press(recorded_press(tables, parameters[i], "quick", press_seed(seed, i), levels=levels))

    rows, elongation = zip(*in_parallel(read, count, jobs), strict=True)
    return RecordedHolds(parameters, np.array(rows), np.array(elongation))


def camera_of_a_hold(tables: ProbeTables, count: int, seed: int, jobs: int) -> Array:
    """Return the covariance [11, 11] of recorded contrast about the exact one, at the force that was reported."""
    recorded = recorded_holds(tables, count, seed, EXACT, jobs)
    ramps = exact_rows(tables, recorded.parameters, seed=seed, jobs=jobs)
    exact = quick_rows(ramps, recorded.rows[:, RINGS])
    return shrunk_covariance((recorded.rows - exact)[:, :RINGS] / (1 + exact[:, :RINGS]))


def _outcome(
    ensemble: DenseEnsemble, of_belts: SpreadAnswers, fresh: SpreadAnswers, recorded: RecordedHolds
) -> QuickOutcome:
    """Return belts and limits of some presses and half of the recordings, and the others to count on."""
    usual = slice(len(recorded.rows) // 2)
    evaluated = spread_answers(ensemble, recorded.rows, normalise(recorded.parameters))
    belts = widened(confidence_belts(of_belts), evaluated.part(usual))
    return QuickOutcome(
        belts,
        float(np.quantile(recorded.elongation[usual], CRITICAL_RATIO)),
        fresh.within(belts),
        evaluated.part(slice(usual.stop, None)).within(belts),
    )


def spread_answers(ensemble: DenseEnsemble, rows: Array, normalised: Array) -> SpreadAnswers:
    """Return what networks say of rows [n, 12] at coordinates [n, 9]."""
    return SpreadAnswers(normalised[:, : len(UNKNOWNS)], *ensemble.estimate(rows))


@dataclass(frozen=True, eq=False)
class QuickPressSet:
    """Coordinates [n, 9] and noise-free rows [n, 12] of held presses, and the camera's covariance [11, 11]."""

    normalised: Single
    rows: Single
    camera: Array
    levels: ErrorLevels = field(default_factory=ErrorLevels)

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, 12] of an index [m], with fresh noise on the contrast and the force."""
        rows = self.rows[index]
        light, force_n = 1 + rows[:, :RINGS], rows[:, RINGS]
        camera, smooth = (
            rng.standard_normal((len(rows), RINGS)) @ np.linalg.cholesky(part).T
            for part in (self.camera, self._smooth())
        )
        zero_n = self.levels.zero_n * rng.standard_normal(len(rows))
        drift = self.levels.gain_ratio * rng.standard_normal(len(rows)) - EXPONENT * zero_n / force_n
        contrast = rows[:, :RINGS] + light * (camera + smooth + drift[:, None])
        return np.column_stack([contrast, force_n + zero_n]).astype(np.float32)

    def typical_noise(self) -> Array:
        """Return the covariance [12, 12] of the noise of a row without an inclusion."""
        zero_ratio = EXPONENT * self.levels.zero_n / float(np.mean(QUICK_FORCES_N))
        covariance = np.zeros((RINGS + 1, RINGS + 1))
        covariance[:RINGS, :RINGS] = self.camera + self._smooth() + self.levels.gain_ratio**2 + zero_ratio**2
        covariance[RINGS, RINGS] = self.levels.zero_n**2
        return covariance

    def _smooth(self) -> Array:
        flat, model = smooth_ring_errors(self.levels, harmonic=0)
        return flat + model + 1e-14 * np.eye(RINGS)


class HeldHarmonics(NamedTuple):
    """First and second harmonics of holds, as cosine and sine: [n, 2, J - 1], and [n, 2, J - 2] without the outermost
    ring, which the frame cuts."""

    first: Array
    second: Array

    def elongation_ratios(self) -> Array:
        """Return how oblong each looks [n], as `quick_press` reads it of a frame with all rings."""
        second, first = (_along_its_direction(part) for part in (self.second, self.first))
        return np.array([elongation_ratio(*pair) for pair in zip(second, first, strict=True)])


def _along_its_direction(waves: Array) -> Array:
    cosine, sine = waves[:, 0], waves[:, 1]
    r_mm = RING_RADII_MM[1 : 1 + waves.shape[2]]
    angle = np.arctan2(sine @ r_mm, cosine @ r_mm)[:, None]
    return np.asarray(cosine * np.cos(angle) + sine * np.sin(angle))


@dataclass(frozen=True, eq=False)
class HarmonicNoise:
    """What the camera and smooth errors of the image do to the harmonics of one hold.

    `noise` is of a ramp; `camera` [11, 11] is the covariance of a hold's contrast, over which the ramp's says by how
    much less a frame tells than a ramp's polynomial.
    """

    noise: PressNoise
    camera: Array

    def add(self, exact: HeldHarmonics, contrast: Array, rng: np.random.Generator) -> HeldHarmonics:
        """Return harmonics with noise, for the contrast [n, 11] of the same holds."""
        parts = zip(exact, self._factors, (slice(1, None), slice(1, -1)), strict=True)
        return HeldHarmonics(
            *(
                part + (1 + contrast[:, None, rings]) * (rng.standard_normal(part.shape) @ factor.T)
                for part, factor, rings in parts
            )
        )

    @cached_property
    def _factors(self) -> tuple[Array, Array]:
        ratio = float(np.mean(np.diag(self.camera) / np.diag(self._of_ramp(CONTRAST))))

        def factor(order: int, columns: slice, rings: slice) -> Array:
            flat, model = (part[rings, rings] for part in smooth_ring_errors(self.noise.levels, harmonic=order))
            covariance = ratio * self._of_ramp(columns) + flat + model + 1e-14 * np.eye(len(flat))
            return np.asarray(np.linalg.cholesky(covariance))

        return factor(1, FIRST, slice(1, None)), factor(2, SECOND, slice(1, -1))

    def _of_ramp(self, columns: slice) -> Array:
        """Return the covariance of columns of a ramp at 0.5 N, ring by ring."""
        (weights,) = force_weights(np.array([TARGET_N]))
        camera = self.noise.camera[columns, columns]
        of_forces = camera.reshape(2 * (len(weights), len(camera) // len(weights)))
        return np.asarray(np.einsum("k,kjlm,l->jm", weights, of_forces, weights))


def held_harmonics(seen: Array, force_n: Array) -> HeldHarmonics:
    """Return the harmonics at forces [n] of what is seen of ramps [n, S], along and across their bright side."""
    weights = force_weights(force_n)

    def at_force(columns: slice) -> Array:
        of_forces = seen[:, columns].reshape(len(seen), len(PROFILE_FORCES_N), -1)
        return np.asarray(np.einsum("nk,nkj->nj", weights, of_forces))

    first, second = (
        np.stack([at_force(part) for part in pair], axis=1) for pair in ((FIRST, FIRST_ACROSS), (SECOND, SECOND_ACROSS))
    )
    return HeldHarmonics(first, second)


def quick_press_set(training_set: PressSet, camera: Array, seed: int) -> QuickPressSet:
    """Return a set of ramps as held presses, each at a random force."""
    force_n = np.random.default_rng([seed, 2]).uniform(*QUICK_FORCES_N, len(training_set.rows))
    return QuickPressSet(training_set.normalised, quick_rows(training_set.rows, force_n).astype(np.float32), camera)


def quick_rows(rows: Single | Array, force_n: Array) -> Array:
    """Return the rows [n, 12] of presses held at forces [n], for profile rows [n, P]."""
    weights = force_weights(force_n)
    at_forces = np.asarray(rows[:, :CONTRAST_COLUMNS], np.float64).reshape(len(rows), -1, RINGS)
    return np.column_stack([np.einsum("nk,nkj->nj", weights, at_forces), force_n])


def force_weights(force_n: Array) -> Array:
    """Return the weights [n, K] of what is at the profile's forces: the cubic through them, at forces [n]."""
    powers = np.vander(PROFILE_FORCES_N, increasing=True)
    return np.asarray(np.vander(force_n, len(PROFILE_FORCES_N), increasing=True) @ np.linalg.inv(powers))
