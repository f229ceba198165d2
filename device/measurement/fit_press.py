"""A profile row to the posterior of size, depth and modulus: the forward model is turned round until it fits.

Gauss-Newton from the network's estimate finds the best fit; importance sampling around it integrates over what nobody
tells the probe - tissue, slab, skin, offset - within their ranges. So the answer is neither narrower nor wider than
the press allows, also where it is far from Gaussian, as it is for the modulus. The proposal is fitted to the samples
and drawn again. Sources: the iterated loop asked for by Lee & Won 2013, section V; Cappe et al., Population Monte
Carlo, J. Comput. Graph. Stat. 13 (2004); Tierney & Kadane, JASA 81 (1986) for the first proposal.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular
from scipy.optimize import least_squares

from device.measurement.press_noise import PressNoise
from device.measurement.press_parameters import EVEN_STD, PARAMETERS
from device.measurement.press_surrogate import PressSurrogate

Array = NDArray[np.float64]

ROUNDS, SAMPLES = 4, 1500
"""Times the proposal is drawn, and samples each time."""
WIDER, FREEDOM = 1.2, 6.0
"""The proposal is wider than what it covers, with the tails of Student's distribution: nothing may be missed."""
SEED = 20130317


@dataclass(frozen=True, eq=False)
class PressFit:
    """Posterior of the coordinates [9] of `press_parameters.to_unit`.

    `best`: the best fit; `mean`, `spread`: of the posterior; `misfit`: squared residuals of the best fit, each over its
    standard deviation; `columns`: how many there are; `effective_samples`: what the weighted ones are worth.
    """

    best: Array
    mean: Array
    spread: Array
    misfit: float
    columns: int
    effective_samples: float


class _Weighted(NamedTuple):
    samples: Array
    weight: Array


class PressPosterior:
    """The posterior of one row [P]: how well parameters explain it."""

    def __init__(self, row: Array, surrogate: PressSurrogate, noise: PressNoise) -> None:
        self._row, self._surrogate = row, surrogate
        self._factor = np.linalg.cholesky(noise.covariance(row))

    def residuals(self, unit: Array) -> Array:
        """Return whitened residuals [P] at coordinates [9]."""
        return self._whitened(self._surrogate.rows(unit[None])[0] - self._row)

    def jacobian(self, unit: Array) -> Array:
        """Return the derivatives [P, 9] of `residuals`."""
        return self._whitened(self._surrogate.rows_and_jacobian(unit)[1])

    def log_density(self, unit: Array) -> Array:
        """Return the logarithm of the posterior density [n], but for a constant, at coordinates [n, 9]."""
        log = np.full(len(unit), -np.inf)
        inside = np.all(np.abs(unit) <= 1, axis=1)
        residuals = self._whitened((self._surrogate.rows(unit[inside]) - self._row).T)
        log[inside] = -0.5 * np.sum(residuals**2, axis=0)
        return log

    def _whitened(self, columns: Array) -> Array:
        return np.asarray(solve_triangular(self._factor, columns, lower=True, check_finite=False))


def fit_press(row: Array, surrogate: PressSurrogate, noise: PressNoise, start: Array) -> PressFit:
    """Return the posterior of a profile row [P], begun at coordinates [9] of an estimate."""
    posterior, rng = PressPosterior(row, surrogate, noise), np.random.default_rng(SEED)
    best = best_fit(posterior, start)
    slope = posterior.jacobian(best)
    centre: Array = best
    covariance = np.asarray(np.linalg.inv(slope.T @ slope + np.eye(len(best)) / EVEN_STD**2), np.float64)
    rounds: list[_Weighted] = []
    for _ in range(ROUNDS):
        samples, log_proposal = _student(rng, centre, WIDER**2 * covariance, SAMPLES)
        rounds.append(_Weighted(samples, posterior.log_density(samples) - log_proposal))
        drawn = _normalised(rounds)
        centre, covariance = _moments(drawn)
    return PressFit(
        best=best,
        mean=centre,
        spread=np.sqrt(np.diag(covariance)),
        misfit=float(np.sum(posterior.residuals(best) ** 2)),
        columns=len(row),
        effective_samples=float(1 / np.sum(drawn.weight**2)),
    )


def best_fit(posterior: PressPosterior, start: Array) -> Array:
    """Return the coordinates [9] that explain a row best, each held weakly to the middle of its range."""
    prior = np.eye(len(PARAMETERS)) / EVEN_STD
    found = least_squares(
        lambda unit: np.concatenate([posterior.residuals(unit), unit / EVEN_STD]),
        np.clip(start, -0.98, 0.98),
        jac=lambda unit: np.vstack([posterior.jacobian(unit), prior]),
        bounds=(-1.0, 1.0),
        xtol=1e-6,
        ftol=1e-6,
    )
    return np.asarray(found.x)


def _student(rng: np.random.Generator, centre: Array, covariance: Array, count: int) -> tuple[Array, Array]:
    """Return samples [n, 9] of Student's distribution and the logarithm of its density there, but for a constant."""
    factor = np.linalg.cholesky(covariance)
    standard = rng.standard_normal((count, len(centre))) / np.sqrt(rng.chisquare(FREEDOM, count) / FREEDOM)[:, None]
    distance = np.sum(standard**2, axis=1)
    log = -(FREEDOM + len(centre)) / 2 * np.log1p(distance / FREEDOM) - np.sum(np.log(np.diag(factor)))
    return centre + standard @ factor.T, np.asarray(log)


def _normalised(rounds: list[_Weighted]) -> _Weighted:
    log = np.concatenate([drawn.weight for drawn in rounds])
    weight = np.exp(log - log.max())
    return _Weighted(np.concatenate([drawn.samples for drawn in rounds]), weight / weight.sum())


def _moments(drawn: _Weighted) -> tuple[Array, Array]:
    """Return mean [9] and covariance [9, 9], never flatter in any direction than a few thousandths of a range."""
    mean = drawn.weight @ drawn.samples
    away = drawn.samples - mean
    return mean, (drawn.weight[:, None] * away).T @ away + 1e-6 * np.eye(len(mean))
