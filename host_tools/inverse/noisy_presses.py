"""Endless random presses for training: the surrogate's rows, each time with noise of its own.

Source of the noise: `device/measurement/press_noise.py`, the very covariance that the precise mode believes in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.press_noise import PressNoise, drift_directions, light_ratio, smooth_errors
from device.measurement.press_parameters import to_unit
from device.measurement.press_surrogate import PressSurrogate
from host_tools.inverse.dense_network import Single
from host_tools.inverse.press_samples import draw_parameters

Index = NDArray[np.int64]

BLOCK = 4000


@dataclass(frozen=True, eq=False)
class Pool:
    """Coordinates [n, 9] and noise-free rows [n, P] of random presses, single precision, and their noise."""

    unit: Single
    rows: Single
    sampler: NoiseSampler

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, P] of an index [m], with fresh noise."""
        return self.sampler.add(self.rows[index], rng)


class NoiseSampler:
    """Draws noise that is distributed as `PressNoise.covariance` says."""

    def __init__(self, noise: PressNoise) -> None:
        columns = len(noise.camera)
        smooth = smooth_errors(noise.levels) + 1e-14 * np.eye(columns)
        camera, flat = (np.linalg.cholesky(part).T.astype(np.float32) for part in (noise.camera, smooth))
        self.noise, self._camera, self._smooth = noise, camera, flat
        self._drift = drift_directions(np.ones(columns)).T.astype(np.float32)
        self._levels = np.array([noise.levels.gain_ratio, noise.levels.zero_n], np.float32)

    def add(self, rows: Single, rng: np.random.Generator) -> Single:
        """Return rows [n, P] with camera noise, drift of light and cell, and smooth errors."""
        camera, smooth = rng.standard_normal((2, *rows.shape), dtype=np.float32)
        drift = (self._levels * rng.standard_normal((len(rows), 2), dtype=np.float32)) @ self._drift
        noisy = rows + camera @ self._camera
        noisy += light_ratio(rows) * (drift + smooth @ self._smooth)
        return np.asarray(noisy)


def random_pool(surrogate: PressSurrogate, noise: PressNoise, count: int, seed: int) -> Pool:
    """Return `count` random presses of the surrogate."""
    unit = to_unit(draw_parameters(count, np.random.default_rng(seed)))
    rows = [surrogate.rows(unit[start : start + BLOCK]) for start in range(0, count, BLOCK)]
    return Pool(unit.astype(np.float32), np.concatenate(rows).astype(np.float32), NoiseSampler(noise))
