"""One ramp or several of a commissioned probe to an answer: the design's forward model, and what is unlike it.

What the probe and its presses change is linear about a point near the truth: so it is taken anew where the fit comes
to, and from the likeliest end it is fitted together with the inclusion. Patients' skin may be coarser than phantoms': a
press that is explained badly says itself how coarse it is.
Source: docs/own_probe.md; the likeliest level of a Gaussian process, Rasmussen & Williams (2006), section 5.4.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.parameters import COUNT, LOW
from device.measurement.ramp_modes.answers import (
    WELL_INSIDE,
    RampAnswer,
    RampAnswers,
    answer_of,
)
from device.measurement.ramp_modes.commissioned.moving_posterior import MovingPosterior
from device.measurement.ramp_modes.commissioned.own_posterior import AXES, OwnPosterior
from device.measurement.ramp_modes.commissioned.own_probe import OwnProbe, Place
from device.measurement.ramp_modes.fit import best_fit, best_fits
from device.measurement.ramp_modes.misfit_blocks import Departure
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.posterior import sample_press
from device.measurement.ramp_modes.radial_profile import COLUMNS, RESPONSE, SeenPresses
from device.measurement.ramp_modes.scan import bound_of, scan_starts
from device.measurement.ramp_modes.surrogate import DEPTH, MODULUS, OFFSET, SIZE, ScanSurrogate

LOOKED_AGAIN = 2
"""How often what the probe changes is taken anew, where the fit has come to."""
JOINT_STEPS = 3
"""Steps of the joint fit of inclusion and changes, from the likeliest of these ends. Six are no better for presses."""
ROUGHLY, WELL = 1e-4, 1e-5
"""By which part of the cost, of 200 to 900, a step has to lower it: where what the probe changes is taken anew, and
where fits are compared. A cost of 1 moves an unknown by its spread. Where it is sampled, the fit goes on."""
COARSER_SKINS = 1.6, 2.5, 3.7
"""Textures of skin over the believed one, of 0.3 % mostly, that are weighed for presses that it explains badly."""
UNEVEN_RATIOS, AS_LIKELY = (0.0, 1.0, 3.0), 2.0
"""Unevenness of the tissue over the one that may be (`UNEVEN_LOG_STD`) that is weighed, and by how much of the
logarithm the evidence of the most uneven one that counts may fall short of the likeliest's. In even tissue the evidence
mostly rules the others out: intervals are then as narrow as if nobody had asked."""
BADLY_EXPLAINED = 1.0
"""Misfit from which on they are: below it hardly any is likelier."""
APART, MOST_BEGUN = 0.1, 3
"""Fits whose coordinates lie nearer to each other than the first are one; of so many the likeliest is kept. Where what
the probe changes is taken anew, another than the best before may come to explain the press better: in one press of
twenty-five it is more than exp(5) times as likely."""
NEEDED_VARIANCE, FURTHER_VARIANCE, UNEVEN_VARIANCE = 9.0, 5.0, 7.0
"""Squared deviations by which an inclusion has to explain a press better than none, and what each further press of a
scan adds, whose place is two unknowns more. In even tissue the contrast of presses where there is none stands out in
one of ten; so much better as well it explains fewer than one of a hundred, and of scans of two (docs/robustness.md). A
scan's residuals count in part (`SCAN_VARIANCE`), which raises its limit by as much again. In uneven tissue, whose
layers make a bright middle by themselves, the last comes on top: of 360 presses without one that are drawn in tissue as
uneven as may be, 77 stand out, and an inclusion explains 5 so much better (seeds 3, 5, 6, 41 of `believed_presses`). 16
instead of 7 would leave 3 of these, and of 88 presses on one that stand out would refuse 10 more."""
BEGUN_AT = np.array([[0.25, 0.0], [-0.25, 0.0], [0.05, 0.25], [0.05, -0.25]])
"""Where the inclusion of a single press may lie at first, of the reach: the bright side may be a tilt's."""


