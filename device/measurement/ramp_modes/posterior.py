"""The posterior of a press: Gaussian given the modulus, whatever shape it takes along the modulus.

The modulus is what a press tells least of, and along it the best size and depth run on a curve. So its range is cut
into cells: given the modulus in the middle of one, the rest is nearly Gaussian about its own best fit. Samples of these
Gaussians, weighted by the true density, make the answer neither narrower nor wider than the press allows.
Sources: Rue, Martino & Chopin, J. R. Stat. Soc. B 71 (2009), nested Laplace approximations; Tierney & Kadane, JASA 81
(1986); importance sampling with Student's tails and a defensive share, Hesterberg, Technometrics 37 (1995).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.ramp_modes.fit import PressPosterior, best_fit, best_fits
from device.measurement.ramp_modes.surrogate import MODULUS

CELLS, SAMPLES = 11, 6000
WIDER, FREEDOM = 1.15, 6.0
"""Gaussians are drawn wider than they are, with the tails of Student's distribution: nothing may be missed."""
DEFENSIVE_SHARE = 0.15
"""Share of the samples that go evenly to all cells, whatever their Gaussians promise."""
FEWEST_EFFECTIVE = 20.0
"""Fewer say nothing of the posterior: presses that the ranges hold leave hundreds."""
SEED = 20130317
EDGES = np.linspace(-1.0, 1.0, CELLS + 1)
MIDDLES = (EDGES[1:] + EDGES[:-1]) / 2
REST = np.arange(len(PARAMETERS)) != MODULUS
NEAR = 1e-8
"""A cell's best fit needs to be near, not exact: the weights correct it."""


@dataclass(frozen=True, eq=False)
class PressFit:
    """Posterior of the coordinates [9] of `parameters.normalise`.

    `best`: the best fit; `mean`, `spread`: of the posterior; `effective_samples`: what the weighted ones are worth. Too
    few, because the best fit is driven into a corner of the ranges, tell nothing: the spread is then that of the ranges
    and the mean the best fit.
    """

    best: Array
    mean: Array
    spread: Array
    effective_samples: float


@dataclass(frozen=True, eq=False)
class _Cells:
    """Best fit [C, 9], its slope by the modulus [C, 8], factor of the covariance [C, 8, 8] and share [C] of cells."""

    best: Array
    slope: Array
    factor: Array
    share: Array

    def draw(self, count: int, rng: np.random.Generator) -> tuple[Array, Array]:
        """Return samples [n, 9] and the logarithm of their density, but for a constant."""
        cell = rng.choice(CELLS, count, p=self.share)
        modulus = rng.uniform(EDGES[cell], EDGES[cell + 1])
        rest = len(PARAMETERS) - 1
        standard = rng.standard_normal((count, rest)) / np.sqrt(rng.chisquare(FREEDOM, count) / FREEDOM)[:, None]
        samples = np.empty((count, len(PARAMETERS)))
        samples[:, MODULUS] = modulus
        samples[:, REST] = (
            self.best[cell][:, REST]
            + self.slope[cell] * (modulus - MIDDLES[cell])[:, None]
            + np.einsum("nij,nj->ni", self.factor[cell], standard)
        )
        log = np.log(self.share[cell]) - _log_volume(self.factor)[cell]
        return samples, log - (FREEDOM + rest) / 2 * np.log1p(np.sum(standard**2, axis=1) / FREEDOM)


def sample_press(posterior: PressPosterior, start: Array) -> PressFit:
    """Return best fit, mean and spread of a press's posterior, begun at coordinates [9] of an estimate."""
    best = best_fit(posterior, start)
    samples, log_proposal = _cells(posterior, best).draw(SAMPLES, np.random.default_rng(SEED))
    log = posterior.log_density(samples) - log_proposal
    weight = np.exp(log - max(log.max(), np.finfo(float).min))  # which is -inf when every sample lies outside
    effective = float(weight.sum() ** 2 / np.sum(weight**2)) if weight.any() else 0.0
    if effective < FEWEST_EFFECTIVE:
        return PressFit(best, best, np.full(len(best), EVEN_STD), effective)
    weight /= weight.sum()
    mean = weight @ samples
    return PressFit(best, mean, np.sqrt(weight @ (samples - mean) ** 2), effective)


def _cells(posterior: PressPosterior, best: Array) -> _Cells:
    centres = _best_in_cells(posterior, best)
    residuals, jacobian = posterior.residuals_and_jacobian(centres)
    precision = _precision(jacobian)
    covariance = np.linalg.inv(precision[:, REST][:, :, REST])
    factor = WIDER * np.linalg.cholesky(covariance)
    log = _log_volume(factor) - 0.5 * np.sum(residuals**2, axis=1)
    share = np.exp(log - log.max())
    share = (1 - DEFENSIVE_SHARE) * share / share.sum() + DEFENSIVE_SHARE / CELLS
    return _Cells(centres, -np.einsum("nij,nj->ni", covariance, precision[:, REST, MODULUS]), factor, share)


def _best_in_cells(posterior: PressPosterior, best: Array) -> Array:
    """Return the best fits [C, 9] with the modulus held in the middle of each cell, begun where `best` slides to."""
    _, jacobian = posterior.residuals_and_jacobian(best[None])
    precision = _precision(jacobian)[0]
    slope = -np.linalg.solve(precision[np.ix_(REST, REST)], precision[REST, MODULUS])
    start = np.tile(best, (CELLS, 1))
    start[:, MODULUS] = MIDDLES
    start[:, REST] += slope * (MIDDLES - best[MODULUS])[:, None]
    return best_fits(posterior, np.clip(start, -1.0, 1.0), REST, tolerance=NEAR)


def _precision(jacobian: Array) -> Array:
    """Return the inverse covariances [n, 9, 9] of a Gaussian posterior: of the press, and of the ranges."""
    return np.asarray(jacobian.transpose(0, 2, 1) @ jacobian + np.eye(len(PARAMETERS)) / EVEN_STD**2)


def _log_volume(factor: Array) -> Array:
    """Return the logarithm of the determinants [C] of triangular factors [C, k, k]."""
    return np.asarray(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1))
