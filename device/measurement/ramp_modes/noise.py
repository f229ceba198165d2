"""How far a profile row may lie from what the forward model says: camera, hand, drift, and the model's own error.

Camera, cell and hand are measured on simulated recordings. Light that drifts between the two presses moves every
pixel's contrast by the same ratio of 1 + contrast; a cell whose zero drifts moves the loads most at the small ones. A
smooth error common to all loads stands for the flat field, one of each load for the model: smooth errors cost more
than all camera noise, because no number of pixels takes them out. Source: Kennedy & O'Hagan, J. R. Stat. Soc. B 63
(2001), on model error as a Gaussian process; docs/accuracy.md on what each costs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from device.measurement.arrays import Array
from device.measurement.ramp_modes.radial_profile import (
    COLUMNS,
    CONTRAST,
    FIRST,
    PROFILE_FORCES_N,
    RESPONSE,
    SECOND,
    Rows,
)
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RINGS

LOADS = len(PROFILE_FORCES_N)
FURTHER = np.setdiff1d(np.arange(COLUMNS), np.arange(RESPONSE.start, RESPONSE.stop))
"""Columns of a further press of a scan: contrast and harmonics; its reference is that of the first."""
MOST_SHARED = 0.9
"""Of what no other column tells; each press keeps some of its own."""
CIRCLE_MM = RING_MM / 24
"""Distance of the circles of which a ring is made."""
FEWEST_ANGLES, ANGLES_A_SHARPNESS = 16, 4.5
"""Angles over half a circle: what they leave of a mean is below 1e-16."""


@dataclass(frozen=True)
class ErrorLevels:
    """Standard deviations: light between the presses, zero of the cell between them, smooth errors of the image.

    `force_n` is that of each of the profile's forces by itself, of cell and tremor.

    `reference_ratio` of the camera's variance of a contrast is the reference press's, which a scan's presses share.
    Both smooth errors are ratios of the light, correlated over `flat_field_mm` and `model_mm`. Presses with one
    reference share a part of the variance of each: all of a flat field that is the face's, but not the texture of the
    skin that lies under each alone.
    """

    gain_ratio: float = 0.01
    zero_n: float = 0.001
    force_n: float = 0.0005
    flat_field_ratio: float = 0.002
    flat_field_mm: float = 2.0
    flat_field_shared_ratio: float = 1.0
    model_ratio: float = 0.002
    model_mm: float = 3.0
    model_shared_ratio: float = 0.5
    reference_ratio: float = 0.5

    def on_coarser_skin(self, times: float) -> ErrorLevels:
        """Return the levels where the skin's texture is so many times as large, and the flat field of the face is not.

        Of a texture half is each press's own, so twice what presses do not share is the skin's.
        """
        of_skin = 2 * (1 - self.flat_field_shared_ratio)
        grown = 1 + of_skin * (times**2 - 1)
        return replace(
            self,
            flat_field_ratio=self.flat_field_ratio * grown**0.5,
            flat_field_shared_ratio=1 - of_skin * times**2 / grown / 2,
        )


@dataclass(frozen=True, eq=False)
class PressNoise:
    """`camera` [P, P]: covariance of repeated recordings over the light ratio; `levels` of drift and smooth errors.

    `forward` [P, P]: what the forward model's polynomials miss of presses kept apart and its tables of inclusions
    solved anew, over the light ratio, for a root mean square contrast of 1; it grows with that contrast. None: nothing.
    """

    camera: Array
    levels: ErrorLevels = ErrorLevels()
    forward: Array | None = None

    def covariance(self, row: Array) -> Array:
        """Return the covariance [P, P] of a row [P] about the forward model's; it depends on the contrast seen."""
        light = light_ratio(row)
        gain, zero = drift_directions(row)
        common = np.column_stack([gain, zero, harmonics_by_force(zero)])
        levels = np.array([self.levels.gain_ratio, self.levels.zero_n, *[self.levels.force_n] * LOADS])
        alike = self.camera + smooth_errors(self.levels)
        if self.forward is not None:
            alike = alike + rms_contrast(row) * self.forward
        return np.asarray((common * levels**2) @ common.T + light[:, None] * light * alike)

    def scan_covariance(self, rows: Array) -> Array:
        """Return the covariance [S, S] of the presses of a scan, rows [N, P], in the order of `as_one_row`.

        Each press has gain, zero and parts of both smooth errors of its own. All share the reference press and the rest
        of both.
        """
        columns = [np.arange(rows.shape[1]), *[FURTHER] * (len(rows) - 1)]
        light, shared = light_ratio(rows), self._shared_by_presses
        blocks = [
            [
                self.covariance(rows[k])[np.ix_(columns[k], columns[k])]
                if k == other
                else (light[k][:, None] * light[other] * shared)[np.ix_(columns[k], columns[other])]
                for other in range(len(rows))
            ]
            for k in range(len(rows))
        ]
        return np.block(blocks)

    def further_covariance(self, rows: Array, row: Array) -> tuple[Array, Array]:
        """Return what `scan_covariance` has of a further row [P]: with rows [N, P] [S, Q], and its own [Q, Q]."""
        shared = light_ratio(rows)[:, :, None] * light_ratio(row) * self._shared_by_presses
        with_first, with_others = shared[0, :, FURTHER].T, shared[1:, FURTHER][:, :, FURTHER]
        own = self.covariance(row)[np.ix_(FURTHER, FURTHER)]
        return np.concatenate([with_first, with_others.reshape(-1, len(FURTHER))]), own

    @cached_property
    def _shared_by_presses(self) -> Array:
        """Covariance [P, P] of what two presses with one reference share, for a light ratio of 1 everywhere.

        Of the camera's noise that is what the reference press makes: half, for it has as many frames in the same light,
        of which the reference force response tells a part. Harmonics are taken along each press's own direction:
        between two of them nothing else is known.
        """
        told = np.linalg.solve(self.camera[RESPONSE, RESPONSE], self.camera[RESPONSE])
        shared = self.camera[:, RESPONSE] @ told
        alone = np.linalg.inv(np.linalg.inv(self.camera)[CONTRAST, CONTRAST])  # what no other column tells
        of_reference = self.levels.reference_ratio * np.diag(self.camera)[CONTRAST] - np.diag(shared)[CONTRAST]
        shared[CONTRAST, CONTRAST] += np.clip(np.mean(of_reference / np.diag(alone)), 0, MOST_SHARED) * alone
        flat, model = smooth_ring_errors(self.levels, harmonic=0)
        shared[CONTRAST, CONTRAST] += self.levels.flat_field_shared_ratio * np.kron(np.ones((LOADS, LOADS)), flat)
        shared[CONTRAST, CONTRAST] += self.levels.model_shared_ratio * np.kron(np.eye(LOADS), model)
        return shared


