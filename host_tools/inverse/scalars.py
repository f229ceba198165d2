"""Contrast on rings to the paper's three scalars, with derivatives and errors carried along to first order.

As the probe takes them from its image (`device/measurement/features.py`): smoothed contrast at the centre, its integral
over the window, and the area where it exceeds half of the first.
"""

from __future__ import annotations

import numpy as np

from host_tools.inverse.observation import Observation
from host_tools.inverse.rings import Array, Rings

SMOOTHING_MM = 0.5
THRESHOLD_RATIO = 0.5
STEP = 1e-6
"""Of the contrast, in differences of the scalars."""


def scalars_of(seen: Observation, loads: int, rings: Rings) -> Observation:
    """Return centre (1), integral (mm2) and bright area (mm2) for each load instead of the rings.

    An area that fills the window is left out: it has no error, and knows nothing.
    """
    slope = _slope(seen.values, loads, rings)
    varies = slope.any(axis=1)
    slope = slope[varies]
    return Observation(
        _scalars(seen.values, loads, rings)[varies],
        {name: slope @ change for name, change in seen.derivatives.items()},
        slope @ seen.covariance @ slope.T,
    )


def _slope(contrast: Array, loads: int, rings: Rings) -> Array:
    """Return the derivatives [scalars, rings] of all scalars by the contrast of every ring."""
    steps = STEP * np.eye(len(contrast))
    columns = [_scalars(contrast + s, loads, rings) - _scalars(contrast - s, loads, rings) for s in steps]
    return np.stack(columns, axis=1) / (2 * STEP)


def _scalars(contrast: Array, loads: int, rings: Rings) -> Array:
    return np.concatenate([three_scalars(part, rings) for part in np.split(contrast, loads)])


def three_scalars(contrast: Array, rings: Rings) -> Array:
    """Return centre, integral and bright area of the contrast on rings [K].

    The area ends where the straight line between two rings first falls below the threshold; without such a place it
    is the whole window's, and tells nothing.
    """
    weight = rings.area_mm2 * np.exp(-(rings.r_mm**2) / (2 * SMOOTHING_MM**2))
    centre = float(weight @ contrast / weight.sum())
    above = (contrast - THRESHOLD_RATIO * centre) * np.sign(centre)
    below = np.flatnonzero(above[1:] <= 0)
    if not len(below):
        return np.array([centre, rings.area_mm2 @ contrast, rings.area_mm2.sum()])
    i = int(below[0])
    edge_mm = rings.r_mm[i] + (rings.r_mm[i + 1] - rings.r_mm[i]) * above[i] / (above[i] - above[i + 1])
    return np.array([centre, rings.area_mm2 @ contrast, np.pi * edge_mm**2])
