"""The posterior of a press: Gaussian given the modulus, whatever shape it takes along the modulus.

The modulus is what a press tells least of, and along it the best size and depth run on a curve. So its range is cut
into cells: given the modulus in the middle of one, the rest is nearly Gaussian about its own best fit, cut off by the
ranges. Samples of that, weighted by the true density, make the answer neither narrower nor wider than the press allows.
Sources: Rue, Martino & Chopin, J. R. Stat. Soc. B 71 (2009), nested Laplace approximations; Tierney & Kadane, JASA 81
(1986); importance sampling with a defensive share, Hesterberg, Technometrics 37 (1995).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, EVEN_STD, denormalise, is_possible
from device.measurement.ramp_modes.fit import Explained, best_fit, best_fits
from device.measurement.ramp_modes.joint_region import JointRegion, joint_region, profiled_region
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, OFFSET, SIZE, TISSUE
from device.measurement.ramp_modes.within_ranges import draw_within, log_density_within

CELLS, SAMPLES = 11, 1000
RANGE_STD = 1.0
"""A range is Gaussian with this standard deviation, cut off at its ends: not quite even, since presses bend it, too."""
DEFENSIVE_SHARE = 0.15
"""Share of the samples that go evenly to all cells, whatever their Gaussians promise."""
FEWEST_EFFECTIVE = 20.0
"""Fewer say nothing of the posterior: presses that the ranges hold leave hundreds."""
ENOUGH_EFFECTIVE, MOST_SPOTS, SPOT_SAMPLES = 400.0, 15, 200
"""Samples that are worth less than the first get further Gaussians, at most so many of so many samples each.

One lucky sample in each of them is less than the fewest that say anything.
"""
SEED = 20130317
TOGETHER = (2, COUNT)
"""Size and depth, the first two of the unknowns, and all three."""
EDGES = np.linspace(-1.0, 1.0, CELLS + 1)
MIDDLES = (EDGES[1:] + EDGES[:-1]) / 2
LARGE_AND_SHALLOW, SOFT = (0.7, -0.5), -0.9
"""Coordinates of size and depth, and of tissue, from which each cell is fitted, too.

A large inclusion near the skin looks much like a smaller one, deeper in other tissue: what is left of a press has
several hollows, and a fit ends in that which it is begun in. Begun where the best fit slides to alone, 8 of 900 random
presses miss more than 2 of the logarithm of the evidence, and 39 at most.
"""
APART, WORTH_IT, MOST_OTHERS = 0.3, 9.0, 3
"""A cell may have a second hollow: fits that lie so far from its best one, and leave so much more than the best of all
at most, get Gaussians of their own. Samples of the best alone never see the other, and count as many as if none were.
"""
NEAR, MOST_STEPS = 1e-5, 12
"""A cell's best fit needs to be near, not exact: the weights correct it. One that creeps would cost more than all.

Four steps were too few for some small inclusions: a cell whose fit was far from best seemed impossible, and the modulus
was told with a third of its spread. After twelve nothing moves any more, and few fits need as many.
"""


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

    `worth` [C]: how many samples these are of. A cell without any has no share, the middle of the cell as its mean, and
    the spread of the ranges.
    """

    share: Array
    mean: Array
    spread: Array
    worth: Array


