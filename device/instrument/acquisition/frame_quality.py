"""How bright, how saturated and how sharp frames are: what whoever turns the lens and sets the light looks at.

Sharpness is the variance of the image's Laplacian over the square of its mean, each above dark: more light alone does
not change it. Of two frames in a row it is the covariance of their Laplacians, not the variance of one: noise is
independent from frame to frame and drops out, or the darker of two images would seem the sharper one. For the same
reason each is taken above dark frames of its own. No unit; it compares images of one thing that is held still.
Source of the variance: Pech-Pacheco et al., "Diatom autofocusing in brightfield microscopy: a comparative study", ICPR
2000, vol. 3, 314-317.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from device.instrument.acquisition.light_check import FEWEST_COUNTS
from device.measurement.recording.tactile_image import Counts, Image, saturated_ratio

BRIGHTEST = 0.999
"""The quantile that is called brightest: more pixels at full scale than it leaves out are too many for a press, too."""


@dataclass(frozen=True)
class FrameQuality:
    """`mean_counts` and `brightest_counts` (the 99.9 % quantile) with the black level `dark_counts` in them.

    `saturated_ratio`: part of the pixels at full scale. `sharpness`: None without light, or without a frame before.
    """

    mean_counts: float
    brightest_counts: float
    dark_counts: float
    saturated_ratio: float
    sharpness: float | None

    @property
    def light_counts(self) -> float:
        """Mean counts above dark."""
        return self.mean_counts - self.dark_counts


class QualityWatch:
    """Compares each frame with the one before, above the mean of frames that were taken without light."""

    def __init__(self, dark: Sequence[Counts]) -> None:
        """Take frames without light, at least two, all of one shape [height, width]."""
        self._dark, self._others_dark = (_mean(dark[first::2]) for first in (0, 1))
        self._dark_counts = float(np.mean([self._dark, self._others_dark]))
        self._last: Image | None = None

    def saw(self, counts: Counts) -> FrameQuality:
        """Return the quality of the next frame [height, width], of the same light as the one before."""
        light: Image = counts.astype(np.float32) - self._dark
        curved, last = cv2.Laplacian(light, cv2.CV_32F), self._last
        self._last, self._dark, self._others_dark = curved, self._others_dark, self._dark
        mean_counts = float(light.mean())
        sharpness = None
        if last is not None and mean_counts >= FEWEST_COUNTS:
            covariance = np.mean((curved - curved.mean()) * (last - last.mean()), dtype=np.float64)
            sharpness = max(0.0, float(covariance) / mean_counts**2)
        brightest_counts = float(np.quantile(counts, BRIGHTEST))
        return FrameQuality(
            float(counts.mean()), brightest_counts, self._dark_counts, saturated_ratio(counts), sharpness
        )


def _mean(frames: Sequence[Counts]) -> Image:
    return np.asarray(np.mean(frames, axis=0, dtype=np.float32))
