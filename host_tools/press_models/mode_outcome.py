"""What a mode makes of presses nobody has learned from: answers, belts of its intervals, coverage, and critical values.

Belts come from one half of the simulated presses and are counted on the other. The critical value of each rejection
comes from recordings, because only they hold all that a recording does to a profile; so does a factor that widens the
belts where recordings need it, from one half of them; coverage is counted on the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.measurement.confidence_belt import Belt
from device.measurement.mode import Mode
from device.measurement.parameters import normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.ellipticity import EllipticityTest
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.model import RampAnswer, RampAnswers
from device.measurement.ramp_modes.noise import PressNoise
from host_tools.press_models.confidence_belts import confidence_belts, widened
from host_tools.press_models.noisy_presses import PressSet
from host_tools.press_models.recorded_presses import RecordedPresses, in_parallel
from host_tools.press_models.train_ensemble import DenseEnsemble
from host_tools.press_models.train_range import RangeNetwork

CRITICAL_RATIO = 0.9875
"""Share of all recorded presses inside the trained ranges whose misfit is below its critical value, and likewise the
elongation; of the nine in ten in which an inclusion stands out, share of those whose odds of a size or depth outside
do. What is left of the 5 % of false flags is for chance: with so many recordings their share is known to half a
per cent."""
THREE = len(UNKNOWNS)
EnsembleNetworks = Callable[[Array], tuple[Array, Array]]


@dataclass(frozen=True, eq=False)
class EvaluatedPresses:
    """Truth, mean and spread [n, 3] of presses, in coordinates."""

    truth: Array
    mean: Array
    spread: Array

    def part(self, chosen: slice) -> EvaluatedPresses:
        """Return some of the presses."""
        return EvaluatedPresses(self.truth[chosen], self.mean[chosen], self.spread[chosen])

    def covered(self, belts: tuple[Belt, ...]) -> tuple[Array, Array]:
        """Return, as booleans [n, 3], whether each interval holds the truth, and whether it narrows the range down."""
        intervals = [
            [one.interval(float(m), float(s)) for one, m, s in zip(belts, mean, spread, strict=True)]
            for mean, spread in zip(self.mean, self.spread, strict=True)
        ]
        low, high, known = np.moveaxis(np.array(intervals), 2, 0)
        return (low <= self.truth) & (self.truth <= high), known.astype(bool)


@dataclass(frozen=True, eq=False)
class ModeOutcome:
    """Belts and critical values of a mode; `simulated` presses that the belts have not seen, and `recorded` ones."""

    belts: tuple[Belt, ...]
    misfit_ratio: float
    elongation_deviations: float
    outside_log_odds: float
    simulated: EvaluatedPresses
    recorded: EvaluatedPresses


def evaluate_mode(
    mode: Mode,
    ensemble: DenseEnsemble,
    answers: RampAnswers,
    evaluation_set: PressSet,
    recorded: RecordedPresses,
    ellipticity: EllipticityTest,
    *,
    outside_log_odds: float,
    seed: int,
    jobs: int = -1,
) -> ModeOutcome:
    """Return the outcome of a mode on an evaluation set with noise and on recorded presses."""
    rows = evaluation_set.noisy(np.arange(len(evaluation_set.rows)), np.random.default_rng([seed, 1])).astype(
        np.float64
    )
    truth = evaluation_set.normalised[:, :THREE].astype(np.float64)
    simulated = EvaluatedPresses(truth, *(_evaluated(mode, ensemble, answers, rows, jobs)))
    half = len(rows) // 2
    seen = simulated.part(slice(half))
    belts = confidence_belts(seen.truth, seen.mean, seen.spread)
    found = answers_to(mode, ensemble.estimate, answers, recorded.rows, jobs)
    elongation = elongations(ellipticity, recorded, found, mode)
    return outcome_of(belts, simulated.part(slice(half, None)), recorded, found, elongation, outside_log_odds)


def elongations(
    ellipticity: EllipticityTest, recorded: RecordedPresses, found: Sequence[RampAnswer], mode: Mode
) -> Array:
    """Return by how many standard deviations [n] recorded presses are not as round as their best fits."""
    pairs = zip(recorded.second_harmonics, found, strict=True)
    return np.array([ellipticity.elongation_deviations(second, answer.best, mode) for second, answer in pairs])


def critical_log_odds(ranges: RangeNetwork, rows: Array, noise: PressNoise) -> float:
    """Return the critical log odds of recorded presses, rows [n, P], in which an inclusion stands out.

    Raises `InvalidQuantity` where it stands out in none.
    """
    seen = rows[[stands_out(row, noise) for row in rows]]
    require("presses in which an inclusion stands out", len(seen), Bound(1, np.inf, "presses"), "record more presses")
    return float(np.quantile(ranges.log_odds(seen), CRITICAL_RATIO))


def outcome_of(
    belts: tuple[Belt, ...],
    simulated: EvaluatedPresses,
    recorded: RecordedPresses,
    found: Sequence[RampAnswer],
    elongation: Array,
    outside_log_odds: float,
) -> ModeOutcome:
    """Return the outcome of a mode: belts of simulated presses, answers to recorded ones and their elongation [n]."""
    usual = slice(len(found) // 2)
    evaluated = EvaluatedPresses(
        normalise(recorded.parameters)[:, :THREE],
        np.array([answer.mean for answer in found]),
        np.array([answer.spread for answer in found]),
    )
    seen = evaluated.part(usual)
    misfit = [answer.misfit_ratio for answer in found]
    return ModeOutcome(
        widened(belts, seen.truth, seen.mean, seen.spread),
        float(np.quantile(misfit, CRITICAL_RATIO)),
        float(np.quantile(elongation, CRITICAL_RATIO)),
        outside_log_odds,
        simulated,
        evaluated.part(slice(usual.stop, None)),
    )


def answers_to(
    mode: Mode, networks: EnsembleNetworks, answers: RampAnswers, rows: Array, jobs: int
) -> list[RampAnswer]:
    """Return what a mode makes of rows [n, P] for which `networks` give mean and spread, best fit and all."""
    mean, spread = networks(rows)
    return in_parallel(lambda i: answers.answer(rows[i], mode, mean[i], spread[i]), len(rows), jobs)


def _evaluated(
    mode: Mode, ensemble: DenseEnsemble, answers: RampAnswers, rows: Array, jobs: int
) -> tuple[Array, Array]:
    """Return mean and spread [n, 3]; mode standard needs no fit for them."""
    if mode == "standard":
        return ensemble.estimate(rows)
    found = answers_to(mode, ensemble.estimate, answers, rows, jobs)
    return np.array([answer.mean for answer in found]), np.array([answer.spread for answer in found])
