"""How far a profile row may lie from what the forward model says: camera and hand, drift of light and cell, and error
of the model itself.

Camera, cell and hand are measured on simulated recordings. Light that drifts between the two presses moves every
pixel's contrast by the same ratio of 1 + contrast; a cell whose zero drifts moves the loads most at the small ones. A
smooth error common to all loads stands for the flat field, one of each load for the model: smooth errors cost more
than all camera noise, because no number of pixels takes them out. Source: Kennedy & O'Hagan, J. R. Stat. Soc. B 63
(2001), on model error as a Gaussian process; docs/accuracy.md on what each costs.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.special import ive

from device.measurement.press_profile import PROFILE_FORCES_N
from device.measurement.press_surrogate import CONTRAST_COLUMNS, GROWTH_COLUMNS, OFFSET_COLUMNS
from device.measurement.reference_light import EXPONENT
from device.measurement.ring_means import RING_RADII_MM, RINGS

Array = NDArray[np.float64]
Rows = TypeVar("Rows", Array, NDArray[np.float32])
LOADS = len(PROFILE_FORCES_N)


@dataclass(frozen=True)
class ErrorLevels:
    """Standard deviations: light between the presses, zero of the cell between them, smooth errors of the image.

    Both smooth errors are ratios of the light, correlated over `flat_field_mm` and `model_mm`.
    """

    gain_ratio: float = 0.01
    zero_n: float = 0.001
    flat_field_ratio: float = 0.002
    flat_field_mm: float = 2.0
    model_ratio: float = 0.002
    model_mm: float = 3.0


@dataclass(frozen=True, eq=False)
class PressNoise:
    """`camera` [P, P]: covariance of rows over repeated recordings; `levels` of everything else."""

    camera: Array
    levels: ErrorLevels = ErrorLevels()

    def covariance(self, row: Array) -> Array:
        """Return the covariance [P, P] of a row [P] about the forward model's; it depends on the contrast seen."""
        light = light_ratio(row)
        common = drift_directions(light)
        levels = np.array([self.levels.gain_ratio, self.levels.zero_n])
        return np.asarray(
            self.camera + (common * levels**2) @ common.T + light[:, None] * light * smooth_errors(self.levels)
        )


def light_ratio(rows: Rows) -> Rows:
    """Return by how much a ratio of the light moves each column of rows [..., P]: 1 + contrast there, 1 elsewhere."""
    light = np.ones_like(rows)
    light[..., :CONTRAST_COLUMNS] += rows[..., :CONTRAST_COLUMNS]
    return light


def drift_directions(light: Array) -> Array:
    """Return what a unit of gain and a newton of zero drift add to a row [P, 2], to first order."""
    gain, zero = np.zeros(len(light)), np.zeros(len(light))
    gain[:CONTRAST_COLUMNS] = light[:CONTRAST_COLUMNS]
    growth = EXPONENT / PROFILE_FORCES_N
    zero[:CONTRAST_COLUMNS] = light[:CONTRAST_COLUMNS] * np.repeat(growth, RINGS)
    return np.column_stack([gain, zero])


@lru_cache(maxsize=4)
def smooth_errors(levels: ErrorLevels) -> Array:
    """Return the covariance [P, P] of smooth errors of the light, for a light ratio of 1 everywhere."""
    flat, model = (
        ratio**2 * ring_correlation(length_mm, harmonic=0)
        for ratio, length_mm in ((levels.flat_field_ratio, levels.flat_field_mm), (levels.model_ratio, levels.model_mm))
    )
    contrast = np.kron(np.ones((LOADS, LOADS)), flat) + np.kron(np.eye(LOADS), model)
    growth = np.kron(np.eye(LOADS - 1) + 1, model)
    first = levels.flat_field_ratio**2 * ring_correlation(levels.flat_field_mm, harmonic=1)
    first += levels.model_ratio**2 / LOADS * ring_correlation(levels.model_mm, harmonic=1)
    covariance = np.zeros(2 * (CONTRAST_COLUMNS + GROWTH_COLUMNS + OFFSET_COLUMNS,))
    a, b = CONTRAST_COLUMNS, CONTRAST_COLUMNS + GROWTH_COLUMNS
    covariance[:a, :a], covariance[a:b, a:b], covariance[b:, b:] = contrast, growth, first[1:, 1:]
    return covariance


def ring_correlation(length_mm: float, *, harmonic: int) -> Array:
    """Return the correlation [J, J] of ring means (0) or first harmonics (1) of a smooth random field of variance 1.

    The field's correlation is exp(-distance^2 / (2 length^2)); over the angle it averages to a Bessel function.
    """
    r = RING_RADII_MM
    mean = ive(harmonic, np.outer(r, r) / length_mm**2) * np.exp(-((r[:, None] - r) ** 2) / (2 * length_mm**2))
    return np.asarray(mean * (1 if harmonic == 0 else 2))
