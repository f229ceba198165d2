"""A recording of a force ramp to its estimate: size, depth and modulus with 90 % intervals, or why there are none.

Numbers are given for one round inclusion inside the trained ranges only. That a press is not one shows in what the best
fit leaves, in how far the bright spot is from round, and in the odds of networks that know inclusions around the ranges
too. Source: docs/accuracy.md on what can be known; docs/modes.md on how often each rejection is right.
"""

from __future__ import annotations

from dataclasses import asdict

import numpy as np

from device.measurement.arrays import Array
from device.measurement.calibration import Calibration
from device.measurement.estimate import (
    NO_NUMBERS,
    NOT_ROUND,
    NOTHING_STANDS_OUT,
    Estimate,
    numbers_in_belts,
    origin_of,
    require_trained_for,
    saturation,
    with_critical,
    with_numbers,
    without_numbers,
)
from device.measurement.mode import Mode
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.model import RAMP_MODES, CriticalValues, RampModel
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, press_profile
from device.measurement.recording.recording import Recording
from device.measurement.recording.ring_means import MIDDLE, MIDDLE_LESS_RIM, RINGS

VISIBLE_DEVIATIONS = 4.0
"""An inclusion stands out when its contrast lies more than so many standard deviations above none."""


def estimate_ramp(recording: Recording, mode: Mode, model: RampModel, calibration: Calibration) -> Estimate:
    """Return the estimate of a recording in mode standard or precise.

    Raises `InvalidQuantity` for another mode, a probe or pixel size that model and certificate are not for, or a
    recording whose reference and press are no force ramps.
    """
    if mode not in RAMP_MODES:
        raise InvalidQuantity("mode", mode, f"one of {', '.join(RAMP_MODES)}", "choose one that reads a force ramp")
    require_trained_for(recording, model.bundle, calibration)
    origin = origin_of(recording, mode, model.bundle, calibration)
    if reason := saturation(recording):
        return without_numbers("saturated", reason, origin)
    profile = press_profile(recording)
    row, critical = profile.as_row(), model.critical[mode]
    seen = contrast_deviations(row, model.answers.noise[mode])
    if not seen > VISIBLE_DEVIATIONS:
        features = with_critical({"contrast_deviations": seen}, {"contrast_deviations": VISIBLE_DEVIATIONS})
        return without_numbers("not_identifiable", NOTHING_STANDS_OUT, origin, features)
    answer = model.answer(row, mode)
    found = CriticalValues(
        misfit_ratio=answer.misfit_ratio,
        elongation_deviations=model.ellipticity.elongation_deviations(profile.second_harmonic, answer.best, mode),
        outside_log_odds=float(model.ranges.log_odds(row[None], mode)[0]),
    )
    features = with_critical(asdict(found), asdict(critical)) | {"residual": profile.residual}
    if answer.tissue_kpa:
        features |= dict(zip(("tissue_modulus_kpa", "tissue_modulus_std_kpa"), answer.tissue_kpa, strict=True))
    if reasons := rejections(found, critical):
        return without_numbers("outside_range", " ".join([*reasons, NO_NUMBERS]), origin, features)
    return with_numbers(numbers_in_belts(answer.mean, answer.spread, model.belts[mode]), features, origin)


def stands_out(row: Array, noise: PressNoise) -> bool:
    """Return whether an inclusion can be told from noise in a profile row [P]."""
    return contrast_deviations(row, noise) > VISIBLE_DEVIATIONS


def contrast_deviations(row: Array, noise: PressNoise) -> float:
    """Return how many standard deviations of noise the middle of a profile row [P], mean over the forces, is bright.

    By itself, or against the rim: whichever is more.
    """
    forces = len(PROFILE_FORCES_N)
    baseline = np.concatenate([np.zeros(forces * RINGS), row[forces * RINGS :]])
    covariance = noise.covariance(baseline)[: forces * RINGS, : forces * RINGS]
    return max(
        float(weights @ row[: forces * RINGS]) / float(np.sqrt(weights @ covariance @ weights))
        for weights in (np.tile(rings / forces, forces) for rings in (MIDDLE, MIDDLE_LESS_RIM))
    )


REASONS = {
    "misfit_ratio": "This does not look like one single inclusion that is round.",
    "elongation_deviations": NOT_ROUND,
    "outside_log_odds": "The inclusion may be too large, too small, too deep or too shallow for the probe.",
}
"""What the operator reads when a figure is above its critical value; both are among the features."""


def rejections(found: CriticalValues, critical: CriticalValues) -> list[str]:
    """Return a sentence for every reason why this is not one round inclusion inside the trained ranges; [] is good.

    A figure that is no number rejects, too.
    """
    limits = asdict(critical)
    return [REASONS[name] for name, value in asdict(found).items() if not value <= limits[name]]
