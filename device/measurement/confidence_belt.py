"""Mean and spread of an unknown to its 90 % interval: all values under which such an answer would not be unusual.

A posterior's own interval covers on the average of the prior, and so misses most of what lies at the ends of the
range, where estimates shrink to the middle. Here the bounds of (truth - mean) / spread are tabulated over truth and
spread, from simulated presses with noise, and the interval is every truth whose bounds hold: it covers nine times in
ten whatever the truth is. Source: Masserano et al., WALDO, AISTATS 2023 (Neyman's construction around an estimator).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD
from device.measurement.quantities import UNKNOWNS, InvalidQuantity

COVERAGE = 0.9
"""Level of the intervals of every mode. Belts are tabulated for one: another takes a new training."""
IDENTIFIABLE_RATIO = 0.5
"""An unknown is determined when its spread is under half of what its range alone would give."""
GRID = 401


class Interval(NamedTuple):
    """Ends of an interval in coordinates from -1 to 1, and whether the press narrows the range down."""

    low: float
    high: float
    is_identifiable: bool


@dataclass(frozen=True, eq=False)
class Belt:
    """A confidence belt (Neyman 1937): accepted (truth - mean) / spread [A, B], by truths [A] and log spreads [B]."""

    truth: Array
    log_spread: Array
    low: Array
    high: Array

    def __post_init__(self) -> None:
        shape = len(self.truth), len(self.log_spread)
        if self.low.shape != shape or self.high.shape != shape:
            found = f"{self.low.shape} and {self.high.shape}"
            raise InvalidQuantity("shape of the belt", found, str(shape), "install the model bundle again")

    def interval(self, mean: float, spread: float) -> Interval:
        """Return the interval of an estimate in coordinates; all of the range when the press does not narrow it."""
        if spread >= IDENTIFIABLE_RATIO * EVEN_STD:
            return Interval(-1.0, 1.0, False)
        truth = np.linspace(-1, 1, GRID)
        low, high = self.bounds(truth, spread)
        accepted = truth[(low <= (truth - mean) / spread) & ((truth - mean) / spread <= high)]
        if not len(accepted):  # an answer that is unusual for every truth: nothing narrower may be said
            at = min(max(mean, -1.0), 1.0)
            return Interval(max(-1.0, at - 2 * spread), min(1.0, at + 2 * spread), True)
        half_step = 1 / (GRID - 1)
        low_end, high_end = max(-1.0, float(accepted[0]) - half_step), min(1.0, float(accepted[-1]) + half_step)
        return Interval(low_end, high_end, high_end - low_end < 2)

    def bounds(self, truth: Array, spread: float) -> tuple[Array, Array]:
        """Return the lowest and highest accepted (truth - mean) / spread [n] at truths [n]."""
        log_spread = float(np.log(spread))
        return self._at(truth, log_spread, self.low), self._at(truth, log_spread, self.high)

    def _at(self, truth: Array, log_spread: float, table: Array) -> Array:
        at_spread = np.array([np.interp(log_spread, self.log_spread, row) for row in table])
        return np.asarray(np.interp(truth, self.truth, at_spread))


class BeltEnds(NamedTuple):
    """Ends [3] of the unknowns' intervals in coordinates, and whether the press narrows each one's range down."""

    low: Array
    high: Array
    is_identifiable: NDArray[np.bool_]


def ends_in_belts(mean: Array, spread: Array, belts: Sequence[Belt]) -> BeltEnds:
    """Return the intervals of mean and spread [3] by each unknown's belts."""
    intervals = [belt.interval(float(at), float(width)) for belt, at, width in zip(belts, mean, spread, strict=True)]
    low, high, known = zip(*intervals, strict=True)
    return BeltEnds(np.array(low), np.array(high), np.array(known))


def belts_of(entry: Mapping[str, Any]) -> tuple[Belt, ...]:
    """Return the belts of each unknown that the card states for a mode; raises `KeyError` where one is missing."""
    parts = ("truth", "log_spread", "low", "high")
    return tuple(Belt(*(np.array(entry["bands"][name][part], dtype=np.float64) for part in parts)) for name in UNKNOWNS)
