"""Endless random presses for training: the surrogate's rows, each time with noise of its own.

Source of the noise: `device/measurement/ramp_modes/noise.py`, the very covariance that the precise mode believes in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array, Single
from device.measurement.parameters import normalise
from device.measurement.ramp_modes.noise import PressNoise, drift_directions, light_ratio, smooth_errors
from device.measurement.ramp_modes.surrogate import PressSurrogate
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
    """Coordinates [n, 9] and noise-free rows [n, P] of random presses, single precision, and their noise."""

    normalised: Single
    rows: Single
    sampler: NoiseSampler

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, P] of an index [m], with fresh noise."""
        return self.sampler.add(self.rows[index], rng)

    def typical_noise(self) -> Array:
        """Return the covariance [P, P] of the noise of a mean row."""
        return self.sampler.noise.covariance(self.rows.mean(axis=0).astype(np.float64))


class NoiseSampler:
    """Draws noise that is distributed as `PressNoise.covariance` says."""

    def __init__(self, noise: PressNoise) -> None:
        columns = len(noise.camera)
        smooth = smooth_errors(noise.levels) + 1e-14 * np.eye(columns)
        camera, flat = (np.linalg.cholesky(part).T.astype(np.float32) for part in (noise.camera, smooth))
        self.noise, self._camera, self._smooth = noise, camera, flat

    def add(self, rows: Single, rng: np.random.Generator) -> Single:
        """Return rows [n, P] with camera noise, drift of light and cell, and smooth errors."""
        camera, smooth = rng.standard_normal((2, *rows.shape), dtype=np.float32)
        gain, zero_n = rng.standard_normal((2, len(rows), 1), dtype=np.float32)
        by_gain, by_zero = drift_directions(rows)
        noisy = rows + light_ratio(rows) * (camera @ self._camera + smooth @ self._smooth)
        noisy += np.float32(self.noise.levels.gain_ratio) * gain * by_gain
        noisy += np.float32(self.noise.levels.zero_n) * zero_n * by_zero
        return np.asarray(noisy)


def random_press_set(surrogate: PressSurrogate, noise: PressNoise, count: int, seed: int) -> PressSet:
    """Return `count` random presses of the surrogate."""
    normalised = normalise(draw_parameters(count, np.random.default_rng(seed)))
    rows = [surrogate.rows(normalised[start : start + BLOCK]) for start in range(0, count, BLOCK)]
    return PressSet(normalised.astype(np.float32), np.concatenate(rows).astype(np.float32), NoiseSampler(noise))