class _Patient(NamedTuple):
    """What presses say themselves of who is pressed: texture of the skin over the one that is believed, and how uneven
    the tissue is, of what may be.
    """

    skin_texture_ratio: float = 1.0
    uneven_ratio: float = 0.0


AS_BELIEVED = _Patient()


@dataclass(frozen=True, eq=False)
class _Settled:
    """A posterior that is linear near its best fit [8 + 2 N], that fit, and the patient that it is of.

    On coarser skin it is linear about the best fit on the skin before: fits on both lie near each other.
    """

    posterior: OwnPosterior
    best: Array
    patient: _Patient

    @cached_property
    def log_evidence(self) -> float:  # asked of every start in every tissue, more than once
        return self.posterior.log_evidence(self.best)

    @property
    def inclusion_deviations(self) -> float:
        """The root of how much an inclusion lowers the squared residuals; both fits are in what is believed about it.

        So it is no likelihood ratio of two models, and its limit is by presses without an inclusion, not by theory.
        """
        without, free = np.array(self.best), np.ones(len(self.best), dtype=bool)
        free[[SIZE, DEPTH, MODULUS]] = free[OFFSET:] = False
        without[[SIZE, MODULUS]], without[DEPTH], without[OFFSET:] = -1.0, 1.0, 0.0  # the faintest: nobody sees it
        fits = np.array([self.best, *best_fits(self.posterior, without[None], free, tolerance=WELL)])
        found, nothing = np.sum(self.posterior.residuals(fits) ** 2, axis=1)
        return float(np.sqrt(max(nothing - found, 0.0)))


