"""Everything behind mode quick: the surrogate of the ramps, read at one force, to a network of one held press.

Two networks are enough: at one force the press says less than they could tell apart.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from device.measurement.confidence import Bands
from device.measurement.held_estimate import SEEN_BY
from device.measurement.held_profile import held_row
from device.measurement.press_noise import ErrorLevels, PressNoise
from device.measurement.press_parameters import to_unit
from device.measurement.press_surrogate import PressSurrogate
from device.measurement.profile_estimate import VISIBLE_DEVIATIONS
from device.measurement.quantities import UNKNOWNS
from device.measurement.ring_means import RINGS
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.camera_noise import shrunk_covariance
from host_tools.inverse.confidence_bands import confidence_bands
from host_tools.inverse.held_presses import HeldPool, held_pool, held_rows
from host_tools.inverse.mode_outcome import Answered
from host_tools.inverse.noisy_presses import random_pool
from host_tools.inverse.press_samples import Array, draw_parameters, profile_rows
from host_tools.inverse.recorded_presses import EXACT, in_parallel, recorded_press
from host_tools.inverse.seeds import derived_seed, press_seed
from host_tools.inverse.train_ensemble import DenseEnsemble, train_ensemble


@dataclass(frozen=True)
class QuickEffort:
    """How many presses go into each step; the defaults take some five minutes on two cores."""

    recordings: int = 300
    pool: int = 60_000
    members: int = 2
    steps: int = 5_000
    judged: int = 30_000


@dataclass(frozen=True, eq=False)
class TrainedQuick:
    """All parts of the bundle; `simulated` presses that the bands have not seen, and `recorded` ones."""

    ensemble: DenseEnsemble
    pool: HeldPool
    bands: tuple[Bands, ...]
    faintest_contrast: tuple[float, ...]
    simulated: Answered
    recorded: Answered
    effort: QuickEffort
    seed: int


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
    say(f"{asked.recordings} recordings of held presses")
    recording = derived_seed(seed, "camera of quick")
    parameters = draw_parameters(asked.recordings, np.random.default_rng(recording))
    camera = _camera(tables, parameters, recording, jobs)
    say(f"{asked.members} networks")
    pool = _pool(surrogate, noise, camera, asked.pool, derived_seed(seed, "training presses of quick"))
    ensemble = train_ensemble(pool, seed=seed, members=asked.members, steps=asked.steps, jobs=jobs)
    say(f"{asked.judged} presses for the bands")
    judging = derived_seed(seed, "judged presses of quick")
    fresh = _pool(surrogate, noise, camera, asked.judged, judging)
    noisy = fresh.noisy(np.arange(asked.judged), np.random.default_rng([judging, 1]))
    simulated = _answered(ensemble, noisy.astype(np.float64), fresh.unit.astype(np.float64))
    half = asked.judged // 2
    seen = simulated.part(slice(half))
    judging = derived_seed(seed, "judged recordings of quick")
    others = draw_parameters(asked.recordings, np.random.default_rng(judging))
    rows = recorded_rows(tables, others, judging, ErrorLevels(), jobs)
    none = pool.typical_noise()[:RINGS, :RINGS]
    return TrainedQuick(
        ensemble,
        pool,
        confidence_bands(seen.truth, seen.mean, seen.spread),
        tuple(VISIBLE_DEVIATIONS * float(np.sqrt(weights @ none @ weights)) for weights in SEEN_BY),
        simulated.part(slice(half, None)),
        _answered(ensemble, rows, to_unit(others)),
        asked,
        seed,
    )


def _pool(surrogate: PressSurrogate, noise: PressNoise, camera: Array, count: int, seed: int) -> HeldPool:
    return held_pool(random_pool(surrogate, noise, count, seed), camera, seed)


def recorded_rows(tables: ProbeTables, parameters: Array, seed: int, levels: ErrorLevels, jobs: int) -> Array:
    """Return the rows [n, 12] that mode quick reads of recorded presses with parameters [n, 9]."""
    return np.array(
        in_parallel(
            lambda i: held_row(recorded_press(tables, parameters[i], "quick", press_seed(seed, i), levels=levels)),
            len(parameters),
            jobs,
        )
    )


def _camera(tables: ProbeTables, parameters: Array, seed: int, jobs: int) -> Array:
    """Return the covariance [11, 11] of recorded contrast about the exact one, at the force that was reported."""
    recorded = recorded_rows(tables, parameters, seed, EXACT, jobs)
    ramps = np.array(in_parallel(lambda i: profile_rows(tables, parameters[i : i + 1])[0], len(parameters), jobs))
    exact = held_rows(ramps, recorded[:, RINGS])
    return shrunk_covariance((recorded - exact)[:, :RINGS] / (1 + exact[:, :RINGS]))


def _answered(ensemble: DenseEnsemble, rows: Array, unit: Array) -> Answered:
    return Answered(unit[:, : len(UNKNOWNS)], *ensemble.estimate(rows))
