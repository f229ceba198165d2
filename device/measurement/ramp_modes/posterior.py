"""The posterior of a press: Gaussian given the modulus, whatever shape it takes along the modulus.

The modulus is what a press tells least of, and along it the best size and depth run on a curve. So its range is cut
into cells: given the modulus in the middle of one, the rest is nearly Gaussian about its own best fit. Samples of these
Gaussians, weighted by the true density, make the answer neither narrower nor wider than the press allows.
Sources: Rue, Martino & Chopin, J. R. Stat. Soc. B 71 (2009), nested Laplace approximations; Tierney & Kadane, JASA 81
(1986); importance sampling with Student's tails and a defensive share, Hesterberg, Technometrics 37 (1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import lgamma, log, pi
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, EVEN_STD
from device.measurement.ramp_modes.fit import Explained, best_fit, best_fits
from device.measurement.ramp_modes.joint_region import JointRegion, joint_region
from device.measurement.ramp_modes.surrogate import MODULUS

CELLS, SAMPLES = 11, 6000
WIDER, FREEDOM = 1.15, 6.0
"""Gaussians are drawn wider than they are, with the tails of Student's distribution: nothing may be missed."""
DEFENSIVE_SHARE = 0.15
"""Share of the samples that go evenly to all cells, whatever their Gaussians promise."""
FEWEST_EFFECTIVE = 20.0
"""Fewer say nothing of the posterior: presses that the ranges hold leave hundreds."""
FEW_EFFECTIVE, MOST_SPOTS, SPOT_SAMPLES = 300.0, 12, 500
"""Samples that are worth less than the first get further Gaussians, at most so many of so many samples each."""
SEED = 20130317
TOGETHER = (2, COUNT)
"""Size and depth, the first two of the unknowns, and all three."""
EDGES = np.linspace(-1.0, 1.0, CELLS + 1)
MIDDLES = (EDGES[1:] + EDGES[:-1]) / 2
NEAR, MOST_STEPS = 1e-5, 12
"""A cell's best fit needs to be near, not exact: the weights correct it. One that creeps would cost more than all."""


@dataclass(frozen=True, eq=False)
class PressFit:
    """Posterior of the coordinates [8 + N] of `PressPosterior`.

    `best`: the best fit; `mean`, `spread`: of the posterior; `effective_samples`: what the weighted ones are worth. Too
    few, because the best fit is driven into a corner of the ranges, tell nothing: the spread is then that of the ranges
    and the mean the best fit. `by_modulus`: the same, cell by cell of the modulus. `regions`: where the unknowns of
    each of `TOGETHER` lie together; none where too few samples tell nothing.
    """

    best: Array
    mean: Array
    spread: Array
    effective_samples: float
    by_modulus: ModulusCells
    regions: tuple[JointRegion, ...] = ()


class WeightedSamples(NamedTuple):
    """Samples [n, k] of a posterior, their weights [n], which add up to 1, and how many they are worth.

    Where all lie outside the ranges, no weight says anything: they are worth nothing.
    """

    at: Array
    weight: Array
    effective: float


class ModulusCells(NamedTuple):
    """Of each cell of the modulus: its `share` [C] of the posterior, and mean and spread [C, 8 + N] in it.

    A cell without samples has no share, the middle of the cell as its mean, and the spread of the ranges.
    """

    share: Array
    mean: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class _Cells:
    """Best fit [C, k], its slope by the modulus [C, k - 1], factor of the covariance [C, k - 1, k - 1], share [C]."""

    best: Array
    slope: Array
    factor: Array
    share: Array

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return samples [n, k]."""
        cell = rng.choice(CELLS, count, p=self.share)
        rest = self.slope.shape[1]
        samples = np.empty((count, rest + 1))
        samples[:, MODULUS] = rng.uniform(EDGES[cell], EDGES[cell + 1])
        standard = _students(rng, count, rest)
        samples[:, _rest(rest + 1)] = self._middle(cell, samples[:, MODULUS]) + np.einsum(
            "nij,nj->ni", self.factor[cell], standard
        )
        return samples

    def log_density(self, samples: Array) -> Array:
        """Return the logarithm of the density [n] of samples [n, k], which is -inf outside the modulus' range."""
        modulus, rest = samples[:, MODULUS], _rest(samples.shape[1])
        cell = np.clip(np.searchsorted(EDGES, modulus, side="right") - 1, 0, CELLS - 1)
        away = samples[:, rest] - self._middle(cell, modulus)
        standard = np.einsum("nij,nj->ni", np.linalg.inv(self.factor)[cell], away)
        log = np.log(self.share[cell] / np.diff(EDGES)[cell]) + _log_students(standard)
        return np.where(np.abs(modulus) <= 1, log - _log_volume(self.factor)[cell], -np.inf)

    def _middle(self, cell: NDArray[np.intp], modulus: Array) -> Array:
        """Return where the other coordinates [n, k - 1] lie at moduli [n] of cells."""
        best = self.best[cell][:, _rest(self.best.shape[1])]
        return np.asarray(best + self.slope[cell] * (modulus - MIDDLES[cell])[:, None])


