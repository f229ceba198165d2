"""Random presses in and around the trained ranges to the networks that tell them apart, one for each ramp mode.

Faces of lumps around the ranges are those of `wide_table`; their presses make polynomials, and these endless training
presses with the noise of each mode, as for the networks of the unknowns.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from device.measurement.mode import Mode
from device.measurement.press_noise import PressNoise
from device.measurement.press_parameters import to_unit
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.fit_surrogate import LUMP_REACH, fit_polynomials
from host_tools.inverse.noisy_presses import BLOCK, NoiseSampler, Pool
from host_tools.inverse.press_samples import Array, PressSamples, sample_presses
from host_tools.inverse.range_network import RangeNetwork, logistic_loss_and_gradient
from host_tools.inverse.seeds import derived_seed
from host_tools.inverse.train_ensemble import Lesson, train_members
from host_tools.inverse.wide_presses import WideSurrogate, draw_wide_parameters, is_outside, wide_coordinates
from host_tools.wide_table import WideTable

REACH, HIGHEST = LUMP_REACH | {"size_mm": 22.0, "depth_mm": 20.0}, {"size_mm": 11, "depth_mm": 11}
"""Degrees as those of the probe's own surrogate, higher ones in size and depth, whose ranges are wider; still higher
ones follow presses kept apart worse, where the largest and deepest lumps are few."""


@dataclass(frozen=True)
class RangeEffort:
    """How many presses go into each step; the defaults take some twenty minutes on two cores."""

    presses: int = 8_000
    held_out: int = 300
    pool: int = 200_000
    members: int = 2
    steps: int = 20_000


@dataclass(frozen=True, eq=False)
class TrainedRange:
    """A network of each mode, and the root mean square error [P] of the polynomials on presses kept apart.

    `dataset_sha256`: of the rows of all presses in and around the ranges.
    """

    networks: dict[Mode, RangeNetwork]
    surrogate_error: Array
    dataset_sha256: str
    effort: RangeEffort


def train_range(
    tables: ProbeTables,
    wide: WideTable,
    noise: Mapping[Mode, PressNoise],
    *,
    effort: RangeEffort | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> TrainedRange:
    """Return the networks; `say` hears what begins. The same seed gives the same ones whatever `jobs`."""
    asked = effort or RangeEffort()
    say(f"{asked.presses} random presses in and around the ranges")
    samples = sample_presses(
        wide.around(tables),
        asked.presses + asked.held_out,
        seed=derived_seed(seed, "wide presses"),
        draw=draw_wide_parameters,
        jobs=jobs,
    )
    learned, kept = samples.split(asked.presses)
    surrogate = wide_surrogate(learned)
    say(f"{asked.members} networks for the ranges of each mode")
    presses = wide_pool(surrogate, noise["standard"], asked.pool, seed)
    networks = {
        mode: train_network(replace(presses, sampler=NoiseSampler(of_mode)), seed, asked, jobs)
        for mode, of_mode in noise.items()
    }
    error = np.sqrt(np.mean((surrogate.rows(kept.parameters) - kept.rows) ** 2, axis=0))
    return TrainedRange(networks, error, hashlib.sha256(samples.rows.tobytes()).hexdigest(), asked)


def wide_surrogate(samples: PressSamples) -> WideSurrogate:
    """Return the polynomials of presses in and around the ranges; raises as `fit_polynomials`."""
    return WideSurrogate(*fit_polynomials(samples, wide_coordinates(samples.parameters), REACH, HIGHEST))


def wide_pool(surrogate: WideSurrogate, noise: PressNoise, count: int, seed: int) -> Pool:
    """Return random presses in and around the ranges; coordinates of those outside lie outside -1 to 1."""
    rng = np.random.default_rng(derived_seed(seed, "training presses around the ranges"))
    parameters = draw_wide_parameters(count, rng)
    rows = [surrogate.rows(parameters[start : start + BLOCK]) for start in range(0, count, BLOCK)]
    return Pool(to_unit(parameters).astype(np.float32), np.concatenate(rows).astype(np.float32), NoiseSampler(noise))


def train_network(pool: Pool, seed: int, effort: RangeEffort, jobs: int) -> RangeNetwork:
    """Return the networks trained on a pool's rows; raises as `train_members`."""
    lesson = Lesson(1, is_outside(pool.unit).astype(np.float32), logistic_loss_and_gradient)
    return RangeNetwork(*train_members(pool, lesson, seed=seed, members=effort.members, steps=effort.steps, jobs=jobs))
