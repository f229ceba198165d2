"""A profile row to its best fit: the forward model is turned round until it explains the press.

Levenberg-Marquardt from the network's estimate over everything that nobody tells the probe - tissue, slab, skin, offset
- within their ranges. How badly the best fit explains the press tells whether it is of one round inclusion.
Source: the iterated loop asked for by Lee & Won 2013, section V.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.ramp_modes.bounded_least_squares import least_squares
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.surrogate import OFFSET, PressSurrogate

TOLERANCE, STEPS = 1e-10, 100
EVERY = np.ones(len(PARAMETERS), dtype=bool)


class PressPosterior:
    """The posterior of one row [P]: how well parameters explain it."""

    def __init__(self, row: Array, surrogate: PressSurrogate, noise: PressNoise) -> None:
        self._row, self._surrogate = row, surrogate
        self._whitening = np.linalg.inv(np.linalg.cholesky(noise.covariance(row)))

    def residuals(self, normalised: Array) -> Array:
        """Return whitened residuals [..., P] at coordinates [..., 9]."""
        points = normalised.reshape(-1, len(PARAMETERS))
        residuals = (self._surrogate.rows(points) - self._row) @ self._whitening.T
        return np.asarray(residuals.reshape(*normalised.shape[:-1], -1))

    def residuals_and_jacobian(self, normalised: Array) -> tuple[Array, Array]:
        """Return the same [n, P] at coordinates [n, 9], and their derivatives [n, P, 9]."""
        rows, slopes = self._surrogate.rows_and_jacobian(normalised)
        return (rows - self._row) @ self._whitening.T, self._whitening @ slopes

    def log_density(self, normalised: Array) -> Array:
        """Return the logarithm of the posterior density [n], but for a constant, at coordinates [n, 9].

        Coordinates are even within their ranges before the press, but for the offset: its place is even over a disk.
        """
        log = np.full(len(normalised), -np.inf)
        inside = np.all(np.abs(normalised) <= 1, axis=1)
        residuals = self.residuals(normalised[inside])
        log[inside] = np.log1p(normalised[inside, OFFSET]) - 0.5 * np.sum(residuals**2, axis=1)
        return log


def best_fit(posterior: PressPosterior, start: Array) -> Array:
    """Return the coordinates [9] that explain a row best, each held weakly to the middle of its range."""
    (best,) = best_fits(posterior, start[None], EVERY, tolerance=TOLERANCE)
    return np.asarray(best)


def best_fits(posterior: PressPosterior, start: Array, free: NDArray[np.bool_], *, tolerance: float) -> Array:
    """Return the best fits [n, 9] begun at n points, in the coordinates that are `free` [9]; the others stay."""
    held = np.broadcast_to(np.eye(free.sum()) / EVEN_STD, (len(start), free.sum(), free.sum()))

    def residuals(at: Array, which: NDArray[np.intp]) -> tuple[Array, Array]:
        whole = start[which]
        whole[:, free] = at
        residual, jacobian = posterior.residuals_and_jacobian(whole)
        together = np.concatenate([residual, at / EVEN_STD], axis=1)
        return together, np.concatenate([jacobian[:, :, free], held[: len(at)]], axis=1)

    best = np.array(start)
    best[:, free] = least_squares(residuals, start[:, free], low=-1.0, high=1.0, tolerance=tolerance, steps=STEPS)
    return best
