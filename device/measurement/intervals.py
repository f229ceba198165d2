"""An estimate to its 90 % interval: how far the truth lay from the estimate in held-out scenes that looked alike.

No distribution is assumed. Where the data do not determine an unknown, its neighbours' errors span the training box and
the interval becomes the box: the estimate then says so instead of looking precise. Nothing is known outside the box.
Source: locally weighted split-conformal prediction, Lei et al., JASA 113:1094, 2018, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import UNKNOWNS, Bound, InvalidQuantity, require

Array = NDArray[np.float64]

COVERAGE = 0.9
NEIGHBOURS = 40
IDENTIFIABLE_RATIO = 0.5
"""An unknown counts as identifiable when its interval is under half of what the training box alone would give."""


@dataclass(frozen=True)
class Interval:
    """90 % interval of each unknown [3], and whether the data narrow it down."""

    low: Array
    high: Array
    identifiable: NDArray[np.bool_]


@dataclass(frozen=True)
class HeldOut:
    """Estimates and truths [n, 3] of scenes that neither network nor regression has seen."""

    estimate: Array
    truth: Array

    def __post_init__(self) -> None:
        require("held-out scenes", len(self.truth), Bound(2 * NEIGHBOURS, 1e6, "scenes"), "calibrate anew")
        if self.estimate.shape != self.truth.shape or self.truth.shape[1] != len(UNKNOWNS):
            shapes = f"{self.estimate.shape} and {self.truth.shape}"
            raise InvalidQuantity("held-out shapes", shapes, "equal, with three columns", "calibrate anew")
        if not (np.isfinite(self.estimate).all() and np.isfinite(self.truth).all()):
            raise InvalidQuantity("held-out scenes", "not finite", "finite numbers", "calibrate anew")

    def interval(self, estimate: Array) -> Interval:
        """Return the interval of one estimate [3]."""
        scale = np.ptp(self.truth, axis=0)
        distance = np.linalg.norm((self.estimate - estimate) / scale, axis=1)
        near = np.argpartition(distance, NEIGHBOURS)[:NEIGHBOURS]
        tails = (1 - COVERAGE) / 2, (1 + COVERAGE) / 2
        low, high = estimate + np.quantile((self.truth - self.estimate)[near], tails, axis=0)
        low, high = (np.clip(end, self.truth.min(axis=0), self.truth.max(axis=0)) for end in (low, high))
        box_low, box_high = np.quantile(self.truth, tails, axis=0)
        return Interval(low, high, (high - low) < IDENTIFIABLE_RATIO * (box_high - box_low))
