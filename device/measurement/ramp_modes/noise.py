"""How far a profile row may lie from what the forward model says: camera, hand, drift, and the model's own error.

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

from device.measurement.arrays import Array
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET_COLUMNS, RESPONSE_COLUMNS
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RINGS

Rows = TypeVar("Rows", Array, NDArray[np.float32])
LOADS = len(PROFILE_FORCES_N)
CIRCLE_MM = RING_MM / 24
"""Distance of the circles of which a ring is made."""
FEWEST_ANGLES, ANGLES_A_SHARPNESS = 16, 4.5
"""Angles over half a circle: what they leave of a mean is below 1e-16."""


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
    """`camera` [P, P]: covariance of repeated recordings over the light ratio; `levels` of everything else."""

    camera: Array
    levels: ErrorLevels = ErrorLevels()

    def covariance(self, row: Array) -> Array:
        """Return the covariance [P, P] of a row [P] about the forward model's; it depends on the contrast seen."""
        light = light_ratio(row)
        common = np.stack(drift_directions(row), axis=-1)
        levels = np.array([self.levels.gain_ratio, self.levels.zero_n])
        alike = self.camera + smooth_errors(self.levels)
        return np.asarray((common * levels**2) @ common.T + light[:, None] * light * alike)


def light_ratio(rows: Rows) -> Rows:
    """Return by how much a ratio of the light moves each column of rows [..., P].

    It is 1 + contrast in the contrasts and 1 in the reference response.
    An offset is the first harmonic of the contrast, mean over the loads: what is seen there is the mean light's.
    """
    light = np.ones_like(rows)
    contrast = rows[..., :CONTRAST_COLUMNS]
    light[..., :CONTRAST_COLUMNS] += contrast
    light[..., -OFFSET_COLUMNS:] += contrast.reshape(*rows.shape[:-1], LOADS, RINGS).mean(axis=-2)[..., 1:]
    return light


def drift_directions(rows: Rows) -> tuple[Rows, Rows]:
    """Return what a unit of gain and a newton of zero drift add to rows [..., P], to first order.

    A cell that reads a newton too much looks up the reference light a newton too high: d ln(light) / d force of it,
    which the reference response in the row tells, ring by ring.
    """
    light = light_ratio(rows)
    gain, zero = np.zeros_like(rows), np.zeros_like(rows)
    gain[..., :CONTRAST_COLUMNS] = light[..., :CONTRAST_COLUMNS]
    gain[..., -OFFSET_COLUMNS:] = rows[..., -OFFSET_COLUMNS:]
    below = rows[..., CONTRAST_COLUMNS : CONTRAST_COLUMNS + RESPONSE_COLUMNS]
    log_light = below.reshape(*rows.shape[:-1], LOADS - 1, RINGS)  # over that at the largest force, where it is 0
    slope_per_n = np.einsum("kl,...lj->...kj", _SLOPE_PER_N[:, :-1].astype(rows.dtype), log_light)
    zero[..., :CONTRAST_COLUMNS] = -gain[..., :CONTRAST_COLUMNS] * slope_per_n.reshape(*rows.shape[:-1], -1)
    return gain, zero


def _slope_per_n() -> Array:
    """Return the matrix [K, K] that turns values at the profile's forces into slopes there, by the cubic in ln(F)."""
    powers = np.vander(np.log(PROFILE_FORCES_N), increasing=True)
    degree = np.arange(LOADS)
    of_powers = np.zeros((LOADS, LOADS))
    of_powers[:, 1:] = degree[1:] * powers[:, :-1]
    return np.asarray(of_powers @ np.linalg.inv(powers) / PROFILE_FORCES_N[:, None])


_SLOPE_PER_N = _slope_per_n()