@dataclass(frozen=True, eq=False)
class _Spot:
    """Student's distribution about coordinates [k], with a factor of the covariance [k, k]."""

    middle: Array
    factor: Array

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return samples [n, k]."""
        return np.asarray(self.middle + _students(rng, count, len(self.middle)) @ self.factor.T)

    def log_density(self, samples: Array) -> Array:
        """Return the logarithm of the density [n] of samples [n, k]."""
        standard = (samples - self.middle) @ np.linalg.inv(self.factor).T
        return _log_students(standard) - float(np.log(np.diag(self.factor)).sum())


def _students(rng: np.random.Generator, count: int, dimensions: int) -> Array:
    """Return standard samples [n, k] of Student's distribution."""
    return np.asarray(
        rng.standard_normal((count, dimensions)) / np.sqrt(rng.chisquare(FREEDOM, count) / FREEDOM)[:, None]
    )


def _log_students(standard: Array) -> Array:
    """Return the logarithm of the standard density [n] of Student's distribution at [n, k]."""
    k, freedom = standard.shape[1], FREEDOM
    constant = lgamma((freedom + k) / 2) - lgamma(freedom / 2) - k / 2 * log(freedom * pi)
    return np.asarray(constant - (freedom + k) / 2 * np.log1p(np.sum(standard**2, axis=1) / freedom))


def sample_press(posterior: Explained, start: Array) -> PressFit:
    """Return best fit, mean and spread of the posterior of a press or a scan, begun at coordinates [8 + N]."""
    best = best_fit(posterior, start)
    samples, weight, effective = weighted_samples(posterior, best)
    if effective < FEWEST_EFFECTIVE:
        return PressFit(best, best, np.full(len(best), EVEN_STD), effective, _even_cells(best))
    mean, spread = _moments(samples, weight)
    regions = tuple(joint_region(samples[:, :count], weight) for count in TOGETHER)
    return PressFit(best, mean, spread, effective, _by_modulus(samples, weight), regions)


def weighted_samples(posterior: Explained, best: Array) -> WeightedSamples:
    """Return samples of the posterior about its best fit [8 + N].

    Where Gaussians miss a bent posterior, the sample of the largest weight says where: there another one is put, and
    all samples count as drawn from the mixture. Source: Raftery & Bao, Biometrics 66 (2010), incremental mixtures.
    """
    cells, rng = _cells(posterior, best), np.random.default_rng(SEED)
    parts: list[tuple[_Cells | _Spot, int]] = [(cells, SAMPLES)]
    samples = cells.draw(SAMPLES, rng)
    log_density = posterior.log_density(samples)
    while True:
        log_weight = log_density - _log_mixture(parts, samples)
        weight = np.exp(log_weight - max(log_weight.max(), np.finfo(float).min))  # -inf when all lie outside
        effective = float(weight.sum() ** 2 / np.sum(weight**2)) if weight.any() else 0.0
        if effective >= FEW_EFFECTIVE or len(parts) > MOST_SPOTS or not weight.any():
            return WeightedSamples(samples, weight / max(weight.sum(), np.finfo(float).tiny), effective)
        spot = _spot_at(posterior, samples[np.argmax(weight)])
        parts.append((spot, SPOT_SAMPLES))
        further = spot.draw(SPOT_SAMPLES, rng)
        samples = np.concatenate([samples, further])
        log_density = np.concatenate([log_density, posterior.log_density(further)])


