"""The frame of a ramp that is unlike what all others say of its force: a flash, a bubble, a slip. Or none.

No two frames of a ramp are alike, but the light of each block of the face follows the force smoothly, as a cubic to
3.5 % for any lump of the trained ranges (tests/device/instrument/test_ramp_outliers.py), and exactly for light that no
force changes: gel is no outlier, but a fault of its own. A frame stands out by how far it lies from the cubic of the
others. As in a hold, errors are weighted by the power of the force that contact follows.
Source: externally studentised residuals, Cook & Weisberg, Residuals and Influence in Regression (1982), section 2.2.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.instrument.outlier_frames import DEVIATION_RATIO, ROBUST_SIGMAS, Outlier, light_at_one_force
from device.measurement.reference_light import EXPONENT
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
    force_n = np.array([frame.force_n for frame in frames])
    powers = np.vander(force_n - force_n.mean(), DEGREE + 1) / force_n[:, None] ** EXPONENT
    basis, _ = np.linalg.qr(powers)
    free = np.maximum(1 - np.sum(basis**2, axis=1), 1e-9)  # a frame's leverage leaves so much of its error to be seen
    squares = np.mean((light - basis @ (basis.T @ light)) ** 2, axis=1) / level**2
    worst = int(np.argmax(squares / free))
    deviation = float(np.sqrt(squares[worst]) / free[worst])
    left = max(float(np.sum(squares) - squares[worst] / free[worst]), 0.0)
    sigma = np.sqrt(left / (len(frames) - DEGREE - 2))
    if deviation <= max(ROBUST_SIGMAS * sigma, DEVIATION_RATIO):
        return None
    return Outlier(frames[worst], deviation)