@dataclass(frozen=True, eq=False)
class _Cells:
    """Gaussians of all coordinates but the modulus, each in its cell; the ranges cut them off.

    `order` [k - 1]: which coordinates these are, in the order in which they are drawn. `middle` [C, k - 1] where the
    modulus is in the cell's middle, `slope` by it, `factor` [C, k - 1, k - 1] of the covariance, `share` [C] of the
    samples.
    """

    order: NDArray[np.intp]
    middle: Array
    slope: Array
    factor: Array
    share: Array

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return samples [n, k], as evenly over the modulus as the shares allow."""
        ends = np.append(0.0, np.cumsum(self.share)) / self.share.sum()
        modulus = np.interp((np.arange(count) + rng.uniform(size=count)) / count, ends, EDGES)
        samples = np.empty((count, self.middle.shape[1] + 1))
        samples[:, MODULUS] = modulus
        middle, cell = self._given(modulus)
        samples[:, self.order] = draw_within(middle, self.factor[cell], rng)
        return samples

    def log_density(self, samples: Array) -> Array:
        """Return the logarithm of the density [n] of samples [n, k]."""
        middle, cell = self._given(samples[:, MODULUS])
        log = log_density_within(samples[:, self.order], middle, np.linalg.inv(self.factor)[cell])
        return np.asarray(log + np.log(self.share / np.diff(EDGES))[cell])

    def _given(self, modulus: Array) -> tuple[Array, NDArray[np.intp]]:
        """Return middles [n, k - 1] of the other coordinates at moduli [n], and the numbers [n] of their cells."""
        cell = _cell_of(modulus)
        return self.middle[cell] + self.slope[cell] * (modulus - MIDDLES[cell])[:, None], cell


@dataclass(frozen=True, eq=False)
class _Spot:
    """A Gaussian about coordinates [k], with a factor of the covariance [k, k]; the ranges cut it off."""

    middle: Array
    factor: Array

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Return samples [n, k]."""
        factor = np.broadcast_to(self.factor, (count, *self.factor.shape))
        return draw_within(np.tile(self.middle, (count, 1)), factor, rng)

    def log_density(self, samples: Array) -> Array:
        """Return the logarithm of the density [n] of samples [n, k]."""
        return log_density_within(samples, self.middle, np.linalg.inv(self.factor))


def _cell_of(modulus: Array) -> NDArray[np.intp]:
    """Return the numbers [n] of the cells of moduli."""
    return np.clip(np.searchsorted(EDGES, modulus, side="right") - 1, 0, CELLS - 1)


def sample_press(posterior: Explained, start: Array) -> PressFit:
    """Return best fit, mean and spread of the posterior of a press or a scan, begun at coordinates [8 + N]."""
    best, in_cells, others = best_everywhere(posterior, start)
    samples, weight, effective = weighted_samples(posterior, in_cells, others)
    if effective < FEWEST_EFFECTIVE:
        return PressFit(best, best, np.full(len(best), EVEN_STD), effective, _even_cells(best))
    mean, spread = _moments(samples, weight)
    size_and_depth, all_three = (samples[:, :count] for count in TOGETHER)
    profiled = profiled_region(size_and_depth, weight, _cell_of(samples[:, MODULUS]))
    regions = profiled, joint_region(all_three, weight)
    return PressFit(best, mean, spread, effective, _by_modulus(samples, weight), regions)


def best_everywhere(posterior: Explained, start: Array) -> tuple[Array, Array, list[Array]]:
    """Return the best fit [k], begun at coordinates [k], those in the cells [C, k], and those in other hollows.

    Where one in a cell's middle explains the presses better, the best fit is begun there once more.
    """
    best = best_fit(posterior, start)
    in_cells, others = _best_in_cells(posterior, best)
    left = _left(posterior, np.vstack([best, in_cells]))
    if np.argmin(left) > 0:
        best = best_fit(posterior, in_cells[np.argmin(left[1:])])
    return best, in_cells, others


def weighted_samples(posterior: Explained, in_cells: Array, others: Sequence[Array]) -> WeightedSamples:
    """Return samples of the posterior about its best fits in the cells of the modulus [C, 8 + N], and about `others`.

    Where Gaussians miss a bent posterior, the sample of the largest weight says where: there another one is put, and
    all samples count as drawn from the mixture. Source: Raftery & Bao, Biometrics 66 (2010), incremental mixtures.
    """
    rng = np.random.default_rng(SEED)
    parts: list[tuple[_Cells | _Spot, int]] = []
    samples, density, drawn = np.zeros((0, in_cells.shape[1])), np.zeros(0), np.zeros((0, 0))
    waiting: list[tuple[_Cells | _Spot, int]] = [(_cells(posterior, in_cells), SAMPLES)]
    waiting += [(_spot_at(posterior, one), SPOT_SAMPLES) for one in others]
    while True:
        further = part, count = waiting.pop(0)
        new = part.draw(count, rng)
        drawn = np.vstack([drawn, np.log(count) + part.log_density(samples)])
        parts.append(further)
        drawn = np.hstack([drawn, [np.log(number) + one.log_density(new) for one, number in parts]])
        samples, density = np.concatenate([samples, new]), np.append(density, posterior.log_density(new))
        if waiting:
            continue
        weight, effective = _weights(density - np.logaddexp.reduce(drawn, axis=0))
        if effective >= ENOUGH_EFFECTIVE or len(parts) > MOST_SPOTS or not effective:
            return WeightedSamples(samples, weight, effective)
        waiting.append((_spot_at(posterior, samples[np.argmax(weight)]), SPOT_SAMPLES))


