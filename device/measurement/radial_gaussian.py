"""A ring profile to the Gaussian that fits it best: height, standard deviation, constant and what is left.

Height and constant are linear, so only the standard deviation is searched, over all of its range: no start to choose
and no local minimum to be caught in. Source: variable projection, Golub & Pereyra, SIAM J. Numer. Anal. 10 (1973).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.recording.ring_means import RING_AREAS_MM2, RING_RADII_MM

SIGMAS_MM: Array = np.geomspace(0.5, 9.0, 160)
"""The standard deviations tried; between them a parabola finds the best."""
WEIGHT: Array = RING_AREAS_MM2 / RING_AREAS_MM2.sum()


class RadialGaussian(NamedTuple):
    """`peak` exp(-r^2 / 2 `sigma_mm`^2) + `constant`; `residual_ratio` is the rms left over the peak."""

    peak: float
    sigma_mm: float
    constant: float
    residual_ratio: float


NO_GAUSSIAN = RadialGaussian(*[float("nan")] * 4)


def fit_gaussian(contrast: Array) -> RadialGaussian:
    """Return the Gaussian of a profile [J] on `RING_RADII_MM`, rings weighted by their area.

    All four are NaN when the profile has no bright middle, or is wider or narrower than `SIGMAS_MM`.
    """
    likeness = _SHAPES @ (WEIGHT * contrast)
    best = int(likeness.argmax())
    if not 0 < best < len(SIGMAS_MM) - 1 or likeness[best] <= 0.0:
        return NO_GAUSSIAN
    before, at, after = likeness[best - 1 : best + 2]
    steps = 0.5 * (before - after) / (before - 2 * at + after)
    sigma_mm = float(SIGMAS_MM[best] * (SIGMAS_MM[1] / SIGMAS_MM[0]) ** steps)
    bell = _bell(sigma_mm)
    centred = bell - WEIGHT @ bell
    peak = float((WEIGHT * centred) @ contrast / ((WEIGHT * centred) @ centred))
    constant = float(WEIGHT @ (contrast - peak * bell))
    left = contrast - peak * bell - constant
    return RadialGaussian(peak, sigma_mm, constant, float(np.sqrt(WEIGHT @ left**2)) / peak)


def _bell(sigma_mm: float | Array) -> Array:
    return np.asarray(np.exp(-0.5 * (RING_RADII_MM / sigma_mm) ** 2))


def _shapes() -> Array:
    """Return the Gaussians [S, J] less their mean and of unit length: what a profile is likened to."""
    bells = _bell(SIGMAS_MM[:, None])
    centred = bells - (bells @ WEIGHT)[:, None]
    return np.asarray(centred / np.sqrt(centred**2 @ WEIGHT)[:, None])


_SHAPES = _shapes()
