"""Mean and spread of an unknown to its 90 % interval: all values under which such an answer would not be unusual.

A posterior's own interval covers on the average of the prior, and so misses most of what lies at the ends of the
range, where estimates shrink to the middle. Here the bounds of (truth - mean) / spread are tabulated over truth, spread
and the mean of another unknown, from simulated presses with noise. The interval is every truth whose bounds hold: it
covers nine times in ten whatever the truth is, on the average of the other unknowns. How a depth is missed depends on
the size, and the other way round.
Source: Masserano et al., WALDO, AISTATS 2023 (Neyman's construction around an estimator).
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
BESIDE = (1, 0, 0)
"""Which unknown's mean the belts of each go by, too: those of size by depth, those of depth and modulus by size."""


class Interval(NamedTuple):
    """Ends of an interval in coordinates from -1 to 1, and whether the press narrows the range down."""

    low: float
    high: float
    is_identifiable: bool


@dataclass(frozen=True, eq=False)
class Belt:
    """A confidence belt (Neyman 1937): accepted (truth - mean) / spread [A, B, C], by truths [A], log spreads [B] and
    means of the unknown beside it [C].
    """

    truth: Array
    log_spread: Array
    beside: Array
    low: Array
    high: Array

    def __post_init__(self) -> None:
        shape = len(self.truth), len(self.log_spread), len(self.beside)
        if self.low.shape != shape or self.high.shape != shape:
            found = f"{self.low.shape} and {self.high.shape}"
            raise InvalidQuantity("shape of the belt", found, str(shape), "install the model bundle again")

    def interval(self, mean: float, spread: float, beside: float) -> Interval:
        """Return the interval of an estimate in coordinates; all of the range when the press does not narrow it."""
        if not (np.isfinite(mean + beside) and spread < IDENTIFIABLE_RATIO * EVEN_STD):
            return Interval(-1.0, 1.0, False)
        truth = np.linspace(-1, 1, GRID)
        low, high = self.bounds(truth, np.array([spread]), np.array([beside]))
        accepted = truth[(low <= (truth - mean) / spread) & ((truth - mean) / spread <= high)]
        if not len(accepted):  # an answer that is unusual for every truth: nothing narrower may be said
            at = min(max(mean, -1.0), 1.0)
            return Interval(max(-1.0, at - 2 * spread), min(1.0, at + 2 * spread), True)
        half_step = 1 / (GRID - 1)
        low_end, high_end = max(-1.0, float(accepted[0]) - half_step), min(1.0, float(accepted[-1]) + half_step)
        return Interval(low_end, high_end, high_end - low_end < 2)

    def bounds(self, truth: Array, spread: Array, beside: Array) -> tuple[Array, Array]:
        """Return the lowest and highest accepted (truth - mean) / spread [n], linearly between nodes.

        Of truths, spreads and means of the unknown beside [n], or [1] where all have the same.
        """
        spreads, besides = _hats(self.log_spread, np.log(spread)), _hats(self.beside, beside)
        truths = _hats(self.truth, truth)
        low, high = (
            np.sum(truths * np.einsum("nb,nc,abc->na", spreads, besides, table), axis=1)
            for table in (self.low, self.high)
        )
        return low, high


def _hats(nodes: Array, at: Array) -> Array:
    """Return the weights [n, A] of nodes [A] in the linear interpolation at points [n]; beyond the ends, of the end."""
    return np.stack([np.interp(at, nodes, one) for one in np.eye(len(nodes))], axis=-1)


class BeltEnds(NamedTuple):
    """Ends [3] of the unknowns' intervals in coordinates, and whether the press narrows each one's range down."""

    low: Array
    high: Array
    is_identifiable: NDArray[np.bool_]


def ends_in_belts(mean: Array, spread: Array, belts: Sequence[Belt]) -> BeltEnds:
    """Return the intervals of mean and spread [3] by each unknown's belts."""
    columns = zip(belts, mean, spread, mean[list(BESIDE)], strict=True)
    intervals = [belt.interval(*map(float, of_unknown)) for belt, *of_unknown in columns]
    low, high, known = zip(*intervals, strict=True)
    return BeltEnds(np.array(low), np.array(high), np.array(known))


def belts_of(entry: Mapping[str, Any]) -> tuple[Belt, ...]:
    """Return the belts of each unknown that the card states for a mode; raises `KeyError` where one is missing.

    Those of a card without `beside`, as of before it was looked at, are the same whatever stands there.
    """
    return tuple(_belt_of(entry["bands"][name]) for name in UNKNOWNS)


def _belt_of(stated: Mapping[str, Any]) -> Belt:
    truth, log_spread, beside = (
        np.array(nodes, dtype=np.float64)
        for nodes in (stated["truth"], stated["log_spread"], stated.get("beside", [0.0]))
    )
    low, high = (np.array(stated[end], dtype=np.float64) for end in ("low", "high"))
    if "beside" not in stated:
        low, high = low[..., None], high[..., None]
    return Belt(truth, log_spread, beside, low, high)