def _weights(log: Array) -> tuple[Array, float]:
    """Return weights [n] that add up to 1, of their logarithms but for a constant, and how many samples they make."""
    weight = np.exp(log - max(log.max(), np.finfo(float).min))  # -inf when none is possible
    effective = float(weight.sum() ** 2 / np.sum(weight**2)) if weight.any() else 0.0
    return weight / max(weight.sum(), np.finfo(float).tiny), effective


def _spot_at(posterior: Explained, at: Array) -> _Spot:
    """Return the Gaussian of the posterior about coordinates [k]."""
    _, jacobian = posterior.residuals_and_jacobian(at[None])
    return _Spot(at, np.linalg.cholesky(np.linalg.inv(_precision(jacobian, RANGE_STD)[0])))


def _by_modulus(samples: Array, weight: Array) -> ModulusCells:
    cells = _even_cells(np.zeros(samples.shape[1]))
    cell = _cell_of(samples[:, MODULUS])
    share = np.bincount(cell, weight, CELLS).astype(np.float64)
    for number in np.flatnonzero(share):
        inside = cell == number
        cells.mean[number], cells.spread[number] = _moments(samples[inside], weight[inside] / share[number])
    worth = share**2 / np.maximum(np.bincount(cell, weight**2, CELLS), np.finfo(float).tiny)
    return cells._replace(share=share, worth=worth)


def _even_cells(at: Array) -> ModulusCells:
    """Return the cells of a posterior that tells nothing, about coordinates [k]."""
    mean = np.tile(at, (CELLS, 1))
    mean[:, MODULUS] = MIDDLES
    return ModulusCells(np.full(CELLS, 1 / CELLS), mean, np.full_like(mean, EVEN_STD), np.zeros(CELLS))


def _moments(samples: Array, weight: Array) -> tuple[Array, Array]:
    """Return mean and standard deviation [k] of samples [n, k] whose weights [n] add up to 1."""
    mean = weight @ samples
    return mean, np.sqrt(weight @ (samples - mean) ** 2)


def _cells(posterior: Explained, at: Array) -> _Cells:
    """Return the Gaussians about the best fits [C, k] in the cells: middles may lie outside the ranges, fits may not.

    What the ranges cut off most is drawn first: the others follow from where it came to lie.
    """
    rest = np.flatnonzero(_rest(at.shape[1]))
    residuals, jacobian = posterior.residuals_and_jacobian(at)
    precision = _precision(jacobian, RANGE_STD)
    of_rest = precision[:, rest][:, :, rest]
    covariance = np.linalg.inv(of_rest)
    log = -0.5 * np.linalg.slogdet(of_rest)[1] - 0.5 * np.sum(residuals**2, axis=1)
    share = _defended(np.exp(log - log.max()))
    uphill = np.einsum("nsi,ns->ni", jacobian[:, :, rest], residuals) + at[:, rest] / RANGE_STD**2
    step, slope = (-np.einsum("nij,nj->ni", covariance, one) for one in (uphill, precision[:, rest, MODULUS]))
    middle = at[:, rest] + step
    cut_off = share @ np.maximum(np.abs(middle) - 1, 0)
    order = np.argsort(-cut_off, kind="stable")
    factor = np.linalg.cholesky(covariance[:, order][:, :, order])
    return _Cells(rest[order], middle[:, order], slope[:, order], factor, share)


