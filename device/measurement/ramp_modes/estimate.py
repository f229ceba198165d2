"""A recording of a force ramp to its estimate: size, depth and modulus with 90 % intervals, or why there are none.

Numbers are given for one round inclusion inside the trained ranges only. That a press is not one shows in what the best
fit leaves, in how far the bright spot is from round, and in the odds of networks that know inclusions around the ranges
too. Source: docs/accuracy.md on what can be known; docs/modes.md on how often each rejection is right.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.calibration import Calibration
from device.measurement.estimate import (
    NO_NUMBERS,
    NOT_ROUND,
    NOTHING_STANDS_OUT,
    Estimate,
    Origin,
    numbers_in,
    origin_of,
    require_trained_for,
    saturation,
    with_critical,
    with_numbers,
    without_numbers,
)
from device.measurement.mode import FRAMES, Mode
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswer
from device.measurement.ramp_modes.misfit_blocks import FAR_TILT_DEVIATIONS, Departure, RowBlock, critical_ratio
from device.measurement.ramp_modes.model import RAMP_MODES, CriticalValues, RampModel
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import (
    CONTRAST,
    FORCES,
    RESPONSE,
    RampReader,
    SeenPresses,
    press_profiles,
    seen_presses,
)
from device.measurement.recording.recording import Recording
from device.measurement.recording.ring_means import MIDDLE, MIDDLE_LESS_RIM
from device.measurement.scan_advice import ScanAdvice, half_widths

VISIBLE_DEVIATIONS = 4.0
"""An inclusion stands out when its contrast lies more than so many standard deviations above none."""
WORTH_A_RAMP = 0.05
"""A further ramp is asked for when it is expected to narrow some unknown's interval by this part."""
PLACES_MM = (2.0, 3.0, 4.0, 5.0, 6.0, 7.0)
"""Where it may be asked for: nearer than these nobody places a hand-held probe on purpose."""


def estimate_ramp(
    recording: Recording, mode: Mode, model: RampModel, calibration: Calibration, read: RampReader = press_profiles
) -> Estimate:
    """Return the estimate of a recording in mode standard, of one ramp on the lesion, or precise, of all its ramps.

    Raises `InvalidQuantity` for another mode, a probe or pixel size that model and certificate are not for, or a
    recording whose reference and presses are no force ramps.
    """
    return _answered(recording, mode, model, calibration, read)[0]


def advise_scan(
    recording: Recording, model: RampModel, calibration: Calibration, read: RampReader = press_profiles
) -> ScanAdvice:
    """Return the estimate of all ramps of a scan so far, and where the next one would tell most.

    Raises as `estimate_ramp`. None is asked for where a further ramp would narrow nothing by `WORTH_A_RAMP`, or a scan
    has no more of them. Where hand and skin may explain all so far, a further one may tell that they do not.
    """
    estimate, answered = _answered(recording, "precise", model, calibration, read)
    now = half_widths(estimate)
    may_be_none = answered is not None and estimate.reason == NOTHING_STANDS_OUT
    if answered is None or not (now or may_be_none) or len(recording.ramps()) >= FRAMES["precise"].most_ramps:
        return ScanAdvice(estimate, now, None, now)
    seen, answer = answered
    parts = model.answers.worth(seen, answer, PLACES_MM)
    best = int(np.argmin(np.log(parts).sum(axis=1)))
    if parts[best].min() > 1 - WORTH_A_RAMP:
        return ScanAdvice(estimate, now, None, now)
    part_of = dict(zip(UNKNOWNS, map(float, parts[best]), strict=True))
    return ScanAdvice(estimate, now, PLACES_MM[best], {name: part_of[name] * half for name, half in now.items()})


def _answered(
    recording: Recording, mode: Mode, model: RampModel, calibration: Calibration, read: RampReader
) -> tuple[Estimate, tuple[SeenPresses, RampAnswer] | None]:
    """Return the estimate, and the presses and answer behind it, if there was one to give."""
    if mode not in RAMP_MODES:
        raise InvalidQuantity("mode", mode, f"one of {', '.join(RAMP_MODES)}", "choose one that reads a force ramp")
    require_trained_for(recording, model.bundle, calibration)
    origin = origin_of(recording, mode, model.bundle, calibration)
    if reason := saturation(recording):
        return without_numbers("saturated", reason, origin), None
    profiles = read(recording)
    profiles = profiles if mode == "precise" else profiles[:1]
    seen = seen_presses(profiles)
    contrast = max(contrast_deviations(row, model.answers.noise) for row in seen.rows)
    if not contrast > VISIBLE_DEVIATIONS:
        features = with_critical({"contrast_deviations": contrast}, {"contrast_deviations": VISIBLE_DEVIATIONS})
        return without_numbers("not_identifiable", NOTHING_STANDS_OUT, origin, features), None
    answer = model.answer_to(seen)
    found = model.found(answer, seen)
    residual = max(profile.residual for profile in profiles)
    critical = model.critical[mode]
    departure = model.answers.departure(seen, answer) if found.misfit_ratio > critical.misfit_ratio else None
    return _judged(answer, found, critical, residual, departure, origin), (seen, answer)


