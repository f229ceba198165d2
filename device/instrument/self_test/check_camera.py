"""Dark frames to the state of the camera: their level, noise from frame to frame, and pixels that are never dark.

A noise below half a count is hidden by the rounding to whole counts and is given as half a count. Source: EMVA Standard
1288, temporal noise from the difference of two images of equal exposure, no reliable estimate below 0.24 counts^2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.instrument.self_test.result import Result, judged
from device.measurement.quantities import Bound
from device.measurement.tactile_image import Counts

PART = "Camera"
NOISE = Bound(-np.inf, 1.5, "counts")
"""A frame's noise that a mean over ten frames and a ring of pixels still makes small beside a lump's light."""
LEAST_NOISE_COUNTS = 0.24**0.5
HOT_COUNTS = 10.0
"""A pixel that is so much above the dark level in every frame is hot."""
HOT_SHARE = Bound(-np.inf, 2e-4, "of pixels")
"""75 of 768 x 492: that many are lost in a ring's mean."""


def camera_results(dark: Sequence[Counts], max_dark_counts: float) -> list[Result]:
    """Return level, noise and hot pixels of an even number of frames [height, width] taken without light.

    `max_dark_counts` includes the black level.
    """
    frames = np.asarray(dark, dtype=np.float32)
    mean = frames.mean(axis=0)
    is_hot = mean > np.median(mean) + HOT_COUNTS
    level = Bound(-np.inf, max_dark_counts, "counts")
    return [
        judged(PART, "dark level", mean.mean(), level, "Shade the probe, and check that no side stays on."),
        judged(PART, "noise", _noise_counts(frames[:, ~is_hot]), NOISE, "Let it cool; then have the camera replaced."),
        judged(PART, "hot pixels", is_hot.mean(), HOT_SHARE, "Let it cool; then have the camera replaced."),
    ]


def _noise_counts(values: np.ndarray) -> float:
    """Return the standard deviation (counts) from frame to frame of values [frames, pixels], as far as it is known."""
    pairs = (values[1::2] - values[0::2]) / np.sqrt(2.0)
    return max(float(np.sqrt(np.mean(pairs**2))), LEAST_NOISE_COUNTS)
