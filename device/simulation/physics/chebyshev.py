"""Chebyshev points and the weights that interpolate between them.

Source: Berrut & Trefethen, Barycentric Lagrange interpolation, SIAM Review 46 (2004), equation 4.2.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from device.measurement.arrays import Array


def points_with_ends(low: float, high: float, count: int) -> Array:
    """Return ascending Chebyshev points of the second kind, both ends included."""
    return np.asarray((low + high) / 2 - (high - low) / 2 * np.cos(np.pi * np.arange(count) / (count - 1)))


def points_inside(low: float, high: float, count: int) -> Array:
    """Return ascending Chebyshev points of the first kind, neither end included."""
    return np.asarray((low + high) / 2 - (high - low) / 2 * np.cos(np.pi * (np.arange(count) + 0.5) / count))


def interpolation_weights(points: Array, at: float) -> Array:
    """Return the weights [n] of the values at n distinct points in the polynomial through them, at one place."""
    distance = at - points
    hit = np.flatnonzero(np.abs(distance) < 1e-12 * np.ptp(points))
    if len(hit):
        return np.asarray(np.eye(len(points))[hit[0]])
    gaps = (points[:, None] - points[None, :]) / np.ptp(points) + np.eye(len(points))
    terms = 1 / (gaps.prod(axis=1) * distance)
    return np.asarray(terms / terms.sum())


def slope_weights(points: Array, at: float) -> Array:
    """Return the weights [n] of the values in the slope of the polynomial through them, at one place.

    A central difference so narrow that its error, like that of rounding, is below 1e-7 of the slope.
    """
    half = 1e-5 * float(np.ptp(points))
    ahead, behind = (interpolation_weights(points, at + step) for step in (half, -half))
    return np.asarray((ahead - behind) / (2 * half))


def interpolated(fields: Array, axes: Iterable[Array], place: Iterable[float]) -> Array:
    """Return fields [n0, n1, n2, ...] at a place on the axes from n1 on: [n0, ...] without the axes interpolated in."""
    for points, at in zip(axes, place, strict=True):
        fields = np.tensordot(interpolation_weights(points, at), fields, (0, 1))
    return fields
