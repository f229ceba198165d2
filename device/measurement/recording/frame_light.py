"""Frames of a camera to the light above its dark: binned, of the face, all as bright as the first of them.

Frames are binned before anything is divided: noise in a denominator would raise every contrast.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.camera_geometry import FaceMap, face_map
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import Recording
from device.measurement.recording.reference_light import Image
from device.measurement.recording.tactile_image import Frame, brightness_of

BINNED_MM = 0.125
"""Pixels are put together to about this width: light spreads eight times as far in the skin."""
TOUCHED_N = 0.07
"""Below this force a reference frame shows an untouched face."""


@dataclass(frozen=True, eq=False)
class RampLights:
    """Light above dark of lit frames, binned: forces [n] and images [n, height, width] of a pixel scale.

    `seen` [height, width] of the face, where the camera did not see all of the image.
    """

    force_n: Array
    images: Sequence[Image]
    scale: PixelScale
    seen: NDArray[np.bool_] | None = None


@dataclass(frozen=True, eq=False)
class FrameLight:
    """Frames of a camera to light above its dark, binned: all as bright as the `first` of them.

    The camera's axis and distortion are undone: images are of the face, about its middle.
    """

    dark: Image
    factor: tuple[int, int]
    per_count: float
    first: LedRatio | None
    on_face: FaceMap | None
    scale: PixelScale

    def lights(self, frames: Sequence[Frame]) -> RampLights:
        """Return the light of frames; raises `InvalidQuantity` unless all are lit in the first one's proportion."""
        force_n, seen = np.array([frame.force_n for frame in frames]), self.on_face.seen if self.on_face else None
        return RampLights(force_n, [self._light(frame) for frame in frames], self.scale, seen)

    def _light(self, frame: Frame) -> Image:
        ratio = np.float32(self.per_count / brightness_of(frame.led_ratio, self.first or frame.led_ratio))
        image = (binned(frame, self.factor) - self.dark) * ratio
        return self.on_face(image) if self.on_face else image


def frame_light(recording: Recording, frames: Sequence[Frame]) -> FrameLight:
    """Return what brings frames of a recording to light as bright as the first of these; without dark it raises."""
    dark = recording.with_role("dark")
    if not dark:
        raise InvalidQuantity("dark frames", 0, "at least one", "record dark frames before the press")
    camera = recording.camera
    factor, scale = _binning(camera.scale), binned_scale(camera.scale)
    base = np.asarray(np.mean([binned(frame, factor) for frame in dark], axis=0), dtype=np.float32)
    per_count = 1 if camera.bits == 8 else 1 / 256
    first = next((frame.led_ratio for frame in frames), None)
    return FrameLight(base, factor, per_count, first, face_map(camera.geometry, base.shape, scale), scale)


def lights_of(recording: Recording) -> tuple[RampLights, RampLights]:
    """Return the light of the touched reference frames and of the press frames, all as bright as the first of them.

    Raises `InvalidQuantity` without dark frames, and for a frame whose sides are not lit in the first one's proportion.
    """
    reference, press = (touched(recording, role) for role in ("reference", "press"))
    camera = frame_light(recording, [*reference, *press])
    return camera.lights(reference), camera.lights(press)


def touched(recording: Recording, role: str) -> list[Frame]:
    """Return the frames of a role; of the reference those of a touched face."""
    return [frame for frame in recording.with_role(role) if role == "press" or frame.force_n > TOUCHED_N]


def _binning(scale: PixelScale) -> tuple[int, int]:
    return tuple(max(round(BINNED_MM / size), 1) for size in (scale.mm_per_px_x, scale.mm_per_px_y))  # type: ignore[return-value]


def binned_scale(scale: PixelScale) -> PixelScale:
    """Return the size of the pixels after binning."""
    x, y = _binning(scale)
    return PixelScale(x * scale.mm_per_px_x, y * scale.mm_per_px_y)


def binned(frame: Frame, factor: tuple[int, int]) -> Image:
    """Return the frame's means over blocks of pixels; the rows and columns left over are dropped evenly."""
    (height, width), (x, y) = frame.counts.shape, factor
    top, left = height % y // 2, width % x // 2
    counts = frame.counts[top : top + height // y * y, left : left + width // x * x].astype(np.float32)
    return np.asarray(cv2.resize(counts, (width // x, height // y), interpolation=cv2.INTER_AREA), dtype=np.float32)
