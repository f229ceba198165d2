"""A mode of the sensor as picamera2 names it, and the part of it that a frame shows.

A frame has 8 bits whatever the sensor has. Sizes only, without NumPy: the settings name a mode, too; what is made of
its rows is in device/hardware/camera.py.
Source: libcamera formats R8, R10, R12, R16; picamera2 0.3.38 (`helpers.make_array`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

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

    @property
    def crop_from_px(self) -> tuple[int, int]:
        """First column and row of the sensor that a frame shows."""
        (sensor_x, sensor_y), (width, height) = self.sensor_px, self.crop_px
        return (sensor_x - width) // 2, (sensor_y - height) // 2
