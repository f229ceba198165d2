"""Where on the face a camera's pixels look: pixel size, optical axis and distortion, and the image that undoes them.

Where the pixel size alone says X (mm from the image's middle), the camera sees the face at X (1 + d (|X| / 11 mm)^2) +
axis, with d = `rim_distortion_percent` / 100: as the simulator's `TrueCamera` has it. An image is undone by taking from
it, for each place of the face, the pixel that shows it; rings are then about the face's middle, in true millimetres.
Source: the first term of radial distortion, Brown, Photogrammetric Engineering 37 (1971).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.reference_light import Image

RIM_MM = 11.0
"""Radius at which a distortion is stated: the face's rim."""
AXIS, RIM_DISTORTION = Bound(-2.0, 2.0, "mm"), Bound(-10.0, 10.0, "%")
ACTION = "centre the camera, or find it anew from a grid target with `host_tools probe camera`"
STEPS = 8
"""Newton steps from the face to the image; five are enough for 10 % of distortion."""
MISSED_MM = 1e-6


@dataclass(frozen=True)
class CameraGeometry:
    """Pixel size, where the optical axis meets the face (mm from its middle), and the distortion at 11 mm."""

    scale: PixelScale
    axis_x_mm: float = 0.0
    axis_y_mm: float = 0.0
    rim_distortion_percent: float = 0.0

    def __post_init__(self) -> None:
        for name in ("axis_x_mm", "axis_y_mm"):
            require(f"camera.{name}", getattr(self, name), AXIS, ACTION)
        require("camera.rim_distortion_percent", self.rim_distortion_percent, RIM_DISTORTION, ACTION)

    @property
    def is_ideal(self) -> bool:
        """Return whether the image's middle shows the face's, and straight lines are straight."""
        return not (self.axis_x_mm or self.axis_y_mm or self.rim_distortion_percent)

    def face_mm(
        self, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating]
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Return where on the face places of the image are; both mm, from the middle of each, and broadcast."""
        farther = 1 + self._at_1_mm * (x_mm**2 + y_mm**2)
        return x_mm * farther + self.axis_x_mm, y_mm * farther + self.axis_y_mm

    def image_mm(
        self, x_mm: NDArray[np.floating], y_mm: NDArray[np.floating]
    ) -> tuple[NDArray[np.floating], NDArray[np.floating]]:
        """Return where in the image places of the face are, the inverse of `face_mm`; NaN where no image shows them."""
        x, y = np.broadcast_arrays(np.asarray(x_mm, float) - self.axis_x_mm, np.asarray(y_mm, float) - self.axis_y_mm)
        seen_mm = np.hypot(x, y)
        k, image_mm = self._at_1_mm, seen_mm.copy()
        last_mm = math.sqrt(-1 / (3 * k)) if k < 0 else math.inf
        for _ in range(STEPS):
            slope = np.maximum(1 + 3 * k * image_mm**2, 1e-3)
            image_mm = np.clip(image_mm - (image_mm * (1 + k * image_mm**2) - seen_mm) / slope, 0, last_mm)
        missed = np.abs(image_mm * (1 + k * image_mm**2) - seen_mm) > MISSED_MM
        nearer = np.divide(image_mm, seen_mm, out=np.ones_like(seen_mm), where=seen_mm > 0)
        nearer[missed] = np.nan
        return x * nearer, y * nearer

    @property
    def _at_1_mm(self) -> float:
        return self.rim_distortion_percent / 100 / RIM_MM**2


@dataclass(frozen=True, eq=False)
class FaceMap:
    """From an image to the same image as an ideal camera of this pixel size had it; `seen` [height, width] of it."""

    seen: NDArray[np.bool_]
    columns: NDArray[np.float32]
    rows: NDArray[np.float32]

    def __call__(self, image: Image) -> Image:
        """Return the image [height, width] of the face; what is not `seen` means nothing."""
        return np.asarray(
            cv2.remap(image, self.columns, self.rows, cv2.INTER_LANCZOS4, borderMode=cv2.BORDER_REPLICATE), np.float32
        )


@lru_cache(maxsize=4)
def face_map(geometry: CameraGeometry, shape: tuple[int, int], scale: PixelScale) -> FaceMap | None:
    """Return what undoes the geometry in images [height, width] of pixels of `scale`, its own or binned.

    None of an ideal camera, whose images stay what they are to the last bit.
    """
    if geometry.is_ideal:
        return None
    height, width = shape
    x_mm, y_mm = geometry.image_mm(*scale.coordinates_mm(shape))
    columns, rows = x_mm / scale.mm_per_px_x + (width - 1) / 2, y_mm / scale.mm_per_px_y + (height - 1) / 2
    with np.errstate(invalid="ignore"):
        seen = (np.abs(columns - (width - 1) / 2) <= width / 2) & (np.abs(rows - (height - 1) / 2) <= height / 2)
    outside = np.float32(-1.0)
    return FaceMap(seen, *(np.where(seen, place, outside).astype(np.float32) for place in (columns, rows)))