class OwnAnswers(RampAnswers):
    """Forward model, noise, and what is believed of a commissioned probe."""

    def __init__(self, surrogate: ScanSurrogate, noise: PressNoise, own: OwnProbe) -> None:
        super().__init__(surrogate, noise)
        self.own = own

    def answer_to(self, seen: SeenPresses, estimates: Array, reach_mm: float | None = None) -> RampAnswer:
        """Return the answer to what was read of presses with one reference; `estimates` [n, 3] are first guesses.

        The inclusion lies off the axis by `reach_mm` at most: that of a single press or of a scan where none is given.
        What is worth pressing next, and what departs, are told of answers within the latter alone.

        All is told in tissue that is as uneven as the presses allow. Best fit and misfit are those on skin as it is
        believed, whose limits refuse what is no single round inclusion: a second one looks like coarse skin, too. All
        else is told on the likeliest skin.
        """
        reach_mm = reach_mm or self.reach_mm(len(seen.rows))
        begun = self._begun(seen, np.clip(estimates, -WELL_INSIDE, WELL_INSIDE), reach_mm)
        believed = self._in_likeliest_tissue(seen, begun, reach_mm)
        best, misfit_ratio = believed.best, believed.posterior.misfit_ratio(believed.best)
        likeliest = believed if misfit_ratio < BADLY_EXPLAINED else self._on_likeliest_skin(seen, believed, reach_mm)
        fit = replace(sample_press(likeliest.posterior, likeliest.best), best=best)
        offset_mm = reach_mm * np.linalg.norm(best[OFFSET:].reshape(-1, AXES), axis=1)
        unlike = believed.posterior.unlike(best, int(np.argmin(offset_mm)))
        told = replace(
            unlike,
            skin_texture_ratio=likeliest.patient.skin_texture_ratio,
            uneven_ratio=likeliest.patient.uneven_ratio,
            inclusion_deviations=likeliest.inclusion_deviations,
            needed_deviations=_needed_deviations(len(seen.rows), likeliest.patient),
        )
        return answer_of(fit, misfit_ratio, offset_mm, told)

    def ordinary_shift(self, rows: Array) -> Array:
        """Return what is believed to move rows [n, P] of presses on an inclusion in the middle of all ranges [n, P]."""
        count = len(rows)
        middle = Place(np.zeros((count, len(LOW))), np.zeros(count), np.zeros(count))
        return self.own.shift(middle, rows)[:, :COLUMNS]

    def worth(self, seen: SeenPresses, answer: RampAnswer, places_mm: Sequence[float]) -> Array:
        """Return to which part [n, 3] a further press at each place narrows the unknowns' spreads.

        Of a single press it may be above 1: a scan counts for less than it adds up to (`SCAN_VARIANCE`).
        """
        to_mm = self.surrogate.to_mm
        ratio = self.reach_mm(len(seen.rows)) / to_mm
        at = np.concatenate([answer.fit.best[:OFFSET], ratio * answer.fit.best[OFFSET:]])
        patient = _patient_of(answer)
        before = bound_of(self._posterior(seen, at, to_mm, patient), at)
        parts = []
        for place_mm in places_mm:
            further = np.append(at[:OFFSET], place_mm - 1.0)
            (row,) = self.surrogate.rows(further[None])
            row[RESPONSE] = seen.rows[0, RESPONSE]
            after = np.append(at, [place_mm / to_mm, 0.0])
            parts.append(bound_of(self._posterior(_with_further(seen, row), after, to_mm, patient), after) / before)
        return np.array(parts)

    def departure(self, seen: SeenPresses, answer: RampAnswer) -> Departure:
        """Return what of presses their best fit does not explain, and how far the probe leant on the lesion."""
        best = answer.fit.best
        of_tissue = _Patient(uneven_ratio=_patient_of(answer).uneven_ratio)
        posterior = self._posterior(seen, best, self.reach_mm(len(seen.rows)), of_tissue)
        return Departure(posterior.misfit_by_block(best), posterior.tilt_deviations(best))

    def _in_likeliest_tissue(self, seen: SeenPresses, begun: Sequence[Array], reach_mm: float) -> _Settled:
        """Return the posterior in the most uneven tissue that is nearly as likely as the likeliest."""
        found: list[_Settled] = []
        for ratio in UNEVEN_RATIOS if self.own.may_be_uneven else UNEVEN_RATIOS[:1]:
            patient = _Patient(uneven_ratio=ratio)
            ends = [self._followed(seen, at, reach_mm, patient) for at in begun]
            found.append(self._stepped(seen, _likeliest(ends), reach_mm))
            enough = _likeliest(found).log_evidence - AS_LIKELY
            if found[-1].log_evidence < enough:
                break
        return next(one for one in reversed(found) if one.log_evidence >= enough)

    def _followed(self, seen: SeenPresses, at: Array, reach_mm: float, patient: _Patient) -> _Settled:
        """Return the posterior and best fit that coordinates [8 + 2 N] lead to."""
        for _ in range(LOOKED_AGAIN):
            at = best_fit(self._posterior(seen, at, reach_mm, patient), at, tolerance=ROUGHLY)
        return self._settled(seen, at, reach_mm, patient)

    def _stepped(self, seen: SeenPresses, end: _Settled, reach_mm: float) -> _Settled:
        """Return the posterior that steps of the joint fit lead to from an end, or this where it is likelier."""
        posterior, at = end.posterior, end.best
        for _ in range(JOINT_STEPS):
            posterior = MovingPosterior(posterior, at)
            at = best_fit(posterior, at, tolerance=ROUGHLY)
        return _likeliest([end, self._settled(seen, at, reach_mm, end.patient)])

    def _settled(self, seen: SeenPresses, at: Array, reach_mm: float, patient: _Patient) -> _Settled:
        """Return the posterior of presses of a patient, linear about coordinates [8 + 2 N], and its best fit."""
        posterior = self._posterior(seen, at, reach_mm, patient)
        return _Settled(posterior, best_fit(posterior, at, tolerance=WELL), patient)

    def _on_likeliest_skin(self, seen: SeenPresses, believed: _Settled, reach_mm: float) -> _Settled:
        """Return the posterior on skin as it is believed, or on the first coarser one that is likelier than the next.

        The evidence has one top: what follows is not fitted.
        """
        likeliest = believed
        for ratio in COARSER_SKINS:
            coarser = self._settled(seen, likeliest.best, reach_mm, believed.patient._replace(skin_texture_ratio=ratio))
            if coarser.log_evidence <= likeliest.log_evidence:
                break
            likeliest = coarser
        return likeliest

    def _on_skin(self, texture_ratio: float) -> PressNoise:
        """Return the noise on skin of so many times the texture that is believed."""
        if texture_ratio == 1.0:
            return self.noise
        return replace(self.noise, levels=self.noise.levels.on_coarser_skin(texture_ratio))

    def _posterior(
        self, seen: SeenPresses, at: Array, reach_mm: float, patient: _Patient = AS_BELIEVED
    ) -> OwnPosterior:
        noise, own = self._on_skin(patient.skin_texture_ratio), replace(self.own, uneven_ratio=patient.uneven_ratio)
        return OwnPosterior(seen, self.surrogate, noise, own, reach_mm, at)

    def _begun(self, seen: SeenPresses, inside: Array, reach_mm: float) -> list[Array]:
        """Return coordinates [8 + 2 N] to begin at, first those that explain the presses best."""
        starts = self._scan_starts(seen, inside, reach_mm) if len(seen.rows) > 1 else _single_starts(inside)
        posterior = self._posterior(seen, starts[0], reach_mm)
        found = best_fits(posterior, starts, np.ones(posterior.dimensions, dtype=bool), tolerance=WELL)
        different: list[Array] = []
        for at in found[np.argsort(np.sum(posterior.residuals(found) ** 2, axis=1))]:
            if all(np.abs(at - other).max() > APART for other in different):
                different.append(at)
        return different[:MOST_BEGUN]

    def _scan_starts(self, seen: SeenPresses, inside: Array, reach_mm: float) -> Array:
        """Return starts [n, 8 + 2 N] of a scan, each inclusion on its bright side."""
        rows = seen.rows - self.ordinary_shift(seen.rows)
        alike = scan_starts(rows, inside, self.surrogate, self.noise, reach_mm, seen.direction_rad)
        starts = np.zeros((len(alike), OFFSET + AXES * len(rows)))
        starts[:, :OFFSET] = alike[:, :OFFSET]
        starts[:, OFFSET::AXES] = (alike[:, OFFSET:] + 1) / 2
        return starts


