"""The joint 90 % region of unknowns: where a press says that they lie together.

Intervals of single unknowns hold together less often than each alone, and say nothing of how the unknowns hang on each
other. Of all unknowns the region is the ellipse about the posterior's mean, in its own covariance, that holds nine in
ten of its samples. It weighs them by how many inclusions have each modulus, so it misses many of the softest ones. So
size and depth are profiled, as their intervals are: they lie together where they are likely under some modulus.
Sources: Box & Tiao, Bayesian Inference in Statistical Analysis (1973), 2.8, highest density regions; Cox & Hinkley,
Theoretical Statistics (1974), 9.3, profile likelihood; docs/modes.md counts how often regions hold.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE

CHI_SQUARE_90_OF_TWO = 4.6052
"""Nine in ten of the chi-square distribution's values of two degrees of freedom lie below."""
SHARED_SAMPLES = 10.0
"""What all cells spread by counts as so many samples of each one's own: a few samples alone tell none."""


class JointRegion(NamedTuple):
    """Ellipses: middles [C, k], inverse covariances [C, k, k], and squared distances [C] in them at which each ends."""

    middle: Array
    precision: Array
    square: Array

    def holds(self, at: Array) -> bool:
        """Return whether coordinates [k] lie inside one of them; the edge belongs to it."""
        away = at - self.middle
        return bool(np.any(np.einsum("ci,cij,cj->c", away, self.precision, away) <= self.square))


def joint_region(at: Array, weight: Array) -> JointRegion:
    """Return the ellipse that holds nine in ten of samples [n, k] whose weights [n] add up to 1."""
    middle, covariance = _moments(at, weight)
    away, precision = at - middle, np.linalg.inv(covariance)
    square = np.einsum("ni,ij,nj->n", away, precision, away)
    order = np.argsort(square)
    last = min(int(np.searchsorted(np.cumsum(weight[order]), COVERAGE)), len(order) - 1)
    return JointRegion(middle[None], np.asarray(precision[None], np.float64), square[order[last], None])


def profiled_region(at: Array, weight: Array, cell: NDArray[np.intp]) -> JointRegion:
    """Return where two unknowns [n, 2] are likely under the modulus of some cell, by samples [n] of cells.

    Within a cell they are Gaussian. Cells without samples have no ellipse.
    """
    of_all = np.bincount(cell, weight).astype(np.float64)
    seen = np.flatnonzero(of_all)
    share, inside = of_all[seen], [cell == number for number in seen]
    of_cells = [weight[one] / weight[one].sum() for one in inside]
    moments = [_moments(at[one], part) for one, part in zip(inside, of_cells, strict=True)]
    middle, own = (np.array(part) for part in zip(*moments, strict=True))
    covariance = pooled(own, share, np.array([1 / np.sum(part**2) for part in of_cells]))
    deviance = np.log(np.linalg.det(covariance)) - 2 * np.log(share)
    precision = np.asarray(np.linalg.inv(covariance), np.float64)
    return JointRegion(middle, precision, CHI_SQUARE_90_OF_TWO - (deviance - deviance.min()))


def pooled(own: Array, share: Array, worth: Array) -> Array:
    """Return variances [C, ...] of cells of a posterior, those of few samples nearer to the mean of all.

    `own` [C, ...] are those of each cell's samples, `worth` [C] how many these are, `share` [C] add up to 1.
    """
    worth = worth.reshape(-1, *[1] * (own.ndim - 1))
    return np.asarray((worth * own + SHARED_SAMPLES * np.tensordot(share, own, axes=1)) / (worth + SHARED_SAMPLES))


def _moments(at: Array, weight: Array) -> tuple[Array, Array]:
    """Return mean [k] and covariance [k, k] of samples [n, k] whose weights [n] add up to 1."""
    middle = weight @ at
    away = at - middle
    return middle, np.asarray((away * weight[:, None]).T @ away)
