"""Endless random presses for training: the surrogate's rows, each time with noise of its own.

Source of the noise: `device/measurement/ramp_modes/noise.py`, the very covariance that the fit believes in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array, Single
from device.measurement.parameters import HIGH, LOW, normalise
from device.measurement.ramp_modes.noise import (
    FURTHER,
    LOADS,
    PressNoise,
    drift_directions,
    harmonics_by_force,
    light_ratio,
    rms_contrast,
    smooth_errors,
)
from device.measurement.ramp_modes.radial_profile import RESPONSE, network_rows
from device.measurement.ramp_modes.surrogate import OFFSET, PressRows
from host_tools.press_models.press_samples import draw_parameters

Index = NDArray[np.int64]

BLOCK = 4000


class Presses(Protocol):
    """What networks learn from: coordinates [n, 9] and rows [n, P] of presses, and how noise is added to them."""

    @property
    def normalised(self) -> Single:
        """Coordinates [n, 9]."""

    @property
    def rows(self) -> Single:
        """Noise-free rows [n, P]."""

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, P] of an index [m], with fresh noise."""

    def typical_noise(self) -> Array:
        """Return the covariance [P, P] of the noise of a mean row."""


@dataclass(frozen=True, eq=False)
class PressSet:
    """Coordinates [n, 9], noise-free rows [n, P] and directions [n] of random presses, and their noise."""

    normalised: Single
    rows: Single
    direction_rad: Array
    sampler: NoiseSampler

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, P] of an index [m], with fresh noise."""
        return self.sampler.add(self.rows[index], rng)

    def typical_noise(self) -> Array:
        """Return the covariance [P, P] of the noise of a mean row."""
        return self.sampler.noise.covariance(self.rows.mean(axis=0).astype(np.float64))


@dataclass(frozen=True, eq=False)
class NetworkPresses:
    """Random presses as networks read them: `Presses` whose rows are those of `network_rows`."""

    presses: PressSet

    @property
    def normalised(self) -> Single:
        """Coordinates [n, 9]."""
        return self.presses.normalised

    @property
    def rows(self) -> Single:
        """Noise-free rows [n, F]."""
        return network_rows(self.presses.rows)

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, F] of an index [m], with fresh noise."""
        return network_rows(self.presses.noisy(index, rng))

    def typical_noise(self) -> Array:
        """Return the covariance [F, F] of the noise of a mean row."""
        read: Array = network_rows(np.eye(self.presses.rows.shape[1]))
        return np.asarray(read.T @ self.presses.typical_noise() @ read)


class NoiseSampler:
    """Draws noise that is distributed as `PressNoise.covariance` says."""

    def __init__(self, noise: PressNoise) -> None:
        columns = len(noise.camera)
        smooth = smooth_errors(noise.levels) + 1e-14 * np.eye(columns)
        camera, flat = (np.linalg.cholesky(part).T.astype(np.float32) for part in (noise.camera, smooth))
        self.noise, self._camera, self._smooth = noise, camera, flat
        self._forward = None if noise.forward is None else np.linalg.cholesky(noise.forward).T.astype(np.float32)

    def add(self, rows: Single, rng: np.random.Generator) -> Single:
        """Return rows [n, P] with camera noise, drift of light and cell, and smooth errors."""
        camera, smooth = rng.standard_normal((2, *rows.shape), dtype=np.float32)
        gain, zero_n = rng.standard_normal((2, len(rows), 1), dtype=np.float32)
        by_gain, by_zero = drift_directions(rows)
        noisy = rows + light_ratio(rows) * (camera @ self._camera + smooth @ self._smooth)
        if self._forward is not None:
            missed = rng.standard_normal(rows.shape, dtype=np.float32) @ self._forward
            noisy += light_ratio(rows) * np.sqrt(rms_contrast(rows))[:, None] * missed
        noisy += np.float32(self.noise.levels.gain_ratio) * gain * by_gain
        noisy += np.float32(self.noise.levels.zero_n) * zero_n * by_zero
        force_n = rng.standard_normal((len(rows), 1, LOADS), dtype=np.float32)
        noisy += np.float32(self.noise.levels.force_n) * (force_n * harmonics_by_force(by_zero)).sum(axis=-1)
        return np.asarray(noisy)


def random_press_set(surrogate: PressRows, noise: PressNoise, count: int, seed: int) -> PressSet:
    """Return `count` random presses of the surrogate."""
    rng = np.random.default_rng(seed)
    normalised = normalise(draw_parameters(count, rng))
    direction_rad = rng.uniform(0, 2 * np.pi, count)
    blocks = [slice(start, start + BLOCK) for start in range(0, count, BLOCK)]
    rows = np.concatenate([surrogate.rows(normalised[block], direction_rad[block]) for block in blocks])
    return PressSet(normalised.astype(np.float32), rows.astype(np.float32), direction_rad, NoiseSampler(noise))


def random_scan(
    surrogate: PressRows, noise: PressNoise, normalised: Array, offsets_mm: Array, rng: np.random.Generator
) -> tuple[Array, Array]:
    """Return the rows [N, P] of a scan with noise, of coordinates [9] at offsets [N], and its directions [N].

    All have one reference. Each lies in a direction of its own.
    """
    each = np.tile(normalised, (len(offsets_mm), 1))
    each[:, OFFSET] = 2 * (offsets_mm - LOW[OFFSET]) / (HIGH[OFFSET] - LOW[OFFSET]) - 1
    direction_rad = rng.uniform(0, 2 * np.pi, len(offsets_mm))
    rows = surrogate.rows(each, direction_rad)
    rows[1:, RESPONSE] = rows[0, RESPONSE]
    return noisy_scan(rows, noise, rng), direction_rad


def noisy_scan(rows: Array, noise: PressNoise, rng: np.random.Generator) -> Array:
    """Return the rows [N, P] of presses with one reference, whose response is the same, with noise."""
    covariance = noise.scan_covariance(rows)
    error = np.linalg.cholesky(covariance) @ rng.standard_normal(len(covariance))
    first, further = error[: rows.shape[1]], error[rows.shape[1] :]
    noisy = rows + 0.0
    noisy[0] += first
    noisy[1:, FURTHER] += further.reshape(len(rows) - 1, len(FURTHER))
    noisy[1:, RESPONSE] = noisy[0, RESPONSE]
    return noisy
