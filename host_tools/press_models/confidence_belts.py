"""Simulated presses with noise to the belts behind every interval, one set for each unknown.

Bounds are quantiles of (truth - mean) / spread over the presses nearest in truth and in the logarithm of the spread.
One held press does not tell the modulus, and hard inclusions read too large and too shallow, soft ones the other way.
So the quantiles are taken in each octile of the modulus, and the belt holds those of all of them. One factor then lets
belts cover other presses as often as promised, and `LEAST_COVERAGE` of them in every octile. Recordings hold what the
forward model and its noise do not know of: where these are covered less often than chance explains, belts are widened
by one factor. Sources: split conformal prediction, Lei et al., JASA 113, 2018; in groups, Vovk, ACML 25, 2012.
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
from host_tools.press_models.mode_statistics import OCTILES, octile_of

TRUTHS, SPREADS = 17, 5
TRUTH_LENGTH = 0.15
"""Presses this far apart in truth are as unlike as those one standard deviation of the log spread apart."""
FEWEST, MOST, NEIGHBOUR_RATIO = 60, 400, 0.12
"""Presses of which a bound is the quantile, and their share of an octile: 400 leave an error of 1.5 % of coverage."""
TAIL = 1.5 * (1 - COVERAGE)
"""Share of an octile's presses beyond either bound: most octiles have fewer, since the belt holds the bounds of all."""
LEAST_COVERAGE = 1 - 1.4 * (1 - COVERAGE)
"""Of every octile of the modulus: 0.86 where 0.85 is promised (docs/modes.md), for chance."""
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


def confidence_belts(truth: Array, mean: Array, spread: Array, modulus: Array) -> tuple[Belt, ...]:
    """Return belts for each unknown of truths, means and spreads [n, 3] and true moduli [n] in coordinates.

    Only presses that determine an unknown count for it; where they are rare, the belts hold all of the range. Raises
    `InvalidQuantity` when they are not rare, but too few to learn from.
    """
    return tuple(_belt(*columns, modulus) for columns in zip(truth.T, mean.T, spread.T, strict=True))


def _belt(truth: Array, mean: Array, spread: Array, modulus: Array) -> Belt:
    known = _determined(spread)
    if known.mean() < RAREST_RATIO:
        return _wide_open()
    require("presses that determine an unknown", int(known.sum()), Bound(2 * FEWEST, np.inf, ""), "simulate more")
    columns = truth[known], mean[known], spread[known], octile_of(modulus[known])
    return _scaled(_learned(*columns), _crossed_factor(*columns))


def _determined(spread: Array) -> NDArray[np.bool_]:
    return np.asarray(spread < IDENTIFIABLE_RATIO * EVEN_STD)


def _learned(truth: Array, mean: Array, spread: Array, octile: Array) -> Belt:
    """Return the widest quantiles that an octile of the modulus has; of presses that determine the unknown."""
    unusual, log_spread = (truth - mean) / spread, np.log(spread)
    truths = -np.cos(np.pi * np.arange(TRUTHS) / (TRUTHS - 1))  # closer to each other at the ends of the range
    spreads = np.quantile(log_spread, np.linspace(0.02, 0.98, SPREADS))
    scale = max(float(np.std(log_spread)), 1e-3)
    tables = []
    for chosen in (octile == number for number in range(OCTILES)):
        at_truth = (truth[chosen] - truths[:, None, None]) / TRUTH_LENGTH
        at_spread = (log_spread[chosen] - spreads[:, None]) / scale
        tables.append(_quantiles(np.hypot(at_truth, at_spread), unusual[chosen]))
    low, high = np.moveaxis(np.array(tables), -1, 0)
    return Belt(truths, spreads, low.min(axis=0), high.max(axis=0))


def _quantiles(distance: Array, unusual: Array) -> Array:
    """Return the quantiles [A, B, 2] of the presses [n] nearest to each node, by distances [A, B, n]."""
    count = min(int(np.clip(NEIGHBOUR_RATIO * len(unusual), FEWEST, MOST)), len(unusual))
    near = np.argpartition(distance, count - 1, axis=-1)[..., :count]
    tails = np.quantile(unusual[near], (TAIL, 1 - TAIL), axis=-1, method="weibull")  # covers the share, of few too
    return np.moveaxis(tails, 0, -1)


def _crossed_factor(truth: Array, mean: Array, spread: Array, octile: Array) -> float:
    """Return the factor with which belts of some presses cover the others as often as promised, in every octile too.

    The presses take turns in being the others.
    """
    columns, fold = (truth, mean, spread, octile), np.arange(len(truth)) % FOLDS
    needed = np.empty(len(truth))
    for k in range(FOLDS):
        belts = _learned(*(column[fold != k] for column in columns))
        needed[fold == k] = _needed(belts, truth[fold == k], mean[fold == k], spread[fold == k])
    of_octiles = [np.quantile(needed[octile == number], LEAST_COVERAGE) for number in range(OCTILES)]
    return float(max(np.quantile(needed, COVERAGE), *of_octiles))


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
