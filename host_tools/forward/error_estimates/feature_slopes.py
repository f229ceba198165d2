"""How O1-O3 of a field change with its samples and with its integral: linear functionals that a dual load is made of.

The largest sample stays the largest. The area moves with its edges, each by what the field exceeds half of its largest
over how steeply it falls there.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from host_tools.forward.deformation import CENTRAL_RATIO, HALF_MAXIMUM


class Slope(NamedTuple):
    """The derivative of a feature: by each sample of the ray [R], and by the integral over the face."""

    per_sample: Array
    per_total: float


def feature_slopes(r_mm: Array, field_mm: Array) -> dict[str, Slope]:
    """Return the slopes of O1-O3 of a field [R] on one ray [R], by the names of `Deformation`."""
    window = np.flatnonzero(r_mm <= CENTRAL_RATIO * r_mm[-1] * (1 + 1e-12))
    peak = np.eye(len(r_mm))[int(field_mm[window].argmax())]
    return {
        "max_deformation_mm": Slope(peak, 0.0),
        "total_deformation_mm3": Slope(np.zeros_like(r_mm), 1.0),
        "central_deformation_mm3": Slope(_ring_weights(r_mm, window), 0.0),
        "deformation_area_mm2": Slope(_edge_weights(r_mm[window], field_mm[window], peak), 0.0),
    }


def _ring_weights(r_mm: Array, window: NDArray[np.int64]) -> Array:
    """Return the weights of the trapezoidal rule over the central window's rings."""
    weights = np.zeros_like(r_mm)
    steps = np.diff(r_mm[window])
    weights[window[:-1]] += steps / 2
    weights[window[1:]] += steps / 2
    return weights * 2 * np.pi * r_mm


def _edge_weights(r_mm: Array, field_mm: Array, peak: Array) -> Array:
    """Return how the area above half of the peak moves with every sample; not at all where there is no peak."""
    weights = np.zeros_like(peak)
    if field_mm.max() <= 0:
        return weights
    from scipy.interpolate import InterpolatedUnivariateSpline

    spline = InterpolatedUnivariateSpline(r_mm, field_mm - HALF_MAXIMUM * field_mm.max())
    for edge_mm in spline.roots():
        per_excess = 2 * np.pi * edge_mm / abs(float(spline.derivative()(edge_mm)))
        right = int(np.clip(np.searchsorted(r_mm, edge_mm), 1, len(r_mm) - 1))
        share = (edge_mm - r_mm[right - 1]) / (r_mm[right] - r_mm[right - 1])
        weights[right - 1] += per_excess * (1 - share)
        weights[right] += per_excess * share
        weights -= per_excess * HALF_MAXIMUM * peak
    return weights
