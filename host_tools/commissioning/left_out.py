"""Phantoms as if they were patients: each is answered by a probe that was commissioned without it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.files.bundle_file import read_range_classifier
from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, denormalise_unknowns
from device.measurement.ramp_modes.answers import RampAnswer, RampAnswers
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.estimate import rejections, stands_out
from device.measurement.ramp_modes.intervals import CHI_SQUARE_90
from device.measurement.ramp_modes.model import CriticalValues, RampModel, found_values
from device.measurement.ramp_modes.radial_profile import SeenPresses
from device.measurement.ramp_modes.range_classifier import OWN_ENTRY, OWN_RANGE_FILE, RangeClassifier
from host_tools.commissioning.joint_fit import Design, ProbeFit, fit_probe, on_castings
from host_tools.commissioning.phantom_ramps import PhantomRamp
from host_tools.press_models.mode_outcome import Guess
from host_tools.press_models.recorded_presses import in_parallel

ASIDE = 0.95
"""A ramp that lies further off the axis than this part of a single press's reach is answered within that of a scan."""


@dataclass(frozen=True, eq=False)
class LeftOut:
    """A phantom answered as unknown: truth, estimate and interval [3] in the unknowns' own units, and its misfit.

    `tolerance` [3]: one standard deviation of the truth, as it is stated.
    """

    name: str
    truth: Array
    tolerance: Array
    value: Array
    low: Array
    high: Array
    is_determined: NDArray[np.bool_]
    misfit_ratio: float

    @property
    def halves_away(self) -> Array:
        """How far each truth [3] lies from the answer, over half of the interval and of what is known of the truth.

        Both are wrong on their own, and add up as squares.
        """
        away, known = self.truth - self.value, np.sqrt(CHI_SQUARE_90) * self.tolerance
        half = np.where(away > 0, self.high - self.value, self.value - self.low)
        return np.asarray(np.abs(away) / np.maximum(np.hypot(half, known), np.finfo(float).tiny))

    @property
    def is_covered(self) -> NDArray[np.bool_]:
        """Whether each interval [3] holds the truth, as far as that is known."""
        return np.asarray(self.halves_away <= 1)

    @property
    def farthest(self) -> float:
        """How far the farther of the size and depth that are determined lies from its answer, as `halves_away`."""
        return float(self.halves_away[:2][self.is_determined[:2]].max(initial=0.0))


def answers_of(design: Design, fit: ProbeFit) -> OwnAnswers:
    """Return what answers presses of a probe of which commissioning has found this."""
    noise = replace(design.answers.noise, levels=fit.levels)
    return OwnAnswers(design.answers.surrogate, noise, fit.own_probe(design.derivatives))


def left_out(
    ramps: Sequence[PhantomRamp], design: Design, guess: Guess, fit: ProbeFit, jobs: int = -1
) -> list[LeftOut]:
    """Return how each phantom with an inclusion is answered by a probe commissioned on the others.

    `guess` says of rows where a fit may begin. All ramps of a phantom are left out with it. The sizes of all errors
    stay those of all phantoms, of which it is one: chosen anew without it they were the same in fourteen of fifteen
    cases (of worlds 2 and 7 of `host_tools worlds`), and took six times as long. In the other one the misfit was 1.19
    instead of 1.12, and both truths were covered either way. `fit` is that of all ramps; it also says which of them lie
    further aside than a single press of a patient may.
    """
    chosen = [number for number, ramp in enumerate(ramps) if ramp.has_inclusion]

    def answered(place: int) -> LeftOut:
        ramp = ramps[chosen[place]]
        others = [one for one in ramps if one.name != ramp.name]
        answers = answers_of(design, fit_probe(others, design, fit.believed))
        return answered_alone(ramp, answers, guess, float(fit.offset_mm[chosen[place]]))

    return in_parallel(answered, len(chosen), jobs)


def answered_alone(ramp: PhantomRamp, answers: OwnAnswers, guess: Guess, offset_mm: float) -> LeftOut:
    """Return the answer to a ramp; to one recorded further aside than a single press may lie as to one of a scan."""
    of_phantoms = OwnAnswers(answers.surrogate, answers.noise, on_castings(answers.own))
    estimates = guess(ramp.seen.rows - of_phantoms.ordinary_shift(ramp.seen.rows))
    reach_mm = of_phantoms.reach_mm(1)
    if offset_mm > ASIDE * reach_mm:
        reach_mm = of_phantoms.surrogate.to_mm
    answer = of_phantoms.answer_to(ramp.seen, estimates, reach_mm)
    low, high = (denormalise_unknowns(ends) for ends in answer.intervals[:2])
    truth, value = denormalise_unknowns(ramp.stated[:COUNT]), denormalise_unknowns(answer.mean)
    tolerance = denormalise_unknowns((ramp.stated + ramp.std)[:COUNT]) - truth
    return LeftOut(ramp.name, truth, tolerance, value, low, high, answer.intervals.is_identifiable, answer.misfit_ratio)