def as_one_row(rows: Array) -> Array:
    """Return the presses of a scan, rows [N, P], as one row [S]: their reference force response is the same."""
    return np.concatenate([rows[0], rows[1:, FURTHER].ravel()])


def light_ratio(rows: Rows) -> Rows:
    """Return by how much a ratio of the light moves each column of rows [..., P].

    It is 1 + contrast of ring and force, also for harmonics, and 1 in the reference response.
    """
    light = np.ones_like(rows)
    contrast = rows[..., CONTRAST].reshape(*rows.shape[:-1], LOADS, RINGS)
    light[..., CONTRAST] += rows[..., CONTRAST]
    light[..., FIRST] += contrast[..., 1:].reshape(*rows.shape[:-1], -1)
    light[..., SECOND] += contrast[..., 1:-1].reshape(*rows.shape[:-1], -1)
    return light


def rms_contrast(rows: Rows) -> Rows:
    """Return the root mean square contrast [...] of rows [..., P]."""
    root: Rows = np.sqrt((rows[..., CONTRAST] ** 2).mean(axis=-1))
    return root


def drift_directions(rows: Rows) -> tuple[Rows, Rows]:
    """Return what a unit of gain and a newton of zero drift add to rows [..., P], to first order.

    A cell that reads a newton too much looks up the reference light a newton too high: d ln(light) / d force of it,
    which the reference response in the row tells, ring by ring.
    """
    gain, zero = np.zeros_like(rows), np.zeros_like(rows)
    gain[..., CONTRAST] = 1 + rows[..., CONTRAST]
    gain[..., FIRST], gain[..., SECOND] = rows[..., FIRST], rows[..., SECOND]
    below = rows[..., RESPONSE]
    log_light = below.reshape(*rows.shape[:-1], LOADS - 1, RINGS)  # over that at the largest force, where it is 0
    slope_per_n = np.einsum("kl,...lj->...kj", _SLOPE_PER_N[:, :-1].astype(rows.dtype), log_light)
    for columns, rings in ((CONTRAST, slice(None)), (FIRST, slice(1, None)), (SECOND, slice(1, -1))):
        of_rings = slope_per_n[..., rings].reshape(*rows.shape[:-1], -1)
        zero[..., columns] = -gain[..., columns] * of_rings
    return gain, zero


