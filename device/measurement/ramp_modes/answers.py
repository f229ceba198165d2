"""One ramp or several to an answer, without any limit on answers: where to begin, the best fit, the posterior.

A network says where to begin; the fit says all else, also how badly one round inclusion explains the presses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, HIGH, LOW, denormalise, slope_of_normalised
from device.measurement.ramp_modes.fit import PressPosterior, best_fits
from device.measurement.ramp_modes.intervals import PressIntervals, intervals_of
from device.measurement.ramp_modes.misfit_blocks import Departure
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.posterior import PressFit, sample_press
from device.measurement.ramp_modes.radial_profile import SeenPresses
from device.measurement.ramp_modes.scan import scan_starts, worth_of_places
from device.measurement.ramp_modes.surrogate import OFFSET, TISSUE, ScanSurrogate

WELL_INSIDE = 0.95
"""A fit is begun no nearer to the ends of the ranges, where it would stick."""


@dataclass(frozen=True, eq=False)
class UnlikeDesign:
    """Of a press of a commissioned probe: what is believed to shift its row [P], and what to widen it, factor [P, K].

    `row` [P]: the best fit's without the shift; `second_across` [Q]: second harmonics across the bright side, with it.
    `skin_texture_ratio`: texture of the skin by which intervals are told, over the one that is believed.
    `uneven_ratio`: unevenness of the tissue by which all is told, of what may be.
    `inclusion_deviations`: the root of how much an inclusion lowers the squared residuals of all presses, beside hand,
    skin and tissue alone; more than `needed_deviations` say that there is one.
    """

    row: Array
    shift: Array
    factor: Array
    second_across: Array
    skin_texture_ratio: float = 1.0
    uneven_ratio: float = 0.0
    inclusion_deviations: float = np.inf
    needed_deviations: float = 0.0


@dataclass(frozen=True, eq=False)
class RampAnswer:
    """What one ramp or several tell.

    `misfit_ratio`: squared residuals of the best fit, each over its standard deviation, over their number.
    `nearest`: number of the press that lies nearest to the inclusion, and `best` the coordinates [9] of the best fit
    there. `tissue_kpa`: mean and spread of the tissue's modulus, which the press beside the lesion tells. `unlike`:
    what makes that press another than the forward model's, of a commissioned probe.
    """

    fit: PressFit
    intervals: PressIntervals
    misfit_ratio: float
    nearest: int
    best: Array
    tissue_kpa: tuple[float, float]
    unlike: UnlikeDesign | None = None

    @property
    def mean(self) -> Array:
        """Mean of the unknowns' coordinates [3]."""
        return self.fit.mean[:COUNT]

    @property
    def tissue_from_middle_ratio(self) -> float:
        """How far the tissue's modulus lies from the middle of its range, over half the range, by ratio; below 1.

        Of tissue outside the range the posterior crowds at the end, nearer than that of any tissue inside.
        """
        low_kpa, high_kpa = LOW[TISSUE], HIGH[TISSUE]
        return float(abs(np.log(self.tissue_kpa[0] ** 2 / (low_kpa * high_kpa))) / np.log(high_kpa / low_kpa))

    @property
    def needs_inclusion(self) -> bool:
        """Whether hand and skin alone do not explain the presses; those of the design's own probe are as believed."""
        return self.unlike is None or self.unlike.inclusion_deviations > self.unlike.needed_deviations

    @property
    def spread(self) -> Array:
        """Standard deviation of the unknowns' coordinates [3]."""
        return self.fit.spread[:COUNT]


