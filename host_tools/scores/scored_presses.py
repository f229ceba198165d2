"""Answers to presses beside their truths, and the figures that say how good they are.

Where nothing stands out from noise, every mode says so and gives no numbers. Presses in which nothing does by the
design's noise are left out for all who answer, so that they answer the same ones. A commissioned probe believes in more
than noise: what it says of faint ones is no answer, and counts as none where it is held against a probe known exactly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.parameters import denormalise_unknowns, normalise
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.commissioned.own_answers import OwnAnswers
from device.measurement.ramp_modes.estimate import stands_out
from device.measurement.ramp_modes.model import CriticalValues, RampModel
from host_tools.commissioning.joint_fit import (
    FLAT_FIELD_RATIO,
    USUAL_MODEL_RATIO,
    Design,
    levels_on_skin,
    tolerances_only,
)
from host_tools.commissioning.left_out import CheckedAnswer, checked_answer
from host_tools.pages.benchmark import Benchmark, at_least
from host_tools.press_models.mode_outcome import EvaluatedPresses, evaluated
from host_tools.press_models.recorded_presses import in_parallel
from host_tools.scores.foreign_presses import ForeignPresses

FIGURES = (
    "stand out", "answered", "refused", "size covered", "depth covered", "determined size covered",
    "determined depth covered", "both covered", "joint region holds", "size, depth determined", "E determined",
    "size RMSE (mm)", "depth RMSE (mm)", "size bias (mm)", "depth bias (mm)", "median misfit",
)  # fmt: skip
"""An unknown that is not determined has its whole range as an interval, which covers; so those determined stand apart.

Of those that stand out by the noise of who answers: "answered", and "refused", their share that is not. "Both covered"
is the rectangle of the two intervals; the joint region is that of `joint_region`.
"""


@dataclass(frozen=True, eq=False)
class ScoredPresses:
    """Answers to presses in which something stands out by the design's noise: in coordinates, and misfit [n].

    `stands_out` [n]: where something does so by the noise of who answers. `is_answered` [n]: which of these are not
    refused. `number` [n]: which of the presses that were taken.
    """

    evaluated: EvaluatedPresses
    misfit_ratio: Array
    stands_out: NDArray[np.bool_]
    is_answered: NDArray[np.bool_]
    number: NDArray[np.intp]

    def share_answered(self) -> float:
        """Return the share answered of what stands out to who answers; none of nothing."""
        return float(self.is_answered[self.stands_out].mean()) if self.stands_out.any() else 0.0

    def error_mm(self) -> Array:
        """Return errors of size and depth [n, 2] of what is answered (mm)."""
        mean, truth = (denormalise_unknowns(one) for one in (self.evaluated.mean, self.evaluated.truth))
        return np.asarray((mean - truth)[self.is_answered, :2])

    def covered(self) -> NDArray[np.bool_]:
        """Return whether intervals of size and depth hold [n, 2] of what is answered."""
        return self.evaluated.is_covered[self.is_answered, :2]

    def determined(self) -> NDArray[np.bool_]:
        """Return which unknowns are determined [n, 3] of what is answered."""
        return self.evaluated.is_known[self.is_answered]

    def determined_covered(self) -> Array:
        """Return the share of determined sizes and depths [2] whose intervals hold; NaN where none is determined."""
        known, covered = self.determined()[:, :2], self.covered()
        count = known.sum(axis=0)
        return np.where(count > 0, (known & covered).sum(axis=0) / np.maximum(count, 1), np.nan)

    def region_holds(self) -> float:
        """Return the share of joint regions that hold, of what is answered; NaN in a mode without a posterior."""
        held = self.evaluated.in_region
        return float(np.mean(held[self.is_answered, 0])) if held is not None and self.is_answered.any() else np.nan

    def youngs_modulus_kpa(self) -> Array:
        """Return the true modulus [n] of each press."""
        return np.asarray(denormalise_unknowns(self.evaluated.truth)[:, UNKNOWNS.index("youngs_modulus_kpa")])

    def part(self, chosen: NDArray[Any]) -> ScoredPresses:
        """Return some of the presses, by a mask or by places."""
        others = [field.name for field in fields(self)][1:]
        return ScoredPresses(self.evaluated.part(chosen), *(getattr(self, name)[chosen] for name in others))


def scored(
    answers: RampAnswers, model: RampModel, critical: CriticalValues, taken: ForeignPresses, jobs: int
) -> ScoredPresses:
    """Return the answers to presses or scans; `critical` says what is refused."""
    noise = model.answers.noise
    shown = np.array([i for i, one in enumerate(taken.seen) if any(stands_out(row, noise) for row in one.rows)], int)
    truth = normalise(taken.parameters[shown])[:, : len(UNKNOWNS)]

    def one(place: int) -> CheckedAnswer:
        return checked_answer(answers, model, critical, taken.seen[shown[place]])

    found = in_parallel(one, len(shown), jobs)
    return ScoredPresses(
        evaluated(truth, [one.answer for one in found]),
        np.array([one.answer.misfit_ratio for one in found]),
        np.array([one.stands_out for one in found], bool),
        np.array([one.has_numbers for one in found], bool),
        shown,
    )


def tolerant(design: Design) -> OwnAnswers:
    """Return what answers a probe of which nothing is known but its builder's tolerances."""
    levels = levels_on_skin(design.answers.noise.levels, FLAT_FIELD_RATIO, USUAL_MODEL_RATIO)
    noise = replace(design.answers.noise, levels=levels)
    return OwnAnswers(design.answers.surrogate, noise, tolerances_only(design.derivatives, levels))


