"""Presses drawn from what is believed of a probe: how they are answered, and what its modes are worth.

They are as commissioning believes in probe, hand and noise. So they show what that belief allows, and not whether it is
true: that is what phantoms left out are for.
"""

from __future__ import annotations

import os
import platform
import time
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.mode import FRAMES, Mode
from device.measurement.parameters import denormalise_unknowns, normalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.own_answers import UNEVEN_RATIOS, OwnAnswers
from device.measurement.ramp_modes.commissioned.own_posterior import seen_with_noise, to_bright_side
from device.measurement.ramp_modes.commissioned.own_probe import Place, turned_columns
from device.measurement.ramp_modes.model import CriticalValues, RampModel
from device.measurement.ramp_modes.radial_profile import RESPONSE, SeenPresses
from device.measurement.ramp_modes.surrogate import DEPTH, OFFSET, SIZE
from host_tools.commissioning.left_out import CheckedAnswer, checked_answer
from host_tools.press_models.mode_outcome import EvaluatedPresses, evaluated
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.ramp_training import further_offsets_mm
from host_tools.press_models.recorded_presses import in_parallel


@dataclass(frozen=True, eq=False)
class BelievedAnswers:
    """Answers to presses or scans of so many `ramps` [n], which of them have numbers [n], and what each took (s) [n].

    The time is the answering thread's, without the reading of its frames.
    """

    evaluated: EvaluatedPresses
    ramps: NDArray[np.intp]
    is_answered: NDArray[np.bool_]
    seconds: Array

    @property
    def answered(self) -> EvaluatedPresses:
        """Return the answers of what has numbers."""
        return self.evaluated.part(self.is_answered)

    @property
    def as_shown(self) -> EvaluatedPresses:
        """Return all answers; of what has no numbers an interval is the whole range."""
        nothing = ~self.is_answered[:, None]
        low, high = (
            np.where(nothing, end, one) for end, one in ((-1.0, self.evaluated.low), (1.0, self.evaluated.high))
        )
        return replace(self.evaluated, low=low, high=high, is_known=self.evaluated.is_known & ~nothing)


def believed_presses(
    answers: OwnAnswers, count: int, seed: int, *, are_scans: bool = False, are_inclusion_free: bool = False
) -> tuple[list[SeenPresses], Array]:
    """Return what is seen of presses or scans drawn from what is believed, and their coordinates [n, 9]."""
    rng = np.random.default_rng(seed)
    truth = normalise(draw_parameters(count, rng))
    truth = inclusion_free(truth) if are_inclusion_free else truth
    further = further_offsets_mm(count, rng) if are_scans else [np.zeros(0)] * count
    return [_drawn(answers, at, mm, rng) for at, mm in zip(truth, further, strict=True)], truth


def inclusion_free(normalised: Array) -> Array:
    """Return coordinates [n, 9] with the smallest inclusion at the largest depth, which nobody sees."""
    at = np.array(normalised)
    at[:, SIZE], at[:, DEPTH] = -1.0, 1.0
    return at


def _drawn(answers: OwnAnswers, at: Array, further_mm: Array, rng: np.random.Generator) -> SeenPresses:
    """Return one press or scan that is as believed."""
    seen, direction_rad = without_noise(answers, at, further_mm, rng)
    return to_bright_side(seen_with_noise(seen, answers.noise, rng), direction_rad)


def without_noise(answers: OwnAnswers, at: Array, further_mm: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return what is seen [N, S] of one press or scan that is as believed, but for noise, and its directions [N].

    `at` are coordinates [9], of a press whose further ones lie at offsets `further_mm` [N - 1].
    """
    each = np.tile(at, (1 + len(further_mm), 1))
    each[1:, OFFSET] = further_mm - 1
    direction_rad = rng.uniform(0, 2 * np.pi, len(each))
    rows = answers.surrogate.rows(each, direction_rad)
    rows[1:, RESPONSE] = rows[0, RESPONSE]
    seen = moved(answers, Place(each, np.zeros(len(each)), direction_rad), rows, rng)
    seen[1:, RESPONSE] = seen[0, RESPONSE]
    return seen, direction_rad


def moved(answers: OwnAnswers, place: Place, rows: Array, rng: np.random.Generator) -> Array:
    """Return what is seen [N, S] of rows [N, P] of presses with one reference, by a probe and a hand as believed.

    In tissue as uneven as any that is weighed, each as often; a casting's is even.
    """
    ratios = UNEVEN_RATIOS if answers.own.may_be_uneven else UNEVEN_RATIOS[:1]
    own = replace(answers.own, uneven_ratio=float(rng.choice(ratios)))
    straight, changes = turned_columns(rows, 0.0), own.changes(place, rows)
    drawn = rng.standard_normal(changes.factor.shape[2])
    leaning = straight + changes.shift + changes.factor @ drawn
    changes = own.changes(place, rows, leaning)  # how far each leans tells what its tilts' squares do
    return np.asarray(straight + changes.shift + changes.factor @ drawn)


def believed_answers(
    answers: OwnAnswers,
    model: RampModel,
    critical: CriticalValues,
    count: int,
    seed: int,
    *,
    jobs: int,
    are_scans: bool = False,
) -> BelievedAnswers:
    """Return the answers to presses or scans drawn from what is believed; `critical` says which are refused.

    As on the probe, those in which nothing stands out from its noise have no numbers either.
    """
    seen, truth = believed_presses(answers, count, seed, are_scans=are_scans)

    def timed(number: int) -> _TimedAnswer:
        began = time.thread_time()  # another process that has the core does not count
        found = checked_answer(answers, model, critical, seen[number])
        return _TimedAnswer(found, time.thread_time() - began)

    found = in_parallel(timed, count, jobs)
    return BelievedAnswers(
        evaluated(truth[:, : len(UNKNOWNS)], [one.found.answer for one in found]),
        np.array([len(one.rows) for one in seen], np.intp),
        np.array([one.found.has_numbers for one in found], bool),
        np.array([one.seconds for one in found]),
    )


class _TimedAnswer(NamedTuple):
    found: CheckedAnswer
    seconds: float


def believed_dial(mode: Mode, found: BelievedAnswers) -> dict[str, Any]:
    """Return what a probe's card says of speed and accuracy of a mode, of scans of the fewest ramps it answers.

    The entry has what the daemon reads of the design's (`host_tools.scores.dial`), which is measured on recordings.
    Shares and errors are of what has numbers. Returns {} where that is none of them: then nothing is known.
    """
    fewest = found.ramps == FRAMES[mode].fewest_ramps
    answered = found.evaluated.part(fewest & found.is_answered)
    if not len(answered.truth):
        return {}
    truth, mean = denormalise_unknowns(answered.truth), denormalise_unknowns(answered.mean)
    error, known = np.median(100 * np.abs(mean / truth - 1), axis=0), answered.is_known.mean(axis=0)
    return {
        "presses": int(fewest.sum()),
        "answered": len(truth),
        "frames": FRAMES[mode].count * FRAMES[mode].fewest_ramps,
        "compute_ms": round(1e3 * float(np.median(found.seconds[fewest])), 1),
        "machine": f"{platform.machine()}, {os.cpu_count()} cores",
        "median_percent": {name: round(float(one), 2) for name, one in zip(UNKNOWNS, error, strict=True)},
        "determined": {name: round(float(one), 4) for name, one in zip(UNKNOWNS, known, strict=True)},
    }