def harmonics_by_force(zero: Rows) -> Rows:
    """Return the harmonics' part of a zero's drift [..., P] force by force [..., P, K], each alone.

    A force that is read wrong by itself moves that force's harmonics in proportion to what they are. The camera's
    covariance holds what it does to the contrast, which is alike in all presses.
    """
    apart = np.zeros((*zero.shape, LOADS), dtype=zero.dtype)
    for columns in (FIRST, SECOND):
        rings = (columns.stop - columns.start) // LOADS
        for force in range(LOADS):
            own = slice(columns.start + force * rings, columns.start + (force + 1) * rings)
            apart[..., own, force] = zero[..., own]
    return apart


def _slope_per_n() -> Array:
    """Return the matrix [K, K] that turns values at the profile's forces into slopes there, by the cubic in ln(F)."""
    powers = np.vander(np.log(PROFILE_FORCES_N), increasing=True)
    degree = np.arange(LOADS)
    of_powers = np.zeros((LOADS, LOADS))
    of_powers[:, 1:] = degree[1:] * powers[:, :-1]
    return np.asarray(of_powers @ np.linalg.inv(powers) / PROFILE_FORCES_N[:, None])


_SLOPE_PER_N = _slope_per_n()


@lru_cache(maxsize=8)
def smooth_errors(levels: ErrorLevels) -> Array:
    """Return the covariance [P, P] of smooth errors of the light, for a light ratio of 1 everywhere."""
    covariance = np.zeros((COLUMNS, COLUMNS))
    for order, columns in enumerate((CONTRAST, FIRST, SECOND)):
        flat, model = smooth_ring_errors(levels, harmonic=order)
        rings = (slice(None), slice(1, None), slice(1, -1))[order]
        covariance[columns, columns] = np.kron(np.ones((LOADS, LOADS)), flat[rings, rings])
        covariance[columns, columns] += np.kron(np.eye(LOADS), model[rings, rings])
    _, model = smooth_ring_errors(levels, harmonic=0)
    covariance[RESPONSE, RESPONSE] = np.kron(np.eye(LOADS - 1) + 1, model)
    return covariance


def smooth_ring_errors(levels: ErrorLevels, *, harmonic: int) -> tuple[Array, Array]:
    """Return the covariances [J, J] of ring means (0) or of a harmonic (1, 2) of one load: flat field, and model."""
    return (
        levels.flat_field_ratio**2 * ring_correlation(levels.flat_field_mm, harmonic=harmonic),
        levels.model_ratio**2 * ring_correlation(levels.model_mm, harmonic=harmonic),
    )


@lru_cache(maxsize=64)  # 30 ms each on a workstation, of a few lengths that every press and step of a training has
def ring_correlation(length_mm: float, *, harmonic: int) -> Array:
    """Return the covariance [J, J] of soft rings' means (0) or of a harmonic (1, 2) of a smooth field of variance 1.

    It is kept, and cannot be written to.
    The field's correlation is exp(-distance^2 / (2 length^2)). A ring averages circles by their length and its weight:
    neighbours differ by less than circles of their radii would, the innermost ones by more.
    """
    r: Array = CIRCLE_MM * (np.arange(round(RINGS * RING_MM / CIRCLE_MM), dtype=np.float64) + 0.5)
    of_circle = np.maximum(1 - np.abs(r - RING_RADII_MM[:, None]) / RING_MM, 0) * r
    of_circle /= of_circle.sum(axis=1, keepdims=True)
    of_rings = np.asarray(of_circle @ circle_correlation(r, length_mm, harmonic=harmonic) @ of_circle.T)
    of_rings.flags.writeable = False
    return of_rings


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
