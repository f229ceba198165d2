"""Simulated presses with noise to the belts behind every interval, one set for each unknown.

Bounds are quantiles of (truth - mean) / spread over the presses nearest in truth and in the logarithm of the spread.
Where they cover other presses more often than chance explains, belts are narrowed by one factor. Recordings hold what
the forward model and its noise do not know of: where these are covered less often than chance explains, belts are
widened by one factor. Source of both: split conformal prediction, Lei et al., JASA 113, 2018.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE, IDENTIFIABLE_RATIO, Belt, ends_in_belts
from device.measurement.parameters import EVEN_STD
from device.measurement.quantities import Bound, require
from host_tools.press_models.mode_outcome import EvaluatedPresses

TRUTHS, SPREADS = 17, 5
TRUTH_LENGTH = 0.15
"""Presses this far apart in truth are as unlike as those one standard deviation of the log spread apart."""
FEWEST, MOST, NEIGHBOUR_RATIO = 60, 400, 0.06
"""Presses of which a bound is the quantile, and their share of all: 400 leave an error of 1.5 % of coverage."""
FOLDS = 4
"""Parts of the presses, each of which is covered by the belts of the others."""
RAREST_RATIO = 0.05
"""An unknown that fewer presses than this share determine is left undetermined: its belts could not be judged."""
NARROWEST = 1e-9
WIDE_OPEN = 1e6
"""So many spreads hold all of the range."""


@dataclass(frozen=True, eq=False)
class SpreadAnswers:
    """Truth, mean and spread [n, 3] of presses, in coordinates."""

    truth: Array
    mean: Array
    spread: Array

    def part(self, chosen: slice) -> SpreadAnswers:
        """Return some of the presses."""
        return SpreadAnswers(self.truth[chosen], self.mean[chosen], self.spread[chosen])

    def within(self, belts: tuple[Belt, ...]) -> EvaluatedPresses:
        """Return them with the intervals of belts."""
        ends = [ends_in_belts(mean, spread, belts) for mean, spread in zip(self.mean, self.spread, strict=True)]
        low, high, known = (np.array(part) for part in zip(*ends, strict=True))
        return EvaluatedPresses(self.truth, self.mean, low, high, known)


def confidence_belts(truth: Array, mean: Array, spread: Array) -> tuple[Belt, ...]:
    """Return belts for each unknown of truths, means and spreads [n, 3] in coordinates.

    Only presses that determine an unknown count for it; where they are rare, the belts hold all of the range. Raises
    `InvalidQuantity` when they are not rare, but too few to learn from.
    """
    return tuple(_belt(*columns) for columns in zip(truth.T, mean.T, spread.T, strict=True))


def _belt(truth: Array, mean: Array, spread: Array) -> Belt:
    known = _determined(spread)
    if known.mean() < RAREST_RATIO:
        return _wide_open()
    require("presses that determine an unknown", int(known.sum()), Bound(2 * FEWEST, np.inf, ""), "simulate more")
    columns = truth[known], mean[known], spread[known]
    return _scaled(_learned(*columns), min(1.0, _crossed_factor(*columns)))


def _determined(spread: Array) -> NDArray[np.bool_]:
    return np.asarray(spread < IDENTIFIABLE_RATIO * EVEN_STD)


def _learned(truth: Array, mean: Array, spread: Array) -> Belt:
    """Return the quantiles of presses that determine the unknown."""
    neighbours = int(np.clip(NEIGHBOUR_RATIO * len(truth), FEWEST, MOST))
    unusual, log_spread = (truth - mean) / spread, np.log(spread)
    truths = -np.cos(np.pi * np.arange(TRUTHS) / (TRUTHS - 1))  # closer to each other at the ends of the range
    spreads = np.quantile(log_spread, np.linspace(0.02, 0.98, SPREADS))
    tails = (1 - COVERAGE) / 2, (1 + COVERAGE) / 2
    table = np.empty((TRUTHS, SPREADS, 2))
    for i, at in enumerate(truths):
        for j, log in enumerate(spreads):
            distance = np.hypot((truth - at) / TRUTH_LENGTH, (log_spread - log) / max(float(np.std(log_spread)), 1e-3))
            near = np.argpartition(distance, neighbours - 1)[:neighbours]
            table[i, j] = np.quantile(unusual[near], tails, method="weibull")  # covers the share, of few presses too
    return Belt(truths, spreads, table[..., 0], table[..., 1])


def _crossed_factor(truth: Array, mean: Array, spread: Array) -> float:
    """Return the factor with which belts of some presses cover the others at most by chance more than promised.

    Quantiles of few presses that are not quite alike lie too far out. The presses take turns in being the others.
    """
    fold = np.arange(len(truth)) % FOLDS
    needed = [
        _needed(_learned(*(column[fold != k] for column in (truth, mean, spread))), truth[fold == k], mean[fold == k],
                spread[fold == k])
        for k in range(FOLDS)
    ]  # fmt: skip
    return float(np.quantile(np.concatenate(needed), COVERAGE + _by_chance(len(truth))))


def _wide_open() -> Belt:
    ends = np.array([-1.0, 1.0])
    return Belt(ends, ends, np.full((2, 2), -WIDE_OPEN), np.full((2, 2), WIDE_OPEN))


def widened(belts: tuple[Belt, ...], truth: Array, mean: Array, spread: Array) -> tuple[Belt, ...]:
    """Return belts wide enough, about their middles, for truths, means and spreads [n, 3] of recorded presses.

    Wide enough is a coverage at most one standard error of chance below the promised one.
    """
    return tuple(_widened(one, *columns) for one, *columns in zip(belts, truth.T, mean.T, spread.T, strict=True))


def _widened(belts: Belt, truth: Array, mean: Array, spread: Array) -> Belt:
    known = _determined(spread)
    if not known.any():
        return belts
    needed = _needed(belts, truth[known], mean[known], spread[known])
    return _scaled(belts, max(1.0, float(np.quantile(needed, max(COVERAGE - _by_chance(len(needed)), 0.0)))))


def _needed(belts: Belt, truth: Array, mean: Array, spread: Array) -> Array:
    """Return by which factor [n] the belts must be widened to hold each press."""
    ends = np.array([
        np.ravel(belts.bounds(np.array([at]), float(width))) for at, width in zip(truth, spread, strict=True)
    ])  # fmt: skip
    middle, half = ends.mean(axis=1), np.diff(ends, axis=1)[:, 0] / 2
    return np.asarray(np.abs((truth - mean) / spread - middle) / np.maximum(half, NARROWEST))


def _by_chance(presses: int) -> float:
    """Return the standard error of a coverage that is counted on so many presses."""
    return float(np.sqrt(COVERAGE * (1 - COVERAGE) / presses))


def _scaled(belts: Belt, factor: float) -> Belt:
    middles, halves = (belts.low + belts.high) / 2, (belts.high - belts.low) / 2
    return Belt(belts.truth, belts.log_spread, middles - factor * halves, middles + factor * halves)
