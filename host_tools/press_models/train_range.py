"""Random presses in and around the trained ranges to the networks that tell them apart.

Faces of inclusions around the ranges are those of `out_of_range_table`; their presses make polynomials over the wide
ranges, and these endless training presses with noise. Only size and depth are drawn wide: the modulus
and all that nobody tells the probe stay in their ranges.

The network is `dense_network` with one output and the logistic loss: the log odds that size or depth lies outside. By
Neyman and Pearson no number of a row tells more of the ones, at as many false flags of the others, than the exact odds,
which these networks approach. Source: Bishop, Pattern Recognition and Machine Learning, 2006, section 4.3.4.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit

from device.measurement.arrays import Array, Single
from device.measurement.parameters import ABOVE_BASE_MM, PARAMETERS, normalise
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.surrogate import (
    DEPTH,
    SIZE,
    assemble,
    inclusion_factor,
    polynomial_coordinates,
    turned,
)
from device.simulation.virtual_probe import ProbeTables
from host_tools.press_models.dense_network import DenseLayer, InputScaling, activations_of, backward
from host_tools.press_models.fit_surrogate import INCLUSION_REACH, fit_polynomials
from host_tools.press_models.noisy_presses import BLOCK, NetworkPresses, NoiseSampler, PressSet
from host_tools.press_models.press_samples import PressSamples, draw_parameters, sample_presses
from host_tools.press_models.seeds import derived_seed
from host_tools.press_models.train_ensemble import Task, train_members
from host_tools.probe_tables.out_of_range_table import SHALLOWEST_MM, SIZES_MM, WideTable, deepest_mm

SIZES, DEPTHS = (1.5, SIZES_MM[1]), (SHALLOWEST_MM, deepest_mm(1.5))
"""Wide ranges of size and depth, mm; smaller inclusions show nowhere."""
PLACE = slice(SIZE, DEPTH + 1)
THICKNESS = PARAMETERS.index("slab_thickness_mm")
ENDS: Array = np.array([SIZES, DEPTHS])
OTHERS_RATIO = 0.74
REACH = {name: OTHERS_RATIO * reach for name, reach in INCLUSION_REACH.items()} | {"size_mm": 22.0, "depth_mm": 20.0}
HIGHEST, TERMS = {"size_mm": 11, "depth_mm": 11}, 1600
"""Degrees are higher than those of the probe's own surrogate in size and depth, whose ranges are wider, and lower in
what else there is: these networks only ask on which side of an end a press lies. So many terms are kept.

Still higher ones follow presses kept apart worse, where the largest and deepest inclusions are few.
"""


@dataclass(frozen=True)
class RangeBudget:
    """How many presses go into each step; the defaults take some twenty minutes on two cores."""

    presses: int = 11_200
    held_out: int = 300
    trained_on: int = 200_000
    members: int = 2
    steps: int = 20_000
    detail_ratio: float = 1.0


@dataclass(frozen=True, eq=False)
class TrainedRange:
    """The networks, and the root mean square error [P] of the polynomials on presses kept apart.

    `dataset_sha256`: of the rows of all presses in and around the ranges.
    """

    network: RangeNetwork
    surrogate_error: Array
    dataset_sha256: str
    budget: RangeBudget


def train_range(
    tables: ProbeTables,
    wide: WideTable,
    noise: PressNoise,
    *,
    budget: RangeBudget | None = None,
    seed: int = 1,
    jobs: int = -1,
    say: Callable[[str], None] = lambda step: None,
) -> TrainedRange:
    """Return the networks; `say` hears what begins. The same seed gives the same ones whatever `jobs`."""
    asked = budget or RangeBudget()
    found = wide_presses(tables, wide, asked, seed, jobs, say)
    say(f"{asked.members} networks for the ranges")
    presses = wide_press_set(found.surrogate, noise, asked.trained_on, seed)
    return TrainedRange(train_network(presses, seed, asked, jobs), found.error, found.sha256, asked)


class WidePresses(NamedTuple):
    """Polynomials of presses in and around the ranges, their error [P] on presses kept apart, and the hash of all
    rows."""

    surrogate: WideSurrogate
    error: Array
    sha256: str


def wide_presses(
    tables: ProbeTables, wide: WideTable, asked: RangeBudget, seed: int, jobs: int, say: Callable[[str], None]
) -> WidePresses:
    """Return the polynomials of random presses in and around the ranges; as `train_range`."""
    say(f"{asked.presses} random presses in and around the ranges")
    samples = sample_presses(
        wide.around(tables),
        asked.presses + asked.held_out,
        seed=derived_seed(seed, "wide presses"),
        draw=draw_wide_parameters,
        jobs=jobs,
    )
    learned, kept = samples.split(asked.presses)
    surrogate = wide_surrogate(learned, asked.detail_ratio)
    error = np.sqrt(np.mean((surrogate.rows(kept.parameters, kept.direction_rad) - kept.rows) ** 2, axis=0))
    return WidePresses(surrogate, error, hashlib.sha256(samples.rows.tobytes()).hexdigest())


def wide_surrogate(samples: PressSamples, detail_ratio: float = 1.0) -> WideSurrogate:
    """Return the polynomials of presses in and around the ranges; as `fit_polynomials`."""
    at = wide_coordinates(samples.parameters)
    return WideSurrogate(*fit_polynomials(samples, at, REACH, HIGHEST, terms=TERMS, detail_ratio=detail_ratio))


def wide_press_set(surrogate: WideSurrogate, noise: PressNoise, count: int, seed: int) -> PressSet:
    """Return random presses in and around the ranges; coordinates of those outside lie outside -1 to 1."""
    rng = np.random.default_rng(derived_seed(seed, "training presses around the ranges"))
    parameters = draw_wide_parameters(count, rng)
    direction_rad = rng.uniform(0, 2 * np.pi, count)
    blocks = [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]
    rows = np.concatenate([surrogate.rows(parameters[block], direction_rad[block]) for block in blocks])
    return PressSet(
        normalise(parameters).astype(np.float32), rows.astype(np.float32), direction_rad, NoiseSampler(noise)
    )


def train_network(training_set: PressSet, seed: int, budget: RangeBudget, jobs: int) -> RangeNetwork:
    """Return the networks trained on a training set's rows; raises as `train_members`."""
    task = Task(1, is_outside(training_set.normalised).astype(np.float32), logistic_loss_and_gradient)
    presses = NetworkPresses(training_set)
    return RangeNetwork(*train_members(presses, task, seed=seed, members=budget.members, steps=budget.steps, jobs=jobs))


