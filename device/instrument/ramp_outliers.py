"""The frame of a ramp that is unlike what all others say of its force: a flash, a bubble, a slip. Or none.

No two frames of a ramp are alike, but the light of each block of the face follows the force smoothly: brought to one
force it is a cubic in the root of the force, to 3 % for any lump of the trained ranges
(tests/device/instrument/test_ramp_outliers.py). A frame stands out by how far it lies from the cubic of the others.
Source: externally studentised residuals, Cook & Weisberg, Residuals and Influence in Regression (1982), section 2.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.instrument.outlier_frames import DEVIATION_RATIO, ROBUST_SIGMAS, Outlier, light_at_one_force
from device.measurement.tactile_image import Frame

DEGREE = 3
FEWEST_FRAMES = 8
"""Fewer leave too little beside the four coefficients to tell a frame from the course of the others."""


def ramp_outlier(frames: Sequence[Frame], dark_counts: float) -> Outlier | None:
    """Return the frame that lies furthest from the others' course, by more than sigmas and `DEVIATION_RATIO` allow.

    `dark_counts` is the mean of a frame without light. Frames of one light at forces (N) above 0 that differ.
    """
    if len(frames) < FEWEST_FRAMES:
        return None
    light = np.array([light_at_one_force(frame, dark_counts).ravel() for frame in frames])
    level = float(np.mean(light))
    if level <= 0.0:
        return None
    root = np.sqrt([frame.force_n for frame in frames])
    basis, _ = np.linalg.qr(np.vander(root - root.mean(), DEGREE + 1))
    free = np.maximum(1 - np.sum(basis**2, axis=1), 1e-9)  # a frame's leverage leaves so much of its error to be seen
    squares = np.mean((light - basis @ (basis.T @ light)) ** 2, axis=1) / level**2
    worst = int(np.argmax(squares / free))
    deviation = float(np.sqrt(squares[worst]) / free[worst])
    left = max(float(np.sum(squares) - squares[worst] / free[worst]), 0.0)
    sigma = np.sqrt(left / (len(frames) - DEGREE - 2))
    if deviation <= max(ROBUST_SIGMAS * sigma, DEVIATION_RATIO):
        return None
    return Outlier(frames[worst], deviation)
