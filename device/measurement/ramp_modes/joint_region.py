"""The joint 90 % region of unknowns: where a press says that they lie together.

Intervals of single unknowns hold together less often than each alone, and say nothing of how the unknowns hang on each
other. The region is the ellipse about the posterior's mean, in its own covariance, that holds nine in ten of its
samples: of a Gaussian posterior the smallest such region. Source: Box & Tiao, Bayesian Inference in Statistical
Analysis (1973), 2.8, highest density regions.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE


class JointRegion(NamedTuple):
    """The middle [k], the inverse covariance [k, k], and the squared distance in it at which the ellipse ends."""

    middle: Array
    precision: Array
    square: float

    def holds(self, at: Array) -> bool:
        """Return whether coordinates [k] lie inside; the edge belongs to it."""
        away = at - self.middle
        return bool(away @ self.precision @ away <= self.square)


def joint_region(at: Array, weight: Array) -> JointRegion:
    """Return the region of samples [n, k] whose weights [n] add up to 1."""
    middle = weight @ at
    away = at - middle
    precision = np.asarray(np.linalg.inv((away * weight[:, None]).T @ away), np.float64)
    square = np.einsum("ni,ij,nj->n", away, precision, away)
    order = np.argsort(square)
    last = min(int(np.searchsorted(np.cumsum(weight[order]), COVERAGE)), len(order) - 1)
    return JointRegion(middle, precision, float(square[order[last]]))
