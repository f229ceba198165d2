"""Rows of the sensor as picamera2 gives them to the counts of a frame: unpack, cut out the middle, average areas.

A frame has 8 bits whatever the sensor has: more of them only make the mean over an area finer before it is rounded.
Rows are bytes, padded at their end; unpacked formats of more than 8 bits have two a pixel, the low one first, and
their bits at the low end. Source: libcamera formats R8, R10, R12, R16; picamera2 0.3.38 (`helpers.make_array`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.hardware.raw_mode import RAW_BITS, RawMode


def frame_of_rows(rows: NDArray[np.uint8], mode: RawMode) -> NDArray[np.uint8]:
    """Return the counts [height_px, width_px] of a frame, a copy, from rows [sensor height, stride in bytes]."""
    counts = _cropped(rows if mode.bytes_per_px == 1 else rows.view("<u2"), mode)
    if mode.raw_format == "R8" and mode.crop_px == mode.frame_px:
        return np.array(counts, np.uint8)
    light = np.asarray(counts, np.float32) * np.float32(2.0 ** (8 - RAW_BITS[mode.raw_format]))
    if mode.crop_px != mode.frame_px:
        light = _area_mean(light, mode.frame_px)
    return np.asarray(np.minimum(np.rint(light), 255), np.uint8)


def _cropped(counts: NDArray[np.uint8] | NDArray[np.uint16], mode: RawMode) -> NDArray[np.uint8] | NDArray[np.uint16]:
    (x, y), (width, height) = mode.crop_from_px, mode.crop_px
    return counts[y : y + height, x : x + width]


def _area_mean(light: NDArray[np.float32], size_px: tuple[int, int]) -> NDArray[np.float32]:
    """Return an image of (width, height) pixels, each the mean of the area that it covers."""
    import cv2  # only a camera that scales has to load it

    return np.asarray(cv2.resize(light, size_px, interpolation=cv2.INTER_AREA), np.float32)
