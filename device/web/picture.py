"""A recording to the picture of its tactile image: mean contrast of the press frames, in true proportions."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np

from device.files.recording_file import read_recording

WIDTH_PX = 480


def tactile_png(folder: Path) -> bytes:
    """Return a PNG of the mean contrast of the press frames; black where the pixel is not valid.

    The colours run from no contrast to the picture's own brightest spot; pixels are made square.
    """
    recording = read_recording(folder)
    images, scale = list(recording.press_images()), recording.camera.scale
    contrast = cv2.GaussianBlur(np.mean([image.contrast for image in images], axis=0), (0, 0), 4)
    valid = images[0].valid
    peak = max(float(contrast[valid].max(initial=0.0)), 1e-6)
    shade = np.clip(contrast / peak * 255, 0, 255).astype(np.uint8)
    colour = cv2.applyColorMap(shade, cv2.COLORMAP_VIRIDIS)
    colour[~valid] = 0
    height_px = round(WIDTH_PX * valid.shape[0] * scale.mm_per_px_y / (valid.shape[1] * scale.mm_per_px_x))
    return cv2.imencode(".png", cv2.resize(colour, (WIDTH_PX, height_px), interpolation=cv2.INTER_AREA))[1].tobytes()
