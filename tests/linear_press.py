"""A press whose forward model is linear, so that its posterior is known on paper; the modulus shows in nothing."""

from __future__ import annotations

import numpy as np
from small_surrogate import COLUMNS, linear_surrogate, white_noise

from device.measurement.parameters import PARAMETERS
from device.measurement.ramp_modes.radial_profile import RESPONSE as RESPONSE
from device.measurement.ramp_modes.surrogate import MODULUS, RESPONSE_COLUMNS

STD = 0.05
NOISE = white_noise(STD)
TOLD = np.arange(len(PARAMETERS)) != MODULUS
"""The modulus' slope is 0."""
TRUTH = np.array([0.2, -0.3, 0.4, 0.1, -0.2, 0.3, 0.0, -0.1, 0.25])
START = np.zeros(len(PARAMETERS))


def random_slopes() -> np.ndarray:
    """Return the slopes [9, growth columns] of a row by the coordinates."""
    slopes = np.random.default_rng(5).normal(0.0, 0.15, (len(PARAMETERS), RESPONSE_COLUMNS))
    slopes[MODULUS] = 0.0
    return slopes


def noisy_row(slopes: np.ndarray) -> np.ndarray:
    """Return the row [P] of `TRUTH` with noise."""
    return linear_surrogate(slopes).rows(TRUTH[None])[0] + np.random.default_rng(6).normal(0, STD, COLUMNS)


def on_paper(row: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and covariance of the posterior of what a row tells of; the ends of the ranges are far away."""
    covariance = STD**2 * np.linalg.inv(slopes[TOLD] @ slopes[TOLD].T)
    return covariance @ slopes[TOLD] @ row[RESPONSE] / STD**2, covariance