@dataclass(frozen=True, eq=False)
class RangeNetwork:
    """Networks that share one scaling of the inputs, those of `network_rows`; their log odds are averaged."""

    scaling: InputScaling
    members: tuple[list[DenseLayer], ...]

    def log_odds(self, rows: Array) -> Array:
        """Return the log odds [n] that size or depth lies outside, for rows [n, F]."""
        inputs = self.scaling.inputs(rows.astype(np.float32))
        return np.asarray(np.mean([activations_of(layers, inputs)[-1][:, 0] for layers in self.members], axis=0))


def logistic_loss_and_gradient(
    layers: list[DenseLayer], inputs: Single, is_outside: Single
) -> tuple[float, list[DenseLayer]]:
    """Return the mean of -ln(probability of what is so), and its gradient; `is_outside` [n] is 0 or 1."""
    activations = activations_of(layers, inputs)
    log_odds = activations[-1][:, 0]
    loss = float(np.mean(np.logaddexp(0, log_odds) - is_outside * log_odds))
    by_output = ((expit(log_odds) - is_outside) / np.float32(len(log_odds)))[:, None]
    return loss, backward(layers, activations, by_output.astype(np.float32))


def draw_wide_parameters(count: int, rng: np.random.Generator, *, inclusions_a_skin: int = 1) -> Array:
    """Return parameters [count, 9] as `press_samples.draw_parameters`, size and depth even over the wide ranges."""
    values = draw_parameters(count, rng, inclusions_a_skin=inclusions_a_skin)
    again = np.full(count, True)
    while again.any():
        values[again, PLACE] = rng.uniform(ENDS[:, 0], ENDS[:, 1], (int(again.sum()), 2))
        size_mm, depth_mm = values[:, PLACE].T
        deepest = np.minimum([deepest_mm(size) for size in size_mm], values[:, THICKNESS] - ABOVE_BASE_MM - size_mm)
        again = depth_mm > deepest
    return values


def is_outside(normalised: Array | Single) -> NDArray[np.bool_]:
    """Return whether size or depth lies outside its trained range [n], for coordinates [n, 9] of `normalise`."""
    return np.asarray((np.abs(normalised[:, PLACE]) > 1).any(axis=1))


def wide_coordinates(parameters: Array) -> Array:
    """Return the coordinates [n, 9] in which wide presses are polynomials: -1 to 1 over the wide ranges."""
    at = polynomial_coordinates(normalise(parameters), parameters)
    low, high = ENDS.T
    at[:, PLACE] = 2 * (parameters[:, PLACE] - low) / (high - low) - 1
    return at


@dataclass(frozen=True, eq=False)
class WideSurrogate:
    """`PressSurrogate` over the wide ranges."""

    inclusion_field: LegendreSum
    turned_field: LegendreSum
    baseline: LegendreSum

    def rows(self, parameters: Array, direction_rad: Array) -> Array:
        """Return profile rows [n, P] at parameters [n, 9], the inclusion in directions [n] of the image."""
        at = wide_coordinates(parameters)
        inclusion = self.inclusion_field.values(at) + turned(self.turned_field.values(at), direction_rad)
        return assemble(inclusion_factor(parameters) * inclusion, self.baseline.values(at))
