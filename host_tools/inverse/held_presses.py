"""Random held presses for mode quick's network: the surrogate's ramps read at one force, with noise of their own.

The contrast at a force between the profile's is the cubic through them. Light and cell drift, and smooth errors add
to it, as `press_noise` says for a ramp; the camera's part is measured on recordings of mode quick.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from device.measurement.held_profile import HELD_FORCES_N
from device.measurement.press_noise import ErrorLevels, smooth_ring_errors
from device.measurement.press_profile import PROFILE_FORCES_N
from device.measurement.press_surrogate import CONTRAST_COLUMNS
from device.measurement.reference_light import EXPONENT
from device.measurement.ring_means import RINGS
from host_tools.inverse.dense_network import Single
from host_tools.inverse.noisy_presses import Index, Pool
from host_tools.inverse.press_samples import Array


@dataclass(frozen=True, eq=False)
class HeldPool:
    """Coordinates [n, 9] and noise-free rows [n, 12] of held presses, and the camera's covariance [11, 11]."""

    unit: Single
    rows: Single
    camera: Array
    levels: ErrorLevels = field(default_factory=ErrorLevels)

    def noisy(self, index: Index, rng: np.random.Generator) -> Single:
        """Return the rows [m, 12] of an index [m], with fresh noise on the contrast and the force."""
        rows = self.rows[index]
        light, force_n = 1 + rows[:, :RINGS], rows[:, RINGS]
        camera, smooth = (
            rng.standard_normal((len(rows), RINGS)) @ np.linalg.cholesky(part).T
            for part in (self.camera, self._smooth())
        )
        zero_n = self.levels.zero_n * rng.standard_normal(len(rows))
        drift = self.levels.gain_ratio * rng.standard_normal(len(rows)) - EXPONENT * zero_n / force_n
        contrast = rows[:, :RINGS] + light * (camera + smooth + drift[:, None])
        return np.column_stack([contrast, force_n + zero_n]).astype(np.float32)

    def typical_noise(self) -> Array:
        """Return the covariance [12, 12] of the noise of a row without a lump."""
        zero_ratio = EXPONENT * self.levels.zero_n / float(np.mean(HELD_FORCES_N))
        covariance = np.zeros((RINGS + 1, RINGS + 1))
        covariance[:RINGS, :RINGS] = self.camera + self._smooth() + self.levels.gain_ratio**2 + zero_ratio**2
        covariance[RINGS, RINGS] = self.levels.zero_n**2
        return covariance

    def _smooth(self) -> Array:
        flat, model = smooth_ring_errors(self.levels, harmonic=0)
        return flat + model + 1e-14 * np.eye(RINGS)


def held_pool(pool: Pool, camera: Array, seed: int) -> HeldPool:
    """Return a pool of ramps as held presses, each at a random force."""
    force_n = np.random.default_rng([seed, 2]).uniform(*HELD_FORCES_N, len(pool.rows))
    return HeldPool(pool.unit, held_rows(pool.rows, force_n).astype(np.float32), camera)


def held_rows(rows: Single | Array, force_n: Array) -> Array:
    """Return the rows [n, 12] of presses held at forces [n], for profile rows [n, P]."""
    powers = np.vander(PROFILE_FORCES_N, increasing=True)
    weights = np.vander(force_n, len(PROFILE_FORCES_N), increasing=True) @ np.linalg.inv(powers)
    at_forces = np.asarray(rows[:, :CONTRAST_COLUMNS], np.float64).reshape(len(rows), -1, RINGS)
    return np.column_stack([np.einsum("nk,nkj->nj", weights, at_forces), force_n])
