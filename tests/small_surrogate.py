"""Surrogates of a few terms: small enough that what they say of a press is known on paper."""

from __future__ import annotations

import numpy as np

from device.measurement.parameters import HIGH, PARAMETERS
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.radial_profile import COLUMNS
from device.measurement.ramp_modes.surrogate import (
    INCLUSION_COLUMNS,
    OFFSET,
    RESPONSE_COLUMNS,
    WAVES,
    PressSurrogate,
    ScanSurrogate,
    direction_waves,
)

EXACT = ErrorLevels(gain_ratio=0.0, zero_n=0.0, force_n=0.0, flat_field_ratio=0.0, model_ratio=0.0, reference_ratio=0.0)
REACH_MM = 8.0
TURNED_COLUMNS = len(WAVES) * INCLUSION_COLUMNS
CONSTANT = np.zeros((1, len(PARAMETERS)), np.uint8)
"""Degrees of a polynomial of one term."""
UNTURNED = LegendreSum(CONSTANT, np.zeros((1, TURNED_COLUMNS)))
"""Directions of the inclusion change nothing."""


def random_surrogate(seed: int = 3, from_mm: float = 0.0, to_mm: float = float(HIGH[OFFSET])) -> PressSurrogate:
    """Return a surrogate whose terms mix all parameters, of random coefficients."""
    rng = np.random.default_rng(seed)
    degrees = rng.integers(0, 4, (12, len(PARAMETERS))).astype(np.uint8)
    inclusion = LegendreSum(degrees, rng.normal(size=(12, INCLUSION_COLUMNS)))
    baseline = LegendreSum(degrees[:5], rng.normal(size=(5, RESPONSE_COLUMNS)))
    turned_field = LegendreSum(degrees[3:10], rng.normal(size=(7, TURNED_COLUMNS)))
    return PressSurrogate(inclusion, turned_field, baseline, from_mm, to_mm)


def random_scan_surrogate() -> ScanSurrogate:
    """Return one of both parts, near the inclusion and beside it."""
    return ScanSurrogate(random_surrogate(3), random_surrogate(4, float(HIGH[OFFSET]), REACH_MM))


def linear_surrogate(slopes: np.ndarray) -> PressSurrogate:
    """Return a surrogate whose growth is coordinates @ slopes [9, growth columns], and whose inclusions do not show.

    The modulus' slope is by its polynomial coordinate and not by its own: keep it 0 for an exactly linear row.
    """
    none = LegendreSum(CONSTANT, np.zeros((1, INCLUSION_COLUMNS)))
    return PressSurrogate(none, UNTURNED, LegendreSum(np.eye(len(PARAMETERS), dtype=np.uint8), slopes))


class LinearRows:
    """A forward model whose rows are coordinates @ slopes [9, P], at any offset up to `REACH_MM`.

    `along` [P]: what an inclusion that lies along the image's rows adds; one across them takes as much away.
    """

    to_mm = REACH_MM

    def __init__(self, slopes: np.ndarray, along: np.ndarray | None = None) -> None:
        self.slopes = slopes
        self.along = np.zeros(slopes.shape[1]) if along is None else along

    def rows(self, normalised: np.ndarray, direction_rad: np.ndarray | None = None) -> np.ndarray:
        rows = normalised @ self.slopes
        return rows if direction_rad is None else rows + direction_waves(direction_rad)[:, :1] * self.along

    def rows_and_jacobian(
        self, normalised: np.ndarray, direction_rad: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray]:
        return self.rows(normalised, direction_rad), np.tile(self.slopes.T, (len(normalised), 1, 1))


def white_noise(std: float, levels: ErrorLevels = EXACT) -> PressNoise:
    """Return camera noise of one standard deviation in every column, and by default nothing else."""
    return PressNoise(std**2 * np.eye(COLUMNS), levels)