def joined(parts: Sequence[ScoredPresses]) -> ScoredPresses:
    """Return the answers of several probes as one; numbers stay those of each."""
    names = [field.name for field in fields(EvaluatedPresses) if getattr(parts[0].evaluated, field.name) is not None]
    whole = {name: np.concatenate([getattr(one.evaluated, name) for one in parts]) for name in names}
    others = [field.name for field in fields(ScoredPresses)][1:]
    return ScoredPresses(
        EvaluatedPresses(**whole), *(np.concatenate([getattr(one, name) for one in parts]) for name in others)
    )


def paired(found: ScoredPresses, others: ScoredPresses) -> tuple[ScoredPresses, ScoredPresses]:
    """Return the presses that are in both, in one order: the same number is the same press."""
    _, mine, theirs = np.intersect1d(found.number, others.number, return_indices=True)
    return found.part(mine), others.part(theirs)


def covered_at_least(case: str, found: ScoredPresses, bound: float) -> list[Benchmark]:
    """Return how often intervals of determined sizes and depths hold; of one that is never determined nothing.

    What is not determined has its whole range as an interval: counting that would reward who determines less.
    """
    shares = zip(UNKNOWNS[:2], map(float, found.determined_covered()), strict=True)
    return [at_least(case, f"{name} covered, determined", share, bound) for name, share in shares if share == share]


def figures_of(found: ScoredPresses) -> tuple[str, ...]:
    """Return the cells under `FIGURES`, empty where nothing is answered."""
    shown, answered = int(found.stands_out.sum()), int(found.is_answered.sum())
    if not shown:
        return ("0", *[""] * (len(FIGURES) - 1))
    misfits = found.misfit_ratio[found.stands_out]
    misfit = "" if np.isnan(misfits).all() else f"{np.median(misfits):.2f}"
    counts = (f"{shown}", f"{answered}", f"{100 * (1 - answered / shown):.0f} %")
    if not answered:
        return (*counts, *[""] * (len(FIGURES) - len(counts) - 1), misfit)
    error, covered, known = found.error_mm(), found.covered(), found.determined()
    shares = (
        *covered.mean(axis=0), *found.determined_covered(), covered.all(axis=1).mean(), found.region_holds(),
        known[:, :2].all(axis=1).mean(), known[:, 2].mean(),
    )  # fmt: skip
    return (
        *counts,
        *("" if np.isnan(share) else f"{100 * share:.0f} %" for share in shares),
        *(f"{one:.2f}" for one in np.sqrt((error**2).mean(axis=0))),
        *(f"{one:+.2f}" for one in error.mean(axis=0)),
        misfit,
    )
