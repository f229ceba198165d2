"""An estimate to its 90 % interval: how far the truth lay from the estimate in held-out scenes that looked alike.

No distribution is assumed. Where the data do not determine an unknown, its neighbours' errors span the training box and
the interval becomes the box: the estimate then says so instead of looking precise. Nothing is known outside the box.
Source: locally weighted split-conformal prediction, Lei et al., JASA 113:1094, 2018, section 5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE
from device.measurement.quantities import UNKNOWNS, Bound, InvalidQuantity, require

NEIGHBOURS = 40
IDENTIFIABLE_RATIO = 0.5
"""An unknown counts as identifiable when its interval is under half of what the training box alone would give."""


@dataclass(frozen=True)
class PaperInterval:
    """90 % interval of each unknown [3], and whether the data narrow it down."""

    low: Array
    high: Array
    identifiable: NDArray[np.bool_]


@dataclass(frozen=True)
class HeldOut:
    """Estimates and truths [n, 3] of scenes that neither network nor regression has seen, drawn from a box [3]."""

    estimate: Array
    truth: Array
    box_low: Array
    box_high: Array

    def __post_init__(self) -> None:
        require("held-out scenes", len(self.truth), Bound(2 * NEIGHBOURS, 1e6, "scenes"), "calibrate anew")
        if self.estimate.shape != self.truth.shape or self.truth.shape[1:] != (len(UNKNOWNS),):
            shapes = f"{self.estimate.shape} and {self.truth.shape}"
            raise InvalidQuantity("held-out shapes", shapes, "equal, with three columns", "calibrate anew")
        if self.box_low.shape != (len(UNKNOWNS),) or not (self.box_low < self.box_high).all():
            raise InvalidQuantity(
                "held-out box", f"{self.box_low} to {self.box_high}", "three ranges", "calibrate anew"
            )
        if not (np.isfinite(self.estimate).all() and np.isfinite(self.truth).all()):
            raise InvalidQuantity("held-out scenes", "not finite", "finite numbers", "calibrate anew")

    def interval(self, estimate: Array) -> PaperInterval:
        """Return the interval of one estimate [3]."""
        distance = np.linalg.norm((self.estimate - estimate) / (self.box_high - self.box_low), axis=1)
        near = np.argpartition(distance, NEIGHBOURS)[:NEIGHBOURS]
        tails = (1 - COVERAGE) / 2, (1 + COVERAGE) / 2
        # With "weibull", position p (n + 1), the errors of few neighbours cover their share of new ones, not less.
        low, high = estimate + np.quantile((self.truth - self.estimate)[near], tails, axis=0, method="weibull")
        low, high = (np.clip(end, self.box_low, self.box_high) for end in (low, high))
        widest = COVERAGE * (self.box_high - self.box_low)
        return PaperInterval(low, high, (low < high) & (high - low < IDENTIFIABLE_RATIO * widest))
