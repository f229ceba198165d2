"""Surrogates of a few terms: small enough that what they say of a press is known on paper."""

from __future__ import annotations

import numpy as np

from device.measurement.parameters import PARAMETERS
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET_COLUMNS, RESPONSE_COLUMNS, PressSurrogate

INCLUSION_COLUMNS = CONTRAST_COLUMNS + OFFSET_COLUMNS
COLUMNS = INCLUSION_COLUMNS + RESPONSE_COLUMNS
EXACT = ErrorLevels(gain_ratio=0.0, zero_n=0.0, flat_field_ratio=0.0, model_ratio=0.0)


def random_surrogate(seed: int = 3) -> PressSurrogate:
    """Return a surrogate whose terms mix all parameters, of random coefficients."""
    rng = np.random.default_rng(seed)
    degrees = rng.integers(0, 4, (12, len(PARAMETERS))).astype(np.uint8)
    inclusion = LegendreSum(degrees, rng.normal(size=(12, INCLUSION_COLUMNS)))
    return PressSurrogate(inclusion, LegendreSum(degrees[:5], rng.normal(size=(5, RESPONSE_COLUMNS))))


def linear_surrogate(slopes: np.ndarray) -> PressSurrogate:
    """Return a surrogate whose growth is coordinates @ slopes [9, growth columns], and whose inclusions do not show.

    The modulus' slope is by its polynomial coordinate and not by its own: keep it 0 for an exactly linear row.
    """
    none = LegendreSum(np.zeros((1, len(PARAMETERS)), np.uint8), np.zeros((1, INCLUSION_COLUMNS)))
    return PressSurrogate(none, LegendreSum(np.eye(len(PARAMETERS), dtype=np.uint8), slopes))


def white_noise(std: float, levels: ErrorLevels = EXACT) -> PressNoise:
    """Return camera noise of one standard deviation in every column, and by default nothing else."""
    return PressNoise(std**2 * np.eye(COLUMNS), levels)
