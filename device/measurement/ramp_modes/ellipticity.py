"""Whether a bright spot is round: its second harmonic, against that of the best fit's round inclusion.

A round inclusion beside the axis shows a second harmonic, too, which the surrogate tells. What is left is searched for
a spot that is stretched in some direction: the contrast f(r) becomes f(r) + e r df/dr cos(2 (angle - a)), whose second
harmonic is r df/dr times e. How far e lies from 0, in standard deviations of all that camera, flat field and model
leave open, is about Rayleigh's for a round inclusion; what the best fit itself does not know adds a little, so the
critical value is measured on recordings. Source: Kay, Fundamentals of Statistical Signal Processing II (1998), 13.4.3,
a known pattern of unknown amplitude and phase; docs/modes.md counts how often inclusions that are not round, and pairs
of inclusions, are refused.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from device.measurement.ramp_modes.noise import LOADS, PressNoise, light_ratio, smooth_errors
from device.measurement.ramp_modes.radial_profile import COLUMN_COUNTS, CONTRAST, SECOND
from device.measurement.recording.ring_means import RING_RADII_MM, RINGS

SECOND_COLUMNS = COLUMN_COUNTS[-1]


def elongation_deviations(second_harmonic: Array, row: Array, noise: PressNoise, factor: Array | None = None) -> float:
    """Return how far a press' `second_harmonic` [2, K, J - 2] is from round, in standard deviations.

    `row` [P] is that of its best fit, which is round; `factor` [P, K] one of a covariance beside that of the noise.
    """
    pattern = stretched(row[CONTRAST].reshape(LOADS, RINGS))
    covariance = second_covariance(row, noise)
    if factor is not None:
        covariance = covariance + factor[SECOND] @ factor[SECOND].T
    weights = np.linalg.solve(covariance, pattern)
    left = second_harmonic.reshape(2, SECOND_COLUMNS) - np.stack([row[SECOND], np.zeros(SECOND_COLUMNS)])
    return float(np.linalg.norm(left @ weights) / np.sqrt(weights @ pattern))


def second_covariance(row: Array, noise: PressNoise) -> Array:
    """Return the covariance [Q, Q] of what noise leaves of second harmonics, along as across, of a row [P]."""
    light = light_ratio(row)[SECOND]
    alike = noise.camera[SECOND, SECOND] + smooth_errors(noise.levels)[SECOND, SECOND]
    return np.asarray(light[:, None] * light * alike)


def stretched(contrast: Array) -> Array:
    """Return the second harmonics [Q] of spots of contrast [K, J] that are stretched, for a stretch of 1: r df/dr."""
    slope_per_mm = np.gradient(contrast, RING_RADII_MM, axis=1)
    return np.asarray((RING_RADII_MM * slope_per_mm)[:, 1:-1].ravel())