def covered(phantoms: Sequence[LeftOut]) -> NDArray[np.bool_]:
    """Return whether each determined size and depth of phantoms left out is in its interval.

    What is not determined has its whole range as an interval, which covers: it counts neither way.
    """
    known = np.array([one.is_determined[:2] for one in phantoms])
    return np.asarray(np.array([one.is_covered[:2] for one in phantoms])[known])


def missed(phantoms: Sequence[LeftOut], halves: float = 1.0) -> list[str]:
    """Return the names of phantoms of which a determined size or depth is more than so many halves away in any ramp."""
    return list(dict.fromkeys(one.name for one in phantoms if one.farthest > halves))


def exchanged(phantoms: Sequence[LeftOut], halves: float) -> Iterator[tuple[str, str]]:
    """Yield each two phantoms that both are more than so many halves away, and neither once truths are exchanged.

    Wrong truths move the fit of the others: exchanged back they need not be covered.
    """
    for names in combinations(missed(phantoms, halves), 2):
        first, second = ([one for one in phantoms if one.name == name] for name in names)
        swapped = [
            replace(one, truth=other.truth, tolerance=other.tolerance)
            for ramps, other in ((first, second[0]), (second, first[0]))
            for one in ramps
        ]
        if not missed(swapped, halves):
            yield names


def told_blocks(
    ramps: Sequence[PhantomRamp], answers: OwnAnswers, model: RampModel, critical: CriticalValues
) -> list[str]:
    """Return the names of the bare blocks in which the probe tells of an inclusion.

    Of a block the fit reads the reference response alone: its contrast and harmonics have taught nothing.
    """
    of_castings = OwnAnswers(answers.surrogate, answers.noise, on_castings(answers.own))
    blocks = [ramp for ramp in ramps if not ramp.has_inclusion]
    return [ramp.name for ramp in blocks if checked_answer(of_castings, model, critical, ramp.seen).has_numbers]


def log_odds_of(answers: RampAnswers, model: RampModel) -> Callable[[Array], Array]:
    """Return what tells the ranges of the presses that `answers` answer, of the design's `model` or a probe's own.

    Raises `BundleRefused` where the design's bundle lacks the networks for commissioned probes (`own_range`).
    """
    is_of_design = not isinstance(model.answers, OwnAnswers)
    if isinstance(answers, OwnAnswers) and is_of_design:
        return _own_ranges(model.bundle.folder).log_odds
    return model.ranges.log_odds


@lru_cache(maxsize=4)
def _own_ranges(folder: Path) -> RangeClassifier:
    return read_range_classifier(folder, OWN_RANGE_FILE, OWN_ENTRY)


class CheckedAnswer(NamedTuple):
    """An answer to one press or scan, whether a limit refuses it, and whether an inclusion stands out.

    It does from the noise, and where hand and skin may be other than the design's from what these make: a probe that
    believes in more of both says sooner that nothing stands out.
    """

    answer: RampAnswer
    is_refused: bool
    stands_out: bool

    @property
    def has_numbers(self) -> bool:
        """Whether the probe shows numbers: as on its screen, a faint press has none either."""
        return self.stands_out and not self.is_refused


def checked_answer(
    answers: RampAnswers, model: RampModel, critical: CriticalValues, seen: SeenPresses
) -> CheckedAnswer:
    """Return the answer to what was read of a press or scan; `critical` says what is refused."""
    answer = answer_to_seen(answers, model.first_guesses, seen)
    found = found_values(answer, seen, answers, log_odds_of(answers, model))
    shown = any(stands_out(row, answers.noise) for row in seen.rows)
    return CheckedAnswer(answer, bool(rejections(found, critical)), shown and answer.needs_inclusion)


def answer_to_seen(answers: RampAnswers, guess: Guess, seen: SeenPresses) -> RampAnswer:
    """Return the answer to one press or scan, begun at the design's guess of what a press of its own would show."""
    return answers.answer_to(seen, guess(seen.rows - answers.ordinary_shift(seen.rows)))