@lru_cache(maxsize=4)
def smooth_errors(levels: ErrorLevels) -> Array:
    """Return the covariance [P, P] of smooth errors of the light, for a light ratio of 1 everywhere."""
    flat, model = smooth_ring_errors(levels, harmonic=0)
    contrast = np.kron(np.ones((LOADS, LOADS)), flat) + np.kron(np.eye(LOADS), model)
    reference_response = np.kron(np.eye(LOADS - 1) + 1, model)
    first_flat, first_model = smooth_ring_errors(levels, harmonic=1)
    first = first_flat + first_model / LOADS
    covariance = np.zeros(2 * (CONTRAST_COLUMNS + RESPONSE_COLUMNS + OFFSET_COLUMNS,))
    a, b = CONTRAST_COLUMNS, CONTRAST_COLUMNS + RESPONSE_COLUMNS
    covariance[:a, :a], covariance[a:b, a:b], covariance[b:, b:] = contrast, reference_response, first[1:, 1:]
    return covariance


@lru_cache(maxsize=4)
def smooth_second_harmonics(levels: ErrorLevels) -> Array:
    """Return the covariance [Q, Q] of smooth errors in the second harmonics of all loads, for a light ratio of 1.

    Without the ring in the middle, which has none, and the outermost one, as in the profile.
    """
    flat, model = smooth_ring_errors(levels, harmonic=2)
    return np.kron(np.ones((LOADS, LOADS)), flat[1:-1, 1:-1]) + np.kron(np.eye(LOADS), model[1:-1, 1:-1])


def smooth_ring_errors(levels: ErrorLevels, *, harmonic: int) -> tuple[Array, Array]:
    """Return the covariances [J, J] of ring means (0) or of a harmonic (1, 2) of one load: flat field, and model."""
    return (
        levels.flat_field_ratio**2 * ring_correlation(levels.flat_field_mm, harmonic=harmonic),
        levels.model_ratio**2 * ring_correlation(levels.model_mm, harmonic=harmonic),
    )


def ring_correlation(length_mm: float, *, harmonic: int) -> Array:
    """Return the covariance [J, J] of soft rings' means (0) or of a harmonic (1, 2) of a smooth field of variance 1.

    The field's correlation is exp(-distance^2 / (2 length^2)). A ring averages circles by their length and its weight:
    neighbours differ by less than circles of their radii would, the innermost ones by more.
    """
    r: Array = CIRCLE_MM * (np.arange(round(RINGS * RING_MM / CIRCLE_MM), dtype=np.float64) + 0.5)
    of_circle = np.maximum(1 - np.abs(r - RING_RADII_MM[:, None]) / RING_MM, 0) * r
    of_circle /= of_circle.sum(axis=1, keepdims=True)
    return np.asarray(of_circle @ circle_correlation(r, length_mm, harmonic=harmonic) @ of_circle.T)


def circle_correlation(r_mm: Array, length_mm: float, *, harmonic: int) -> Array:
    """Return the same [n, n] of circles of radii [n]: the mean of the correlation over the angle between two points.

    It is a modified Bessel function; equal angles find such a mean to the last digit once they resolve its peak
    (Trefethen & Weideman, SIAM Review 56, 2014, section 5: the error falls like exp(-angles^2 / 2 / sharpness)).
    """
    sharpness = np.outer(r_mm, r_mm) / length_mm**2
    angle = np.linspace(0, np.pi, FEWEST_ANGLES + int(ANGLES_A_SHARPNESS * np.sqrt(sharpness.max())))
    weight = np.cos(harmonic * angle) * (1 if harmonic == 0 else 2) / (len(angle) - 1)
    weight[[0, -1]] /= 2  # both ends of half a circle, of whose other half nothing differs
    mean = np.zeros_like(sharpness)
    for of_angle, cosine in zip(weight, np.cos(angle), strict=True):
        mean += of_angle * np.exp(sharpness * (cosine - 1))
    return np.asarray(mean * np.exp(-((r_mm[:, None] - r_mm) ** 2) / (2 * length_mm**2)))
