"""Where the lump lies under the face: the frames of both presses to the bright spot's centroid, or None.

Frames are binned before anything is divided, and only the hardest of the press are looked at, where the lump is
brightest. A face that shows no lump has no spot. Source: centroid of the paper's features, docs/measurement.md.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from device.measurement.features import FeatureSettings, extract_features
from device.measurement.pixel_scale import PixelScale
from device.measurement.press_profile import FLOOR_COUNTS, contrast_and_valid
from device.measurement.reference_light import Image, reference_light
from device.measurement.tactile_image import Frame, TactileImage

BINNED_MM = 0.25
HARD_RATIO = 0.7
"""Press frames from this part of the largest force on are looked at."""
SPOT_CONTRAST = 0.02
"""A bright spot fainter than this is not told from the residue of two presses that were not quite alike."""


def lump_spot_mm(
    dark: Sequence[Frame], reference: Sequence[Frame], press: Sequence[Frame], scale: PixelScale
) -> tuple[float, float] | None:
    """Return x (right) and y (down) in mm of the bright spot's centroid from the middle of the face.

    Frames of one shape, at least one of each; pixels of `scale`. None when nothing stands out.
    """
    factor = _factor(scale.mm_per_px_x), _factor(scale.mm_per_px_y)
    base = np.asarray(np.mean([_binned(frame, factor) for frame in dark], axis=0), dtype=np.float32)
    lit = [_binned(frame, factor) - base for frame in reference]
    light = reference_light([frame.force_n for frame in reference], lit, FLOOR_COUNTS)
    hardest_n = max(frame.force_n for frame in press)
    hard = [frame for frame in press if frame.force_n >= HARD_RATIO * hardest_n]
    seen = [contrast_and_valid(_binned(frame, factor) - base, light, frame.force_n) for frame in hard]
    contrast = np.asarray(np.mean([contrast for contrast, _ in seen], axis=0), dtype=np.float32)
    binned = PixelScale(scale.mm_per_px_x * factor[0], scale.mm_per_px_y * factor[1])
    image = TactileImage(contrast, np.all([valid for _, valid in seen], axis=0), binned, hardest_n)
    features = extract_features(image, FeatureSettings())
    if features.centroid_intensity < SPOT_CONTRAST:
        return None
    return features.centroid_x_mm, features.centroid_y_mm


def _factor(mm_per_px: float) -> int:
    return max(round(BINNED_MM / mm_per_px), 1)


def _binned(frame: Frame, factor: tuple[int, int]) -> Image:
    """Return means over blocks of pixels; the rows and columns left over are dropped evenly."""
    (height, width), (x, y) = frame.counts.shape, factor
    top, left = height % y // 2, width % x // 2
    counts = frame.counts[top : top + height // y * y, left : left + width // x * x].astype(np.float32)
    return np.asarray(cv2.resize(counts, (width // x, height // y), interpolation=cv2.INTER_AREA), dtype=np.float32)
