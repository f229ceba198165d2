"""The frame of a ramp that is unlike what all others say of its force: a flash, a bubble, a slip. Or none.

No two frames of a ramp are alike, but the light of each block of the face follows the force smoothly: light over the
power of the force that contact follows is a cubic in the root of the force, to 3 % for any lump of the trained ranges;
light that no force changes, of gel, is none, but it is a cubic in the force, as an honest press is to 3.5 %. An outlier
lies off both, by how far it is from the cubic of the others (tests/device/instrument/test_ramp_outliers.py).
Source: externally studentised residuals, Cook & Weisberg, Residuals and Influence in Regression (1982), section 2.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.instrument.outlier_frames import DEVIATION_RATIO, ROBUST_SIGMAS, Outlier, light_at_one_force
from device.measurement.reference_light import EXPONENT
from device.measurement.tactile_image import Frame

Array = NDArray[np.float64]

DEGREE = 3
FEWEST_FRAMES = 8
"""Fewer leave too little beside the four coefficients to tell a frame from the course of the others."""


def ramp_outlier(frames: Sequence[Frame], dark_counts: float) -> Outlier | None:
    """Return the frame that lies furthest from the others' course, by more than sigmas and `DEVIATION_RATIO` allow.

    `dark_counts` is the mean of a frame without light. Frames of one light at forces (N) above 0 that differ.
    """
    if len(frames) < FEWEST_FRAMES:
        return None
    light = np.array([light_at_one_force(frame, dark_counts).ravel() for frame in frames])
    if np.mean(light) <= 0.0:
        return None
    force_n = np.array([frame.force_n for frame in frames])
    courses = _powers(np.sqrt(force_n)), _powers(force_n) / force_n[:, None] ** EXPONENT
    strays = [_stray(light / np.mean(light), course) for course in courses]
    if len({stray.number for stray in strays}) > 1 or not all(stray.is_beyond_chance for stray in strays):
        return None
    nearest = min(strays, key=lambda stray: stray.deviation_ratio)
    return Outlier(frames[nearest.number], nearest.deviation_ratio)


class _Stray(NamedTuple):
    """The frame that is furthest from the course of the others, by which part of the light, and what chance makes."""

    number: int
    deviation_ratio: float
    sigma_ratio: float

    @property
    def is_beyond_chance(self) -> bool:
        return self.deviation_ratio > max(ROBUST_SIGMAS * self.sigma_ratio, DEVIATION_RATIO)


def _powers(values: Array) -> Array:
    return np.vander(values - values.mean(), DEGREE + 1)


def _stray(light: Array, course: Array) -> _Stray:
    """Return the furthest of light [n, blocks] from the best sum of a course's columns [n, 4]."""
    basis, _ = np.linalg.qr(course)
    free = np.maximum(1 - np.sum(basis**2, axis=1), 1e-9)  # a frame's leverage leaves so much of its error to be seen
    squares = np.mean((light - basis @ (basis.T @ light)) ** 2, axis=1)
    worst = int(np.argmax(squares / free))
    left = max(float(np.sum(squares) - squares[worst] / free[worst]), 0.0)
    sigma = np.sqrt(left / (len(light) - DEGREE - 2))
    return _Stray(worst, float(np.sqrt(squares[worst]) / free[worst]), float(sigma))
