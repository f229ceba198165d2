"""Rows of the sensor as picamera2 gives them to the counts of a frame: unpack, cut out the middle, average areas.

A frame has 8 bits whatever the sensor has: more of them only make the mean over an area finer before it is rounded.
Rows are bytes, padded at their end; unpacked formats of more than 8 bits have two a pixel, the low one first, and
their bits at the low end. Source: libcamera formats R8, R10, R12, R16; picamera2 0.3.38 (`helpers.make_array`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

RawFormat = Literal["R8", "R10", "R12", "R16"]
RAW_BITS: dict[RawFormat, int] = {"R8": 8, "R10": 10, "R12": 12, "R16": 16}
"""Unpacked monochrome formats by libcamera's names, and their bits."""


@dataclass(frozen=True)
class RawMode:
    """A mode of the sensor and the frame that is made of it; sizes are (width, height) in pixels.

    `crop_px` is the part in the middle of the sensor that a frame shows, to half a pixel. It is no larger than the
    sensor and no smaller than the frame (device/settings/camera_section.py refuses both).
    """

    sensor_px: tuple[int, int]
    crop_px: tuple[int, int]
    frame_px: tuple[int, int]
    raw_format: RawFormat = "R8"

    @classmethod
    def whole(cls, width_px: int, height_px: int, raw_format: RawFormat = "R8") -> RawMode:
        """Return the mode whose every pixel is one of the frame."""
        size = (width_px, height_px)
        return cls(size, size, size, raw_format)

    @property
    def bytes_per_px(self) -> int:
        """Bytes of one pixel in a row."""
        return 1 if self.raw_format == "R8" else 2

    def frame(self, rows: NDArray[np.uint8]) -> NDArray[np.uint8]:
        """Return the counts [height_px, width_px] of a frame, a copy, from rows [sensor height, stride in bytes]."""
        counts = self._cropped(rows if self.bytes_per_px == 1 else rows.view("<u2"))
        if self.raw_format == "R8" and self.crop_px == self.frame_px:
            return np.array(counts, np.uint8)
        light = np.asarray(counts, np.float32) * np.float32(2.0 ** (8 - RAW_BITS[self.raw_format]))
        if self.crop_px != self.frame_px:
            light = _area_mean(light, self.frame_px)
        return np.asarray(np.minimum(np.rint(light), 255), np.uint8)

    def _cropped(self, counts: NDArray[np.uint8] | NDArray[np.uint16]) -> NDArray[np.uint8] | NDArray[np.uint16]:
        (sensor_x, sensor_y), (width, height) = self.sensor_px, self.crop_px
        x, y = (sensor_x - width) // 2, (sensor_y - height) // 2
        return counts[y : y + height, x : x + width]


def _area_mean(light: NDArray[np.float32], size_px: tuple[int, int]) -> NDArray[np.float32]:
    """Return an image of (width, height) pixels, each the mean of the area that it covers."""
    import cv2  # only a camera that scales has to load it

    return np.asarray(cv2.resize(light, size_px, interpolation=cv2.INTER_AREA), np.float32)
