"""A profile row to its best fit: the forward model is turned round until it explains the press.

Gauss-Newton from the network's estimate over everything that nobody tells the probe - tissue, slab, skin, offset -
within their ranges. How badly the best fit explains the press tells whether it is of one round inclusion.
Source: the iterated loop asked for by Lee & Won 2013, section V.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.surrogate import OFFSET, PressSurrogate

EVENLY_HELD = np.eye(len(PARAMETERS)) / EVEN_STD
"""Rows of a least-squares problem that hold each coordinate weakly to the middle of its range."""


class PressPosterior:
    """The posterior of one row [P]: how well parameters explain it."""

    def __init__(self, row: Array, surrogate: PressSurrogate, noise: PressNoise) -> None:
        self._row, self._surrogate = row, surrogate
        self._factor = np.linalg.cholesky(noise.covariance(row))

    def residuals(self, normalised: Array) -> Array:
        """Return whitened residuals [P] at coordinates [9]."""
        return self._whitened(self._surrogate.rows(normalised[None])[0] - self._row)

    def jacobian(self, normalised: Array) -> Array:
        """Return the derivatives [P, 9] of `residuals`."""
        return self._whitened(self._surrogate.rows_and_jacobian(normalised)[1])

    def log_density(self, normalised: Array) -> Array:
        """Return the logarithm of the posterior density [n], but for a constant, at coordinates [n, 9].

        Coordinates are even within their ranges before the press, but for the offset: its place is even over a disk.
        """
        log = np.full(len(normalised), -np.inf)
        inside = np.all(np.abs(normalised) <= 1, axis=1)
        residuals = self._whitened((self._surrogate.rows(normalised[inside]) - self._row).T)
        log[inside] = np.log1p(normalised[inside, OFFSET]) - 0.5 * np.sum(residuals**2, axis=0)
        return log

    def _whitened(self, columns: Array) -> Array:
        return np.asarray(solve_triangular(self._factor, columns, lower=True, check_finite=False))


def best_fit(posterior: PressPosterior, start: Array) -> Array:
    """Return the coordinates [9] that explain a row best, each held weakly to the middle of its range."""
    found = least_squares(
        lambda normalised: np.concatenate([posterior.residuals(normalised), normalised / EVEN_STD]),
        np.clip(start, -0.98, 0.98),
        jac=lambda normalised: np.vstack([posterior.jacobian(normalised), EVENLY_HELD]),
        bounds=(-1.0, 1.0),
        xtol=1e-6,
        ftol=1e-6,
    )
    return np.asarray(found.x)