def _defended(share: Array) -> Array:
    """Return shares [C] of which each has a part of its own."""
    return np.asarray((1 - DEFENSIVE_SHARE) * share / share.sum() + DEFENSIVE_SHARE / CELLS)


def _best_in_cells(posterior: Explained, best: Array) -> tuple[Array, list[Array]]:
    """Return the best fits [C, k] with the modulus held in the middle of each cell, and those in other hollows [k].

    Each is the best of several: begun where `best` slides to, there in soft tissue, and large and shallow.
    """
    slid = _slid(posterior, best)
    starts = np.clip([slid, _in_soft_tissue(slid), _large_and_shallow(best)], -1.0, 1.0)
    single: NDArray[Any] = starts.reshape(-1, len(best)).astype(np.float32)  # twice as fast: see `PressRows`
    found = best_fits(posterior, single, _rest(len(best)), tolerance=NEAR, steps=MOST_STEPS)
    return _deepest(found.reshape(starts.shape).astype(np.float64), _left(posterior, found).reshape(-1, CELLS))


def _deepest(found: Array, left: Array) -> tuple[Array, list[Array]]:
    """Return the best [C, k] of fits [S, C, k] that leave [S, C] unexplained, and the best ones in other hollows.

    What the ranges hold impossible counts only in a cell where all is.
    """
    is_allowed = is_possible(denormalise(found[..., : OFFSET + 1].reshape(-1, OFFSET + 1))).reshape(left.shape)
    left = np.where(is_allowed | ~is_allowed.any(axis=0), left, np.inf)
    best = found[np.argmin(left, axis=0), np.arange(CELLS)]
    is_other = (_apart(found, best) > APART) & (left < left.min() + WORTH_IT)
    others: list[Array] = []
    for at in found[is_other][np.argsort(left[is_other])]:
        if all(_apart(at, other) > APART for other in others):
            others.append(at)
    return best, others[:MOST_OTHERS]


def _apart(at: Array, other: Array) -> Array:
    """Return how far coordinates [..., k] lie from others in what makes a hollow: inclusion and tissue."""
    return np.asarray(np.abs(at - other)[..., [SIZE, DEPTH, MODULUS, TISSUE]].max(axis=-1))


def _slid(posterior: Explained, best: Array) -> Array:
    """Return where the best fit [k] slides to when the modulus moves to the middle of each cell [C, k]."""
    _, jacobian = posterior.residuals_and_jacobian(best[None])
    precision, rest = _precision(jacobian, EVEN_STD)[0], _rest(len(best))
    slope = -np.linalg.solve(precision[np.ix_(rest, rest)], precision[rest, MODULUS])
    slid = np.tile(best, (CELLS, 1))
    slid[:, MODULUS] = MIDDLES
    slid[:, rest] += slope * (MIDDLES - best[MODULUS])[:, None]
    return slid


def _in_soft_tissue(start: Array) -> Array:
    soft = start.copy()
    soft[:, TISSUE] = SOFT
    return soft


def _large_and_shallow(best: Array) -> Array:
    """Return one start in each cell [C, k], nuisances in their middle, the presses off the axis as in the best fit."""
    start = np.zeros((CELLS, len(best)))
    start[:, [SIZE, DEPTH]], start[:, MODULUS], start[:, OFFSET:] = LARGE_AND_SHALLOW, MIDDLES, best[OFFSET:]
    return start


def _left(posterior: Explained, at: Array) -> Array:
    """Return what fits at coordinates [n, k] leave unexplained [n], as `best_fits` counts it."""
    return np.asarray(np.sum(posterior.residuals(at) ** 2, axis=1) + np.sum(at**2, axis=1) / EVEN_STD**2)


def _rest(dimensions: int) -> NDArray[np.bool_]:
    """Return which coordinates [k] are not the modulus."""
    return np.asarray(np.arange(dimensions) != MODULUS)


def _precision(jacobian: Array, range_std: float) -> Array:
    """Return the inverse covariances [n, k, k] of a Gaussian posterior: of the presses, and of the ranges."""
    return np.asarray(jacobian.transpose(0, 2, 1) @ jacobian + np.eye(jacobian.shape[2]) / range_std**2)
