"""Answers to presses beside their truths, and the figures that say how good they are.

Only presses in which something stands out count: where nothing does, every mode says so and gives no numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import denormalise_unknowns, normalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.estimate import rejections, stands_out
from device.measurement.ramp_modes.model import CriticalValues, RampModel, found_values
from host_tools.commissioning.joint_fit import FLAT_FIELD_RATIO, MODEL_RATIOS, Design, tolerances_only
from host_tools.commissioning.left_out import answers_to_seen
from host_tools.press_models.mode_outcome import EvaluatedPresses, evaluated
from host_tools.scores.foreign_presses import ForeignPresses


@dataclass(frozen=True, eq=False)
class ScoredPresses:
    """Answers to presses in which something stands out: in coordinates, misfit [n], and which are not refused [n]."""

    evaluated: EvaluatedPresses
    misfit_ratio: Array
    is_answered: NDArray[np.bool_]

    def error_mm(self) -> Array:
        """Return errors of size and depth [n, 2] of what is answered (mm)."""
        mean, truth = (denormalise_unknowns(one) for one in (self.evaluated.mean, self.evaluated.truth))
        return np.asarray((mean - truth)[self.is_answered, :2])

    def covered(self) -> NDArray[np.bool_]:
        """Return whether intervals of size and depth hold [n, 2] of what is answered."""
        return self.evaluated.is_covered[self.is_answered, :2]


def scored(
    answers: RampAnswers, model: RampModel, critical: CriticalValues, taken: ForeignPresses, jobs: int
) -> ScoredPresses:
    """Return the answers to presses or scans; `critical` says what is refused."""
    noise = model.answers.noise
    shown = [number for number, one in enumerate(taken.seen) if any(stands_out(row, noise) for row in one.rows)]
    seen = [taken.seen[number] for number in shown]
    found = answers_to_seen(answers, model.first_guesses, seen, jobs)
    values = [found_values(*pair, answers, model.ranges.log_odds) for pair in zip(found, seen, strict=True)]
    return ScoredPresses(
        evaluated(normalise(taken.parameters[shown])[:, : len(UNKNOWNS)], found),
        np.array([one.misfit_ratio for one in found]),
        np.array([not rejections(one, critical) for one in values]),
    )


def tolerant(design: Design) -> OwnAnswers:
    """Return what answers a probe of which nothing is known but its builder's tolerances."""
    levels = replace(design.answers.noise.levels, flat_field_ratio=FLAT_FIELD_RATIO, model_ratio=MODEL_RATIOS[1])
    noise = replace(design.answers.noise, levels=levels)
    return OwnAnswers(design.answers.surrogate, noise, tolerances_only(design.derivatives, levels))


def joined(parts: Sequence[ScoredPresses]) -> ScoredPresses:
    """Return the answers of several probes as one."""
    of_all = [one.evaluated for one in parts]
    names = ("truth", "mean", "low", "high", "is_known")
    return ScoredPresses(
        EvaluatedPresses(*(np.concatenate([getattr(one, name) for one in of_all]) for name in names)),
        np.concatenate([one.misfit_ratio for one in parts]),
        np.concatenate([one.is_answered for one in parts]),
    )
