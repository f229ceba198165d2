"""Samples of a Gaussian that the ranges cut off, one coordinate after the other, each between its ends.

What a press tells little of is even over its range: of Gaussian samples in nine coordinates most would lie outside.
So each coordinate is drawn given those before it, between -1 and 1, and the density that it was drawn with is known.
Logistic distributions stand for the normal ones: their inverse is a logarithm, and their tails miss nothing.
Source: Hajivassiliou, McFadden & Ruud, J. Econometrics 72 (1996), the simulator of Geweke, Hajivassiliou and Keane.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array

SCALE = 0.62
"""Of the logistic distribution that stands for a standard normal one: 1.12 times as wide."""
FAR = 500.0
"""Beyond so many scales a logistic distribution is an exponential one, which is the same wherever it is cut off."""


def draw_within(middle: Array, factor: Array, rng: np.random.Generator) -> Array:
    """Return samples [n, k] between -1 and 1, about middles [n, k], with factors [n, k, k] of their covariances."""
    at, deviation = np.empty_like(middle), np.zeros_like(middle)
    for number, even in enumerate(rng.uniform(size=middle.shape[::-1])):
        spread = factor[:, number, number]
        mean = middle[:, number] + np.einsum("nj,nj->n", factor[:, number, :number], deviation[:, :number])
        deviation[:, number] = SCALE * _Tail.between((-1 - mean) / spread, (1 - mean) / spread).at(even)
        at[:, number] = mean + spread * deviation[:, number]
    return np.clip(at, -1.0, 1.0)


def log_density_within(at: Array, middle: Array, whitening: NDArray[Any]) -> Array:
    """Return the logarithm of the density [n] with which `draw_within` draws samples [n, k].

    `whitening` [n, k, k] is the inverse of the factor, of each sample or one of all.
    """
    deviation = np.einsum("...ij,...j->...i", whitening, at - middle)
    spread = 1 / np.diagonal(whitening, axis1=-2, axis2=-1)
    mean = at - spread * deviation  # given those before
    tail = _Tail.between((-1 - mean) / spread, (1 - mean) / spread)
    return np.asarray(np.sum(tail.log_density(deviation / SCALE) - np.log(SCALE * spread), axis=-1))


class _Tail(NamedTuple):
    """The part [...] of logistic distributions between `low` and `high`, in which there is more below 0 than above.

    `sign`: -1 where it was turned for that. `moved`: how far an exponential one was moved for numbers to hold it.
    """

    low: Array
    high: Array
    sign: Array
    moved: Array

    @classmethod
    def between(cls, low: Array, high: Array) -> _Tail:
        """Return the part between two numbers of standard deviations [...]."""
        sign = np.where(low + high > 0, -1.0, 1.0)
        low, high = np.where(sign < 0, (-high, -low), (low, high)) / SCALE
        moved = np.minimum(high + FAR, 0.0)
        return cls(low - moved, high - moved, sign, moved)

    def at(self, even: Array) -> Array:
        """Return where shares [...] of the part lie below, in scales."""
        below = _share_below(self.low)
        share = below + (_share_below(self.high) - below) * even
        place = np.log(np.maximum(share, np.finfo(float).tiny)) - np.log1p(-np.minimum(share, 1 - 1e-16))
        return np.asarray(self.sign * (np.clip(place, self.low, self.high) + self.moved))

    def log_density(self, place: Array) -> Array:
        """Return the logarithm of the density [...] by the scale."""
        from_zero = np.abs(self.sign * place - self.moved)
        inside = _share_below(self.high) - _share_below(self.low)
        return np.asarray(-from_zero - 2 * np.log1p(np.exp(-from_zero)) - np.log(inside))


def _share_below(place: Array) -> NDArray[np.float64]:
    """Return the share [...] of a logistic distribution below a place in scales."""
    return np.asarray(1 / (1 + np.exp(-np.clip(place, -FAR - 200, None))))
