"""A press to the picture of its tactile image: mean contrast of the press frames, in true proportions.

It is made once, with the measurement, of frames that are binned as the estimates of modes quick, standard and precise
bin them: light spreads further in the skin than a binned pixel is wide.
"""

from __future__ import annotations

import struct
import zlib
from pathlib import Path

import cv2
import numpy as np

from device.files.recording_file import read_picture, read_recording
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.radial_profile import FLOOR_COUNTS, contrast_and_valid
from device.measurement.recording.frame_light import lights_of
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import REPAIR, Recording
from device.measurement.recording.reference_light import Image, reference_light
from device.measurement.recording.tactile_image import FULL_CONTRAST

WIDTH_PX = 480
PNG_HEADER = 33
"""Bytes of a PNG's signature and IHDR."""
SMOOTHED_PX = 1.0
"""Standard deviation, in binned pixels, that takes the camera's noise out of the picture."""


def tactile_png(recording: Recording) -> bytes:
    """Return a PNG of the mean contrast of the press frames; black where a pixel is not valid.

    The colours run from no contrast to `FULL_CONTRAST`, so that two pictures can be compared; pixels are made square.
    The file says both: pixels per metre (pHYs) and `full_contrast` (tEXt). Raises `InvalidQuantity`
    without dark frames, touched reference frames or press frames.
    """
    reference, press = lights_of(recording)
    for name, lights in (("touched reference", reference), ("press", press)):
        if not len(lights.force_n):
            raise InvalidQuantity(f"{name} frames", 0, "at least one", REPAIR)
    light = reference_light(list(reference.force_n), list(reference.images), FLOOR_COUNTS)
    total, valid = np.zeros_like(press.images[0]), np.ones(press.images[0].shape, dtype=bool)
    for force_n, image in zip(press.force_n, press.images, strict=True):
        contrast, is_valid = contrast_and_valid(image, light, float(force_n))
        total += contrast
        valid &= is_valid
    return _png(total / np.float32(len(press.images)), valid, press.scale)


def _png(contrast: Image, valid: np.ndarray, scale: PixelScale) -> bytes:
    smooth = cv2.GaussianBlur(contrast, (0, 0), SMOOTHED_PX)
    height, width = valid.shape
    size = WIDTH_PX, round(WIDTH_PX * height * scale.mm_per_px_y / (width * scale.mm_per_px_x))
    large = cv2.resize(smooth, size, interpolation=cv2.INTER_LINEAR)
    colour = cv2.applyColorMap(np.clip(large / FULL_CONTRAST * 255, 0, 255).astype(np.uint8), cv2.COLORMAP_VIRIDIS)
    colour[cv2.resize(valid.astype(np.uint8), size, interpolation=cv2.INTER_NEAREST) == 0] = 0
    mm_per_px = width * scale.mm_per_px_x / WIDTH_PX
    return _with_scale(cv2.imencode(".png", colour)[1].tobytes(), mm_per_px)


def _with_scale(png: bytes, mm_per_px: float) -> bytes:
    """Return a PNG that says how large its pixels are (mm) and what its brightest colour means.

    Source: PNG 1.2, 4.2.4.2 pHYs and 4.2.3.1 tEXt; both stand between the header and the first data.
    """
    per_metre = round(1000 / mm_per_px)
    scale = _chunk(b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1))
    text = _chunk(b"tEXt", b"full_contrast\0" + f"{FULL_CONTRAST:g}".encode())
    return png[:PNG_HEADER] + scale + text + png[PNG_HEADER:]


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def kept_or_drawn(path: Path) -> bytes:
    """Return the picture that lies in a kept recording; it is drawn anew where an earlier release kept none."""
    return read_picture(path) or tactile_png(read_recording(path))
