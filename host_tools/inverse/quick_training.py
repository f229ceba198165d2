"""Everything behind mode quick: the surrogate of the ramps, read at one force, to a network of one held press.

Two networks are enough: at one force the press says less than they could tell apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from device.measurement.confidence import Bands
from device.measurement.held_estimate import SEEN_BY
from device.measurement.held_profile import HeldPress, held_press
from device.measurement.press_noise import ErrorLevels, PressNoise
from device.measurement.press_parameters import to_unit
from device.measurement.press_surrogate import PressSurrogate
from device.measurement.profile_estimate import VISIBLE_DEVIATIONS
from device.measurement.quantities import UNKNOWNS
from device.measurement.ring_means import RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.camera_noise import shrunk_covariance
from host_tools.inverse.confidence_bands import confidence_bands, widened
from host_tools.inverse.held_presses import HeldPool, held_pool, held_rows
from host_tools.inverse.mode_outcome import Answered
from host_tools.inverse.noisy_presses import random_pool
from host_tools.inverse.press_samples import Array, draw_parameters, profile_rows
from host_tools.inverse.recorded_presses import EXACT, in_parallel, recorded_press
from host_tools.inverse.seeds import derived_seed, press_seed
from host_tools.inverse.train_ensemble import DenseEnsemble, train_ensemble

USUAL_RATIO = 0.985
"""Share of recorded presses inside the trained ranges whose elongation counts as usual: the only doubt of its kind in
mode quick, which has neither a best fit nor networks of the ranges."""


@dataclass(frozen=True)
class QuickEffort:
    """How many presses go into each step; the defaults take some five minutes on two cores."""

    recordings: int = 300
    pool: int = 60_000
    members: int = 2
    steps: int = 5_000
    judged: int = 30_000
    test_recordings: int = 600


@dataclass(frozen=True, eq=False)
class QuickOutcome:
    """Bands and usual elongation; `simulated` presses that the bands have not seen, and `recorded` ones."""

    bands: tuple[Bands, ...]
    elongation_ratio: float
    simulated: Answered
    recorded: Answered


@dataclass(frozen=True, eq=False)
class TrainedQuick:
    """All parts of the bundle."""

    ensemble: DenseEnsemble
    pool: HeldPool
    faintest_contrast: tuple[float, ...]
    outcome: QuickOutcome
    effort: QuickEffort
    seed: int


@dataclass(frozen=True, eq=False)
class RecordedHolds:
    """Parameters [n, 9], rows [n, 12] and elongation ratios [n] of recorded held presses."""

    parameters: Array
    rows: Array
    elongation: Array


def train_quick(
    tables: ProbeTables,
    surrogate: PressSurrogate,
    noise: PressNoise,
    *,
    effort: QuickEffort | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> TrainedQuick:
    """Return the trained parts; `noise` is of mode standard, whose camera's part is replaced by that of one frame."""
    asked = effort or QuickEffort()

    def held(count: int, purpose: str) -> HeldPool:
        drawn = derived_seed(seed, purpose)
        return held_pool(random_pool(surrogate, noise, count, drawn), camera, drawn)

    say(f"{asked.recordings} recordings of held presses")
    camera = _camera(tables, asked.recordings, derived_seed(seed, "camera of quick"), jobs)
    say(f"{asked.members} networks")
    pool = held(asked.pool, "training presses of quick")
    ensemble = train_ensemble(pool, seed=seed, members=asked.members, steps=asked.steps, jobs=jobs)
    say(f"{asked.judged} presses and {asked.test_recordings} recordings for the limits")
    fresh = held(asked.judged, "judged presses of quick")
    noisy = fresh.noisy(np.arange(asked.judged), np.random.default_rng(derived_seed(seed, "judged noise of quick")))
    simulated = _answered(ensemble, noisy.astype(np.float64), fresh.unit.astype(np.float64))
    recording = derived_seed(seed, "judged recordings of quick")
    recorded = recorded_holds(tables, asked.test_recordings, recording, ErrorLevels(), jobs)
    none = pool.typical_noise()[:RINGS, :RINGS]
    faintest = tuple(VISIBLE_DEVIATIONS * float(np.sqrt(weights @ none @ weights)) for weights in SEEN_BY)
    return TrainedQuick(ensemble, pool, faintest, _outcome(ensemble, simulated, recorded), asked, seed)


def recorded_holds(tables: ProbeTables, count: int, seed: int, levels: ErrorLevels, jobs: int) -> RecordedHolds:
    """Return what mode quick reads of random presses that are recorded."""
    parameters = draw_parameters(count, np.random.default_rng(seed))

    def read(i: int) -> HeldPress:
        return held_press(recorded_press(tables, parameters[i], "quick", press_seed(seed, i), levels=levels))

    rows, elongation = zip(*in_parallel(read, count, jobs), strict=True)
    return RecordedHolds(parameters, np.array(rows), np.array(elongation))


def _camera(tables: ProbeTables, count: int, seed: int, jobs: int) -> Array:
    """Return the covariance [11, 11] of recorded contrast about the exact one, at the force that was reported."""
    recorded = recorded_holds(tables, count, seed, EXACT, jobs)
    parameters = recorded.parameters
    ramps = np.array(in_parallel(lambda i: profile_rows(tables, parameters[i : i + 1])[0], count, jobs))
    exact = held_rows(ramps, recorded.rows[:, RINGS])
    return shrunk_covariance((recorded.rows - exact)[:, :RINGS] / (1 + exact[:, :RINGS]))


def _outcome(ensemble: DenseEnsemble, simulated: Answered, recorded: RecordedHolds) -> QuickOutcome:
    """Return bands and limits of the first halves, and the second halves to count on; as `mode_outcome`."""
    half, usual = len(simulated.truth) // 2, slice(len(recorded.rows) // 2)
    seen, answered = simulated.part(slice(half)), _answered(ensemble, recorded.rows, to_unit(recorded.parameters))
    first = answered.part(usual)
    bands = confidence_bands(seen.truth, seen.mean, seen.spread)
    return QuickOutcome(
        widened(bands, first.truth, first.mean, first.spread),
        float(np.quantile(recorded.elongation[usual], USUAL_RATIO)),
        simulated.part(slice(half, None)),
        answered.part(slice(usual.stop, None)),
    )


def _answered(ensemble: DenseEnsemble, rows: Array, unit: Array) -> Answered:
    return Answered(unit[:, : len(UNKNOWNS)], *ensemble.estimate(rows))
