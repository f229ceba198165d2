"""Where the inclusion lies under the face, by the frames of a press: what tells the hand that it is off the middle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.paper_mode.features import FeatureSettings, extract_features
from device.measurement.ramp_modes.radial_profile import FLOOR_COUNTS, contrast_and_valid
from device.measurement.recording.camera_geometry import CameraGeometry
from device.measurement.recording.frame_light import binned
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.reference_light import reference_light
from device.measurement.recording.tactile_image import Frame, TactileImage

BINNED_MM = 0.25
HARD_RATIO = 0.7
"""Press frames from this part of the largest force on are looked at."""
SPOT_CONTRAST = 0.02
"""A bright spot fainter than this is not told from the residue of two presses that were not quite alike."""


def inclusion_spot_mm(
    dark: Sequence[Frame], reference: Sequence[Frame], press: Sequence[Frame], geometry: CameraGeometry
) -> tuple[float, float] | None:
    """Return x (right) and y (down) in mm of the bright spot's centroid from the middle of the face.

    Frames of one shape, at least one of each, of a camera of `geometry`. None when nothing stands out. They are binned
    before anything is divided, and only the hardest of the press are looked at, where the inclusion is brightest.
    Source: centroid of the paper's features, docs/measurement.md.
    """
    scale = geometry.scale
    factor = _factor(scale.mm_per_px_x), _factor(scale.mm_per_px_y)
    base = np.asarray(np.mean([binned(frame, factor) for frame in dark], axis=0), dtype=np.float32)
    lit = [binned(frame, factor) - base for frame in reference]
    light = reference_light([frame.force_n for frame in reference], lit, FLOOR_COUNTS)
    hardest_n = max(frame.force_n for frame in press)
    hard = [frame for frame in press if frame.force_n >= HARD_RATIO * hardest_n]
    seen = [contrast_and_valid(binned(frame, factor) - base, light, frame.force_n) for frame in hard]
    contrast = np.asarray(np.mean([contrast for contrast, _ in seen], axis=0), dtype=np.float32)
    of_blocks = PixelScale(scale.mm_per_px_x * factor[0], scale.mm_per_px_y * factor[1])
    image = TactileImage(contrast, np.all([valid for _, valid in seen], axis=0), of_blocks, hardest_n)
    features = extract_features(image, FeatureSettings())
    if features.centroid_intensity < SPOT_CONTRAST:
        return None
    x_mm, y_mm = geometry.face_mm(np.array(features.centroid_x_mm), np.array(features.centroid_y_mm))
    return float(x_mm), float(y_mm)


def _factor(mm_per_px: float) -> int:
    return max(round(BINNED_MM / mm_per_px), 1)
