"""Simulated presses with noise to the belts behind every interval, one set for each unknown.

Bounds are quantiles of (truth - mean) / spread over the presses nearest in truth, in the logarithm of the spread, and
in the mean of another unknown: depths of the smallest and the largest inclusions are missed most. One held press does
not tell the modulus, and hard inclusions read too large and too shallow, soft ones the other way. So the quantiles are
taken in each octile of the modulus, and the belt holds those of all of them. A factor at every truth lets belts cover
other presses as often as promised there, and one factor more `LEAST_COVERAGE` of them in every octile of each unknown.
Recordings hold what the forward model and its noise do not know of: where these are covered less often than chance
explains, belts are widened by one factor. Sources: split conformal prediction, Lei et al., JASA 113, 2018; in groups,
Vovk, ACML 25, 2012; about a point, Guan, Biometrika 110, 2023.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.confidence_belt import BESIDE, COVERAGE, IDENTIFIABLE_RATIO, Belt, ends_in_belts
from device.measurement.parameters import EVEN_STD
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.surrogate import MODULUS
from host_tools.press_models.mode_outcome import EvaluatedPresses
from host_tools.press_models.mode_statistics import OCTILES, octile_of

TRUTHS, SPREADS, BESIDES = 17, 5, 5
TRUTH_LENGTH, BESIDE_LENGTH = 0.15, 0.3
"""Presses this far apart in truth, or in the mean beside it, are as unlike as those one standard deviation of the log
spread apart."""
FEWEST, MOST, NEIGHBOUR_RATIO = 60, 400, 0.12
"""Presses of which a bound is the quantile, and their share of an octile: 400 leave an error of 1.5 % of coverage."""
TAIL = 1.5 * (1 - COVERAGE)
"""Share of an octile's presses beyond either bound: most octiles have fewer, since the belt holds the bounds of all."""
AT_TRUTH, FEWEST_AT_TRUTH = 0.02, 300
"""Share of the presses, and how many at least, of which the factor at a truth is told."""
LEAST_COVERAGE = 1 - 1.3 * (1 - COVERAGE)
"""Of every octile of each unknown: 0.87 where 0.85 is promised (docs/modes.md), for chance."""
FOLDS = 4
"""Parts of the presses, each of which is covered by the belts of the others."""
RAREST_RATIO = 0.05
"""An unknown that fewer presses than this share determine is left undetermined: its belts could not be judged."""
NARROWEST = 1e-9
WIDE_OPEN = 1e6
"""So many spreads hold all of the range."""


@dataclass(frozen=True, eq=False)
class SpreadAnswers:
    """Truth, mean and spread [n, 3] of presses, in coordinates."""

    truth: Array
    mean: Array
    spread: Array

    def part(self, chosen: slice) -> SpreadAnswers:
        """Return some of the presses."""
        return SpreadAnswers(self.truth[chosen], self.mean[chosen], self.spread[chosen])

    def within(self, belts: tuple[Belt, ...]) -> EvaluatedPresses:
        """Return them with the intervals of belts."""
        ends = [ends_in_belts(mean, spread, belts) for mean, spread in zip(self.mean, self.spread, strict=True)]
        low, high, known = (np.array(part) for part in zip(*ends, strict=True))
        return EvaluatedPresses(self.truth, self.mean, low, high, known)


def confidence_belts(answers: SpreadAnswers) -> tuple[Belt, ...]:
    """Return belts for each unknown of answers to simulated presses.

    Only presses that determine an unknown count for it; where they are rare, the belts hold all of the range. Raises
    `InvalidQuantity` when they are not rare, but too few to learn from.
    """
    octiles = np.stack([octile_of(truth) for truth in answers.truth.T], axis=1)
    modulus = answers.truth[:, MODULUS]
    return tuple(_belt(_of_unknown(answers, number), octiles, modulus) for number in range(len(UNKNOWNS)))


class _Presses(NamedTuple):
    """Of one unknown: truth, mean and spread [n] of presses, and the mean [n] of the unknown beside it."""

    truth: Array
    mean: Array
    spread: Array
    beside: Array

    def part(self, chosen: NDArray[np.bool_]) -> _Presses:
        return _Presses(*(column[chosen] for column in self))


def _of_unknown(answers: SpreadAnswers, number: int) -> _Presses:
    truth, mean, spread = (column[:, number] for column in (answers.truth, answers.mean, answers.spread))
    return _Presses(truth, mean, spread, answers.mean[:, BESIDE[number]])


def _belt(presses: _Presses, octiles: NDArray[np.intp], modulus: Array) -> Belt:
    """Return the belt of presses in octiles [n, 3] of the unknowns, of true moduli [n].

    It is learned in octiles of the moduli that determine the unknown, and judged in those of all presses.
    """
    known = _determined(presses.spread)
    if known.mean() < RAREST_RATIO:
        return _wide_open()
    require("presses that determine an unknown", int(known.sum()), Bound(2 * FEWEST, np.inf, ""), "simulate more")
    presses, octiles, of_modulus = presses.part(known), octiles[known], octile_of(modulus[known])
    needed = _crossed(presses, of_modulus)
    belt = _learned(presses, of_modulus)
    at_truths = _at_truths(belt.truth, presses.truth, needed)
    return _scaled(belt, at_truths * _for_octiles(needed / np.interp(presses.truth, belt.truth, at_truths), octiles))


def _determined(spread: Array) -> NDArray[np.bool_]:
    return np.asarray(spread < IDENTIFIABLE_RATIO * EVEN_STD)


