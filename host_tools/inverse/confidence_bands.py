"""Simulated presses with noise to the bands behind every interval, one set for each unknown.

Bounds are quantiles of (truth - mean) / spread over the presses nearest in truth and in the logarithm of the spread.
Recordings hold what the forward model and its noise do not know of: where they are covered less often than chance
explains, bands are widened by one factor. Source of the factor: split conformal prediction, Lei et al., JASA 113, 2018.
"""

from __future__ import annotations

import numpy as np

from device.measurement.confidence import COVERAGE, IDENTIFIABLE_RATIO, Array, Bands
from device.measurement.press_parameters import EVEN_STD
from device.measurement.quantities import Bound, require

TRUTHS, SPREADS = 17, 5
TRUTH_LENGTH = 0.15
"""Presses this far apart in truth are as unlike as those one standard deviation of the log spread apart."""
FEWEST, MOST, NEIGHBOUR_RATIO = 60, 400, 0.06
"""Presses of which a bound is the quantile, and their share of all: 400 leave an error of 1.5 % of coverage."""


RAREST_RATIO = 0.05
"""An unknown that fewer presses than this share determine is left undetermined: its bands could not be judged."""
WIDE_OPEN = 1e6
"""So many spreads hold all of the range."""


def confidence_bands(truth: Array, mean: Array, spread: Array) -> tuple[Bands, ...]:
    """Return bands for each unknown of truths, means and spreads [n, 3] in coordinates.

    Only presses that determine an unknown count for it; where they are rare, the bands hold all of the range. Raises
    `InvalidQuantity` when they are not rare, but too few to learn from.
    """
    return tuple(_bands(*columns) for columns in zip(truth.T, mean.T, spread.T, strict=True))


def _bands(truth: Array, mean: Array, spread: Array) -> Bands:
    known = spread < IDENTIFIABLE_RATIO * EVEN_STD
    if known.mean() < RAREST_RATIO:
        return _wide_open()
    require("presses that determine an unknown", int(known.sum()), Bound(2 * FEWEST, np.inf, ""), "simulate more")
    neighbours = int(np.clip(NEIGHBOUR_RATIO * known.sum(), FEWEST, MOST))
    truth, unusual, log_spread = truth[known], ((truth - mean) / spread)[known], np.log(spread[known])
    truths = -np.cos(np.pi * np.arange(TRUTHS) / (TRUTHS - 1))  # closer to each other at the ends of the range
    spreads = np.quantile(log_spread, np.linspace(0.02, 0.98, SPREADS))
    tails = (1 - COVERAGE) / 2, (1 + COVERAGE) / 2
    table = np.empty((TRUTHS, SPREADS, 2))
    for i, at in enumerate(truths):
        for j, log in enumerate(spreads):
            distance = np.hypot((truth - at) / TRUTH_LENGTH, (log_spread - log) / max(float(np.std(log_spread)), 1e-3))
            near = np.argpartition(distance, neighbours - 1)[:neighbours]
            table[i, j] = np.quantile(unusual[near], tails, method="weibull")  # covers the share, of few presses too
    return Bands(truths, spreads, table[..., 0], table[..., 1])


def _wide_open() -> Bands:
    ends = np.array([-1.0, 1.0])
    return Bands(ends, ends, np.full((2, 2), -WIDE_OPEN), np.full((2, 2), WIDE_OPEN))


def widened(bands: tuple[Bands, ...], truth: Array, mean: Array, spread: Array) -> tuple[Bands, ...]:
    """Return bands wide enough, about their middles, for truths, means and spreads [n, 3] of recorded presses.

    Wide enough is a coverage at most one standard error of chance below the promised one.
    """
    return tuple(_widened(one, *columns) for one, *columns in zip(bands, truth.T, mean.T, spread.T, strict=True))


def _widened(bands: Bands, truth: Array, mean: Array, spread: Array) -> Bands:
    known = spread < IDENTIFIABLE_RATIO * EVEN_STD
    if not known.any():
        return bands
    ends = np.array([
        np.ravel(bands.bounds(np.array([at]), float(width)))
        for at, width in zip(truth[known], spread[known], strict=True)
    ])  # fmt: skip
    middle, half = ends.mean(axis=1), np.diff(ends, axis=1)[:, 0] / 2
    needed = np.abs((truth - mean)[known] / spread[known] - middle) / half
    by_chance = np.sqrt(COVERAGE * (1 - COVERAGE) / len(needed))
    factor = max(1.0, float(np.quantile(needed, max(COVERAGE - by_chance, 0.0))))
    middles, halves = (bands.low + bands.high) / 2, (bands.high - bands.low) / 2
    return Bands(bands.truth, bands.log_spread, middles - factor * halves, middles + factor * halves)
