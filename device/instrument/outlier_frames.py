"""Frames of a hold that are unlike the others: a flash, a bubble, a slip. To the worst of them, or none.

Compared is the light above dark in blocks of the face, brought to one force by the power that contact follows; so both
the mean level and the profile count. Frames of a ramp are compared otherwise: device/instrument/ramp_outliers.py.
Source: median and median absolute deviation, Rousseeuw & Croux, J. Am. Stat. Assoc. 88 (1993).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.reference_light import EXPONENT
from device.measurement.tactile_image import Frame

BLOCKS = 6, 8
"""Rows and columns of blocks."""
FEWEST_FRAMES = 5
"""Of fewer nobody can say which one is unlike the others."""
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


def light_at_one_force(frame: Frame, dark_counts: float) -> NDArray[np.float64]:
    """Return the light above dark in blocks [6, 8] of a frame, over the power of its force that contact follows."""
    rows, columns = BLOCKS
    blocks = cv2.resize(frame.counts.astype(np.float32), (columns, rows), interpolation=cv2.INTER_AREA)
    return np.asarray((blocks - dark_counts) / max(frame.force_n, 1e-6) ** EXPONENT, dtype=np.float64)


def _deviations(lights: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Return the root mean square deviation of each frame's blocks from the median frame, over its mean light."""
    light = np.array(lights)
    usual = np.median(light, axis=0)
    level = float(np.mean(usual))
    if level <= 0.0:
        return np.zeros(len(lights))
    return np.asarray(np.sqrt(np.mean((light - usual) ** 2, axis=(1, 2))) / level)