class RampAnswers:
    """Forward model and noise: what answers, without any limit on its answers."""

    def __init__(self, surrogate: ScanSurrogate, noise: PressNoise) -> None:
        self.surrogate, self.noise = surrogate, noise

    @property
    def flat_field_ratio(self) -> float:
        """The level of smooth errors that two presses of a flat field are believed to differ by."""
        return self.noise.levels.flat_field_ratio

    def reach_mm(self, presses: int) -> float:
        """Return how far off the axis the inclusion may lie: further in a scan, whose presses are displaced."""
        return float(HIGH[OFFSET]) if presses == 1 else self.surrogate.to_mm

    def answer_to(self, seen: SeenPresses, estimates: Array) -> RampAnswer:
        """Return the answer to what was read of presses with one reference; `estimates` as of `answer`."""
        return self.answer(seen.rows, estimates, seen.direction_rad)

    def ordinary_shift(self, rows: Array) -> Array:
        """Return what is believed to move rows [n, P] of ordinary presses, before anything of them is known [n, P]."""
        return np.zeros_like(rows)

    def worth(self, seen: SeenPresses, answer: RampAnswer, places_mm: Sequence[float]) -> Array:
        """Return to which part [n, 3] a further press at each place narrows the unknowns' spreads."""
        at = self._with_reach(answer.fit.best, len(seen.rows))
        return worth_of_places(
            seen.rows, at, self.surrogate, self.noise, self.surrogate.to_mm, places_mm, seen.direction_rad
        )

    def departure(self, seen: SeenPresses, answer: RampAnswer) -> Departure:
        """Return what of presses their best fit does not explain, block by block."""
        reach_mm = self.reach_mm(len(seen.rows))
        posterior = PressPosterior(seen.rows, self.surrogate, self.noise, reach_mm, seen.direction_rad)
        return Departure(posterior.misfit_by_block(answer.fit.best))

    def _with_reach(self, best: Array, presses: int) -> Array:
        """Return the best fit of so many presses with offsets over the reach of a scan."""
        ratio = self.reach_mm(presses) / self.surrogate.to_mm
        return np.concatenate([best[:OFFSET], ratio * (best[OFFSET:] + 1) - 1])

    def answer(self, rows: Array, estimates: Array, direction_rad: Array | None = None) -> RampAnswer:
        """Return the answer to presses with one reference, rows [N, P], the inclusion in directions [N] of the image.

        `estimates` [n, 3] are first guesses of the unknowns' coordinates.
        """
        reach_mm = self.reach_mm(len(rows))
        posterior = PressPosterior(rows, self.surrogate, self.noise, reach_mm, direction_rad)
        fit = sample_press(posterior, self._start(posterior, rows, estimates, direction_rad))
        misfit = float(np.mean(posterior.residuals(fit.best) ** 2))
        return answer_of(fit, misfit, reach_mm / 2 * (fit.best[OFFSET:] + 1))

    def _start(self, posterior: PressPosterior, rows: Array, estimates: Array, direction_rad: Array | None) -> Array:
        inside = np.clip(estimates, -WELL_INSIDE, WELL_INSIDE)
        if len(rows) == 1:
            return np.concatenate([inside[0], np.zeros(posterior.dimensions - COUNT)])
        starts = scan_starts(rows, inside, self.surrogate, self.noise, self.reach_mm(len(rows)), direction_rad)
        found = best_fits(posterior, starts, np.ones(posterior.dimensions, dtype=bool))
        return np.asarray(found[np.argmin(np.sum(posterior.residuals(found) ** 2, axis=1))])


def answer_of(fit: PressFit, misfit_ratio: float, offset_mm: Array, unlike: UnlikeDesign | None = None) -> RampAnswer:
    """Return the answer of a posterior whose presses lie at offsets [N] in the best fit."""
    nearest = int(np.argmin(offset_mm))
    best = np.append(fit.best[:OFFSET], 2 * offset_mm[nearest] / HIGH[OFFSET] - 1)
    values = denormalise(np.append(fit.mean[:OFFSET], 0.0))
    spread = np.append(fit.spread[:OFFSET], 0.0) * slope_of_normalised(values)
    tissue_kpa = float(values[TISSUE]), float(spread[TISSUE])
    return RampAnswer(fit, intervals_of(fit), misfit_ratio, nearest, best, tissue_kpa, unlike)