def _patient_of(answer: RampAnswer) -> _Patient:
    unlike = answer.unlike
    return _Patient(unlike.skin_texture_ratio, unlike.uneven_ratio) if unlike else AS_BELIEVED


def _likeliest(found: Sequence[_Settled]) -> _Settled:
    return max(found, key=lambda one: one.log_evidence)


def _needed_deviations(presses: int, patient: _Patient) -> float:
    of_tissue = UNEVEN_VARIANCE if patient.uneven_ratio else 0.0
    return float(np.sqrt(NEEDED_VARIANCE + FURTHER_VARIANCE * (presses - 1) + of_tissue))


def _single_starts(inside: Array) -> Array:
    starts = np.zeros((len(BEGUN_AT), OFFSET + AXES))
    starts[:, :COUNT], starts[:, OFFSET:] = inside[0], BEGUN_AT
    return starts


def _with_further(seen: SeenPresses, row: Array) -> SeenPresses:
    """Return presses with a further one, whose row [P] is in its inclusion's direction, wherever that is."""
    assert seen.first_across is not None  # of a commissioned probe
    nothing = np.zeros((1, *seen.second_harmonics.shape[1:]))
    return SeenPresses(
        np.vstack([seen.rows, row]),
        np.concatenate([seen.second_harmonics, nothing]),
        np.append(seen.direction_rad, np.nan),
        np.concatenate([seen.first_across, np.zeros((1, *seen.first_across.shape[1:]))]),
    )