def _judged(
    answer: RampAnswer,
    found: CriticalValues,
    critical: CriticalValues,
    residual: float,
    departure: Departure | None,
    origin: Origin,
) -> Estimate:
    """Return the numbers of an answer, or why it is none of one round inclusion inside the trained ranges.

    `departure` is what the best fit leaves of a press whose misfit is too large.
    """
    tissue = dict(zip(("tissue_modulus_kpa", "tissue_modulus_std_kpa"), answer.tissue_kpa, strict=True))
    features = with_critical(asdict(found), asdict(critical)) | {"residual": residual} | tissue
    if answer.unlike:
        features["skin_texture_ratio"] = answer.unlike.skin_texture_ratio
        features["tissue_uneven_ratio"] = answer.unlike.uneven_ratio
        features |= with_critical(
            {"inclusion_deviations": answer.unlike.inclusion_deviations},
            {"inclusion_deviations": answer.unlike.needed_deviations},
        )
    block = departure.block if departure else None
    if departure:
        features |= _figures_of(departure)
    if reasons := rejections(found, critical, block):
        action = CAUSES[block].action if block else ACTIONS.get(tuple(exceeded(found, critical)), NO_NUMBERS)
        return without_numbers("outside_range", " ".join([*reasons, action]), origin, features)
    if not answer.needs_inclusion:
        return without_numbers("not_identifiable", NOTHING_STANDS_OUT, origin, features)
    return with_numbers(numbers_in(answer.mean, answer.spread, answer.intervals), features, origin)


def stands_out(row: Array, noise: PressNoise) -> bool:
    """Return whether an inclusion can be told from noise in a profile row [P]."""
    return contrast_deviations(row, noise) > VISIBLE_DEVIATIONS


def contrast_deviations(row: Array, noise: PressNoise) -> float:
    """Return how many standard deviations of noise the middle of a profile row [P], mean over the forces, is bright.

    By itself, or against the rim: whichever is more.
    """
    baseline = np.zeros_like(row)
    baseline[RESPONSE] = row[RESPONSE]
    covariance = noise.covariance(baseline)[CONTRAST, CONTRAST]
    return max(
        float(weights @ row[CONTRAST]) / float(np.sqrt(weights @ covariance @ weights))
        for weights in (np.tile(rings / FORCES, FORCES) for rings in (MIDDLE, MIDDLE_LESS_RIM))
    )


REASONS = {
    "misfit_ratio": "This does not look like one single inclusion that is round.",
    "elongation_deviations": NOT_ROUND,
    "outside_log_odds": "The inclusion may be too large, too small, too deep or too shallow for the probe.",
    "tissue_from_middle_ratio": "The tissue may be softer, stiffer or thinner than any that the probe measures in.",
}
"""What the operator reads when a figure is above its critical value; both are among the features."""


AWAY_FROM_BONE = (
    "No numbers are given. Begin again beside the lesion, away from bone; if the message stays, note the finding "
    "without numbers."
)
ACTIONS: dict[tuple[str, ...], str] = {("tissue_from_middle_ratio",): AWAY_FROM_BONE}
"""What to do where these figures alone are above their critical values, instead of `NO_NUMBERS`."""


class MisfitCause(NamedTuple):
    """What may make a block of the row depart, in one sentence, and what to do about it instead of `NO_NUMBERS`."""

    sentence: str
    action: str


CAUSES: dict[RowBlock, MisfitCause] = {
    "contrast": MisfitCause(
        "No single round inclusion looks like this: there may be two, or the skin over it is unlike that beside it.",
        "No numbers are given. Wipe face and skin, and press again a little beside it; if the message stays, note the "
        "finding without numbers.",
    ),
    "reference_response": MisfitCause(
        "Already beside the lesion the light follows the force otherwise than it should: skin or probe differ from "
        "what this probe was commissioned with.",
        "No numbers are given. Wipe face and skin, tare, and press beside the lesion again; if the message stays with "
        "other patients, have this probe commissioned again.",
    ),
    "first_harmonic": MisfitCause(
        "One side is brighter than an inclusion makes it: the probe was tilted, or the light of one side has changed.",
        "No numbers are given. Hold the probe straight, and press again; if the message stays, run the self-test.",
    ),
    "second_harmonic": MisfitCause(
        "The image is longer one way than across: the inclusion is not round, or the light of two sides has changed.",
        "No numbers are given. Turn the probe by a quarter, and press again; if the message stays, note the finding "
        "without numbers.",
    ),
}
"""What is said where one block of the row alone departs, instead of the sentence on the misfit as a whole."""


def _figures_of(departure: Departure) -> dict[str, float]:
    """Return the misfit of each block, and the tilt where it is told, each beside its critical value."""
    found = {f"{block}_misfit_ratio": one.ratio for block, one in departure.blocks.items()}
    critical = {f"{block}_misfit_ratio": critical_ratio(one.columns) for block, one in departure.blocks.items()}
    if departure.tilt_deviations is not None:
        found["tilt_deviations"] = departure.tilt_deviations
        critical["tilt_deviations"] = FAR_TILT_DEVIATIONS
    return with_critical(found, critical)


def exceeded(found: CriticalValues, critical: CriticalValues) -> list[str]:
    """Return the names of the figures above their critical values; one that is no number counts among them."""
    limits = asdict(critical)
    return [name for name, value in asdict(found).items() if not value <= limits[name]]


def rejections(found: CriticalValues, critical: CriticalValues, block: RowBlock | None = None) -> list[str]:
    """Return a sentence for every reason why this is not one round inclusion inside the trained ranges; [] is good.

    `block`: which part of the row makes the misfit, where one does.
    """
    sentences = REASONS | ({"misfit_ratio": CAUSES[block].sentence} if block else {})
    return [sentences[name] for name in exceeded(found, critical)]