def _log_mixture(parts: Sequence[tuple[_Cells | _Spot, int]], samples: Array) -> Array:
    """Return the logarithm of the density [n] of a mixture at samples [n, k], each part with its number of samples."""
    logs = [np.log(count) + part.log_density(samples) for part, count in parts]
    return np.asarray(np.logaddexp.reduce(logs, axis=0) - np.log(sum(count for _, count in parts)))


def _spot_at(posterior: Explained, at: Array) -> _Spot:
    """Return the Gaussian of the posterior about coordinates [k], a little wider."""
    _, jacobian = posterior.residuals_and_jacobian(at[None])
    return _Spot(at, WIDER * np.linalg.cholesky(np.linalg.inv(_precision(jacobian)[0])))


def _by_modulus(samples: Array, weight: Array) -> ModulusCells:
    cells = _even_cells(np.zeros(samples.shape[1]))
    cell = np.clip(np.searchsorted(EDGES, samples[:, MODULUS], side="right") - 1, 0, CELLS - 1)
    share = np.bincount(cell, weight, CELLS).astype(np.float64)
    for number in np.flatnonzero(share):
        inside = cell == number
        cells.mean[number], cells.spread[number] = _moments(samples[inside], weight[inside] / share[number])
    return cells._replace(share=share)


def _even_cells(at: Array) -> ModulusCells:
    """Return the cells of a posterior that tells nothing, about coordinates [k]."""
    mean = np.tile(at, (CELLS, 1))
    mean[:, MODULUS] = MIDDLES
    return ModulusCells(np.full(CELLS, 1 / CELLS), mean, np.full_like(mean, EVEN_STD))


def _moments(samples: Array, weight: Array) -> tuple[Array, Array]:
    """Return mean and standard deviation [k] of samples [n, k] whose weights [n] add up to 1."""
    mean = weight @ samples
    return mean, np.sqrt(weight @ (samples - mean) ** 2)


def _cells(posterior: Explained, best: Array) -> _Cells:
    centres = _best_in_cells(posterior, best)
    residuals, jacobian = posterior.residuals_and_jacobian(centres)
    precision, rest = _precision(jacobian), _rest(len(best))
    covariance = np.linalg.inv(precision[:, rest][:, :, rest])
    factor = WIDER * np.linalg.cholesky(covariance)
    log = _log_volume(factor) - 0.5 * np.sum(residuals**2, axis=1)
    share = np.exp(log - log.max())
    share = (1 - DEFENSIVE_SHARE) * share / share.sum() + DEFENSIVE_SHARE / CELLS
    return _Cells(centres, -np.einsum("nij,nj->ni", covariance, precision[:, rest, MODULUS]), factor, share)


def _best_in_cells(posterior: Explained, best: Array) -> Array:
    """Return the best fits [C, k] with the modulus held in the middle of each cell, begun where `best` slides to."""
    _, jacobian = posterior.residuals_and_jacobian(best[None])
    precision, rest = _precision(jacobian)[0], _rest(len(best))
    slope = -np.linalg.solve(precision[np.ix_(rest, rest)], precision[rest, MODULUS])
    start = np.tile(best, (CELLS, 1))
    start[:, MODULUS] = MIDDLES
    start[:, rest] += slope * (MIDDLES - best[MODULUS])[:, None]
    return best_fits(posterior, np.clip(start, -1.0, 1.0), rest, tolerance=NEAR, steps=MOST_STEPS)


def _rest(dimensions: int) -> NDArray[np.bool_]:
    """Return which coordinates [k] are not the modulus."""
    return np.asarray(np.arange(dimensions) != MODULUS)


def _precision(jacobian: Array) -> Array:
    """Return the inverse covariances [n, k, k] of a Gaussian posterior: of the presses, and of the ranges."""
    return np.asarray(jacobian.transpose(0, 2, 1) @ jacobian + np.eye(jacobian.shape[2]) / EVEN_STD**2)


def _log_volume(factor: Array) -> Array:
    """Return the logarithm of the determinants [C] of triangular factors [C, k, k]."""
    return np.asarray(np.log(np.diagonal(factor, axis1=1, axis2=2)).sum(axis=1))
