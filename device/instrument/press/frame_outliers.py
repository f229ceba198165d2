"""Frames of a hold or of a ramp to the one that is most unlike the others: a flash, a bubble, a slip.

Of a hold, the light above dark in blocks of the face is compared, brought to one force by the power that contact
follows; so both the mean level and the profile count. Source: median and median absolute deviation, Rousseeuw & Croux,
J. Am. Stat. Assoc. 88 (1993).

No two frames of a ramp are alike, but the light of each block of the face follows the force smoothly: light over the
power of the force that contact follows is a cubic in the root of the force, to 3 % for any inclusion of the trained
ranges; light that no force changes, of gel, is none, but it is a cubic in the force, as an honest press is to 3.5 %. An
outlier lies off both, by how far it is from the cubic of the others
(tests/device/instrument/press/test_ramp_outliers.py). Source: externally studentised residuals, Cook & Weisberg,
Residuals and Influence in Regression (1982), section 2.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.recording.reference_light import EXPONENT
from device.measurement.recording.tactile_image import Frame

BLOCKS = 6, 8
"""Rows and columns of blocks."""
FEWEST_FRAMES = 5
"""Of fewer nobody can say which one is unlike the others."""
FEWEST_RAMP_FRAMES = 8
"""Fewer leave too little beside the four coefficients to tell a frame from the course of the others."""
DEGREE = 3
ROBUST_SIGMAS = 6.0
DEVIATION_RATIO = 0.05
"""A deviation below this part of the light is no outlier however alike the others are; the band is as wide."""
MAD_TO_SIGMA = 1.4826


@dataclass(frozen=True)
class Outlier:
    """The frame that is unlike the others, and by which part of the light."""

    frame: Frame
    deviation_ratio: float


def worst_outlier(frames: Sequence[Frame], dark_counts: float) -> Outlier | None:
    """Return the frame that deviates most, when that is more than robust sigmas and `DEVIATION_RATIO` allow.

    `dark_counts` is the mean of a frame without light. Frames of one light, at least 8 x 8 pixels.
    """
    if len(frames) < FEWEST_FRAMES:
        return None
    deviations = _deviations([light_at_one_force(frame, dark_counts) for frame in frames])
    sigma = MAD_TO_SIGMA * float(np.median(deviations))
    worst = int(np.argmax(deviations))
    if deviations[worst] <= max(ROBUST_SIGMAS * sigma, DEVIATION_RATIO):
        return None
    return Outlier(frames[worst], float(deviations[worst]))


def _deviations(lights: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the root mean square deviation of each frame's blocks from the median frame, over its mean light."""
    light = np.array(lights)
    usual = np.median(light, axis=0)
    level = float(np.mean(usual))
    if level <= 0.0:
        return np.zeros(len(lights))
    return np.asarray(np.sqrt(np.mean((light - usual) ** 2, axis=(1, 2))) / level)


def ramp_outlier(frames: Sequence[Frame], dark_counts: float) -> Outlier | None:
    """Return the frame that lies furthest from the others' course, by more than sigmas and `DEVIATION_RATIO` allow.

    `dark_counts` is the mean of a frame without light. Frames of one light at forces (N) above 0 that differ.
    """
    if len(frames) < FEWEST_RAMP_FRAMES:
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


def _stray(light: Array, course: Array) -> _Stray:
    """Return the furthest of light [n, blocks] from the best sum of a course's columns [n, 4]."""
    basis, _ = np.linalg.qr(course)
    free = np.maximum(1 - np.sum(basis**2, axis=1), 1e-9)  # a frame's leverage leaves so much of its error to be seen
    squares = np.mean((light - basis @ (basis.T @ light)) ** 2, axis=1)
    worst = int(np.argmax(squares / free))
    left = max(float(np.sum(squares) - squares[worst] / free[worst]), 0.0)
    sigma = np.sqrt(left / (len(light) - DEGREE - 2))
    return _Stray(worst, float(np.sqrt(squares[worst]) / free[worst]), float(sigma))


def _powers(values: Array) -> Array:
    return np.vander(values - values.mean(), DEGREE + 1)


def light_at_one_force(frame: Frame, dark_counts: float) -> NDArray[np.float64]:
    """Return the light above dark in blocks [6, 8] of a frame, over the power of its force that contact follows."""
    rows, columns = BLOCKS
    blocks = cv2.resize(frame.counts.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray((blocks - dark_counts) / max(frame.force_n, 1e-6) ** EXPONENT, dtype=np.float64)
