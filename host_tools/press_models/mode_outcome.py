"""What a mode makes of presses nobody has learned from: answers, whether their intervals hold, and critical values.

The critical value of each rejection comes from recordings, because only they hold all that a recording does to a
profile.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import normalise
from device.measurement.quantities import UNKNOWNS, Bound, require
from device.measurement.ramp_modes.answers import RampAnswer, RampAnswers
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.model import CriticalValues, found_values
from device.measurement.ramp_modes.posterior import TOGETHER
from host_tools.press_models.recorded_presses import RecordedPresses, in_parallel

CRITICAL_RATIO = 0.99
"""Share of all recorded presses inside the trained ranges whose misfit is below its critical value, and likewise the
elongation and how far the tissue lies from the middle of its range; of the nine in ten in which an inclusion stands
out, share of those whose odds of a size or depth outside do. What is left of the 5 % of false flags is for chance: with
so many recordings their share is known to half a per cent."""
THREE = len(UNKNOWNS)
Guess = Callable[[Array], Array]
"""Rows [N, P] to first guesses [n, 3] of the unknowns' coordinates."""


@dataclass(frozen=True, eq=False)
class EvaluatedPresses:
    """Truth, mean and both ends of the interval [n, 3] of presses, in coordinates, and what is determined [n, 3].

    `in_region` [n, 2]: whether the truth lies in the joint region of each of `TOGETHER`; None of a mode without any.
    """

    truth: Array
    mean: Array
    low: Array
    high: Array
    is_known: NDArray[np.bool_]
    in_region: NDArray[np.bool_] | None = None

    def part(self, chosen: slice | NDArray[Any]) -> EvaluatedPresses:
        """Return some of the presses, by a slice, a mask or places."""
        truth, mean, low, high = (part[chosen] for part in (self.truth, self.mean, self.low, self.high))
        in_region = None if self.in_region is None else self.in_region[chosen]
        return EvaluatedPresses(truth, mean, low, high, self.is_known[chosen], in_region)

    @property
    def is_covered(self) -> NDArray[np.bool_]:
        """Whether each interval [n, 3] holds the truth."""
        return np.asarray((self.low <= self.truth) & (self.truth <= self.high))


@dataclass(frozen=True, eq=False)
class ModeOutcome:
    """Critical values of a mode, and what it makes of `simulated` presses, of so many `ramps` [n], and of recorded."""

    critical: CriticalValues
    simulated: EvaluatedPresses
    recorded: EvaluatedPresses
    ramps: NDArray[np.intp]


def answers_to(
    answers: RampAnswers, guess: Guess, rows: Sequence[Array], direction_rad: Sequence[Array], jobs: int
) -> list[RampAnswer]:
    """Return the answers to presses or scans, rows [N, P] and directions [N] of each."""
    return in_parallel(lambda i: answers.answer(rows[i], guess(rows[i]), direction_rad[i]), len(rows), jobs)


def evaluated(truth: Array, found: Sequence[RampAnswer]) -> EvaluatedPresses:
    """Return answers beside their truths, coordinates [n, 3]."""
    intervals = [answer.intervals for answer in found]
    return EvaluatedPresses(
        truth,
        np.array([answer.mean for answer in found]).reshape(-1, THREE),
        np.array([one.low for one in intervals]).reshape(-1, THREE),
        np.array([one.high for one in intervals]).reshape(-1, THREE),
        np.array([one.is_identifiable for one in intervals], bool).reshape(-1, THREE),
        np.array([_in_regions(*pair) for pair in zip(truth, found, strict=True)], bool).reshape(-1, len(TOGETHER)),
    )


def _in_regions(truth: Array, answer: RampAnswer) -> list[bool]:
    """Return whether a truth [3] lies in each joint region; where a press tells nothing that is the whole range."""
    if not answer.fit.regions:
        return [True] * len(TOGETHER)
    return [region.holds(truth[:count]) for count, region in zip(TOGETHER, answer.fit.regions, strict=True)]


def outcome_of(
    simulated: EvaluatedPresses,
    recorded: RecordedPresses,
    found: Sequence[RampAnswer],
    answers: RampAnswers,
    log_odds: Callable[[Array], Array],
    ramps: NDArray[np.intp],
) -> ModeOutcome:
    """Return the outcome of a mode from its answers to simulated presses, of so many ramps [n], and to recorded."""
    truth = normalise(recorded.parameters)[:, :THREE]
    return ModeOutcome(critical_values(recorded, found, answers, log_odds), simulated, evaluated(truth, found), ramps)


def critical_values(
    recorded: RecordedPresses,
    found: Sequence[RampAnswer],
    answers: RampAnswers,
    log_odds: Callable[[Array], Array],
) -> CriticalValues:
    """Return the critical values of recorded presses; those of the odds of presses in which an inclusion stands out.

    Raises `InvalidQuantity` where it stands out in none.
    """
    presses = list(zip(found, recorded.seen, strict=True))
    values = [asdict(found_values(*press, answers, log_odds)) for press in presses]
    seen = [any(stands_out(row, answers.noise) for row in rows) for rows in recorded.rows]
    require("presses in which an inclusion stands out", sum(seen), Bound(1, np.inf, "presses"), "record more presses")
    columns = {name: np.array([one[name] for one in values]) for name in values[0]}
    columns["outside_log_odds"] = columns["outside_log_odds"][seen]
    return CriticalValues(**{name: float(np.quantile(column, CRITICAL_RATIO)) for name, column in columns.items()})