def _learned(presses: _Presses, octile: NDArray[np.intp]) -> Belt:
    """Return the widest quantiles that an octile of the modulus has; of presses that determine the unknown."""
    unusual, log_spread = (presses.truth - presses.mean) / presses.spread, np.log(presses.spread)
    truths = -np.cos(np.pi * np.arange(TRUTHS) / (TRUTHS - 1))  # closer to each other at the ends of the range
    spreads = _nodes(log_spread, SPREADS)
    besides = _nodes(presses.beside, BESIDES)
    scale = max(float(np.std(log_spread)), 1e-3)
    tables = []
    for chosen in (octile == number for number in range(OCTILES)):
        at_truth = (presses.truth[chosen] - truths[:, None]) / TRUTH_LENGTH
        at_spread = (log_spread[chosen] - spreads[:, None]) / scale
        at_beside = (presses.beside[chosen] - besides[:, None]) / BESIDE_LENGTH
        tables.append(_quantiles(at_truth, at_spread, at_beside, unusual[chosen]))
    low, high = np.moveaxis(np.array(tables), -1, 0)
    return Belt(truths, spreads, besides, low.min(axis=0), high.max(axis=0))


def _nodes(values: Array, count: int) -> Array:
    return np.quantile(values, np.linspace(0.02, 0.98, count))


def _quantiles(at_truth: Array, at_spread: Array, at_beside: Array, unusual: Array) -> Array:
    """Return the quantiles [A, B, C, 2] of the presses [n] nearest to each node, by their distances along each axis."""
    count = min(int(np.clip(NEIGHBOUR_RATIO * len(unusual), FEWEST, MOST)), len(unusual))
    tails = np.empty((len(at_truth), len(at_spread), len(at_beside), 2))
    for node in np.ndindex(tails.shape[:-1]):
        squares = at_truth[node[0]] ** 2 + at_spread[node[1]] ** 2 + at_beside[node[2]] ** 2
        near = unusual[np.argpartition(squares, count - 1)[:count]]
        tails[node] = np.quantile(near, (TAIL, 1 - TAIL), method="weibull")  # covers the share, of few too
    return tails


def _crossed(presses: _Presses, octile: NDArray[np.intp]) -> Array:
    """Return by which factor [n] belts of other presses must be widened to hold each one; they take turns."""
    fold, needed = np.arange(len(octile)) % FOLDS, np.empty(len(octile))
    for k in range(FOLDS):
        needed[fold == k] = _needed(_learned(presses.part(fold != k), octile[fold != k]), presses.part(fold == k))
    return needed


def _at_truths(truths: Array, truth: Array, needed: Array) -> Array:
    """Return the factors [A] that cover presses of truth [n] as often as promised about each of some truths [A]."""
    count = min(max(FEWEST_AT_TRUTH, int(AT_TRUTH * len(truth))), len(truth))
    near = np.argpartition(np.abs(truth - truths[:, None]), count - 1, axis=1)[:, :count]
    return np.maximum(np.quantile(needed[near], COVERAGE, axis=1), NARROWEST)


def _for_octiles(needed: Array, octiles: NDArray[np.intp]) -> float:
    """Return the factor that covers presses [n] as often as promised, and often enough in their octiles [n, 3].

    Those are of each unknown; one that hardly a press determines is not judged.
    """
    of_octiles = [needed[of_unknown == number] for of_unknown in octiles.T for number in range(OCTILES)]
    least = [np.quantile(of, LEAST_COVERAGE) for of in of_octiles if len(of) >= FEWEST]
    return float(max([np.quantile(needed, COVERAGE), *least]))


def _wide_open() -> Belt:
    ends = np.array([-1.0, 1.0])
    return Belt(ends, ends, ends, np.full((2, 2, 2), -WIDE_OPEN), np.full((2, 2, 2), WIDE_OPEN))


def widened(belts: tuple[Belt, ...], recorded: SpreadAnswers) -> tuple[Belt, ...]:
    """Return belts wide enough, about their middles, for answers to recorded presses.

    Wide enough is a coverage at most one standard error of chance below the promised one.
    """
    return tuple(_widened(belt, _of_unknown(recorded, number)) for number, belt in enumerate(belts))


def _widened(belt: Belt, presses: _Presses) -> Belt:
    known = _determined(presses.spread)
    if not known.any():
        return belt
    needed = _needed(belt, presses.part(known))
    factor = max(1.0, float(np.quantile(needed, max(COVERAGE - _by_chance(len(needed)), 0.0))))
    return _scaled(belt, np.full(len(belt.truth), factor))


def _needed(belt: Belt, presses: _Presses) -> Array:
    """Return by which factor [n] a belt must be widened to hold each press."""
    low, high = belt.bounds(presses.truth, presses.spread, presses.beside)
    unusual = (presses.truth - presses.mean) / presses.spread
    return np.asarray(np.abs(unusual - (low + high) / 2) / np.maximum((high - low) / 2, NARROWEST))


def _by_chance(presses: int) -> float:
    """Return the standard error of a coverage that is counted on so many presses."""
    return float(np.sqrt(COVERAGE * (1 - COVERAGE) / presses))


def _scaled(belt: Belt, factor: Array) -> Belt:
    """Return a belt widened about its middles by factors [A] at its truths."""
    middles, halves = (belt.low + belt.high) / 2, (belt.high - belt.low) / 2 * factor[:, None, None]
    return replace(belt, low=middles - halves, high=middles + halves)
