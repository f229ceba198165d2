"""What drifts between a reference press and the press on the lesion, put into a recording of the simulated probe.

The LEDs' brightness, the cell's zero, and two smooth errors of the light: one that all press frames share (a flat field
that has moved), and one of the reference that changes with the force (a forward model that is not the truth). As
`press_noise.ErrorLevels` says and the estimates believe in; whether they rightly do is measured on such recordings.
"""

from __future__ import annotations

from dataclasses import replace

import cv2
import numpy as np
from numpy.typing import NDArray

from device.measurement.pixel_scale import PixelScale
from device.measurement.press_noise import ErrorLevels
from device.measurement.press_profile import PROFILE_FORCES_N
from device.measurement.recording import Recording
from device.measurement.tactile_image import Frame, Image

DRIFTING = "reference", "press"
BELOW_ONE = 0.99
"""Parts of a count are less than one also after single precision has rounded their sum."""
GRID_MM = 0.5
"""Smooth errors are drawn on a grid this fine, far finer than they vary, and interpolated to the pixels."""


def drifted(recording: Recording, rng: np.random.Generator, levels: ErrorLevels) -> Recording:
    """Return the recording with errors of the light above dark, and of the force that the cell reports on the lesion.

    Counts are rounded up or down at random, for errors of a part of a count would be lost otherwise.
    """
    scale, shape = recording.camera.scale, recording.frames[0].counts.shape
    gain, zero_n = levels.gain_ratio * rng.standard_normal(), levels.zero_n * rng.standard_normal()
    shared = gain + levels.flat_field_ratio * smooth_field(shape, scale, levels.flat_field_mm, rng)
    of_force = [levels.model_ratio * smooth_field(shape, scale, levels.model_mm, rng) for _ in PROFILE_FORCES_N]
    dark = np.mean([frame.counts for frame in recording.with_role("dark")], axis=0, dtype=np.float32)

    top = 255 if recording.camera.bits == 8 else 65535

    def error_of(frame: Frame) -> Image:
        if frame.role == "press":
            return np.asarray(shared)
        weights = _cubic_weights(frame.force_n)
        return np.asarray(sum(np.float32(w) * field for w, field in zip(weights, of_force, strict=True)))

    def with_errors(frame: Frame) -> Frame:
        if frame.role not in DRIFTING:
            return frame
        part = np.float32(BELOW_ONE) * rng.random(shape, dtype=np.float32)
        clipped = np.clip(np.floor(frame.counts + (frame.counts - dark) * error_of(frame) + part), 0, top)
        whole = clipped.astype(np.uint8) if top == 255 else clipped.astype(np.uint16)
        drift_n = zero_n if frame.role == "press" else 0.0
        return replace(frame, counts=whole, force_n=frame.force_n + drift_n)

    return replace(recording, frames=tuple(map(with_errors, recording.frames)))


def smooth_field(shape: tuple[int, int], scale: PixelScale, length_mm: float, rng: np.random.Generator) -> Image:
    """Return a random field [height, width] of variance 1 and correlation exp(-distance^2 / (2 length^2)).

    White noise smoothed by a Gaussian of standard deviation length / sqrt(2).
    """
    height, width = shape
    face_mm = np.array([width * scale.mm_per_px_x, height * scale.mm_per_px_y])
    nodes = np.round(face_mm / GRID_MM).astype(int) + 2
    sigma_x, sigma_y = length_mm / np.sqrt(2) * nodes / face_mm
    margin = int(np.ceil(4 * max(sigma_x, sigma_y)))
    white = rng.standard_normal((nodes[1] + 2 * margin, nodes[0] + 2 * margin)).astype(np.float32)
    smooth = cv2.GaussianBlur(white, (0, 0), sigma_x, sigmaY=sigma_y)[margin:-margin, margin:-margin]
    unit = smooth * np.float32(2 * np.sqrt(np.pi * sigma_x * sigma_y))
    return np.asarray(cv2.resize(unit, (width, height), interpolation=cv2.INTER_CUBIC), dtype=np.float32)


def _cubic_weights(force_n: float) -> NDArray[np.float64]:
    """Return the weights [K] of fields at the profile's forces: the cubic in the force through all of them."""
    powers = np.vander(PROFILE_FORCES_N, increasing=True)
    at = np.clip(force_n, PROFILE_FORCES_N[0], PROFILE_FORCES_N[-1]) ** np.arange(len(PROFILE_FORCES_N))
    return np.asarray(np.linalg.solve(powers.T, at))
