"""A recording of a force ramp to its estimate: size, depth and modulus with 90 % intervals, or why there are none.

Numbers are given for one round inclusion inside the trained ranges only. That a press is not one shows in what the best
fit leaves, in how far the bright spot is from round, and in the odds of networks that know inclusions around the ranges
too. Source: docs/accuracy.md on what can be known; docs/modes.md on how often each doubt is right.
"""

from __future__ import annotations

import numpy as np

from device.measurement.arrays import Array
from device.measurement.calibration import Calibration
from device.measurement.estimate import (
    Estimate,
    numbers_in_bands,
    origin_of,
    require_trained_for,
    saturation,
    with_numbers,
    without_numbers,
)
from device.measurement.mode import Mode
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.model import RAMP_MODES, ModeLimits, RampModel
from device.measurement.ramp_modes.noise import PressNoise
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, press_profile
from device.measurement.recording.recording import Recording
from device.measurement.recording.ring_means import MIDDLE, MIDDLE_LESS_RIM, RINGS

VISIBLE_DEVIATIONS = 4.0
"""An inclusion stands out when its contrast lies so many standard deviations above none."""


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
    row, limits = profile.as_row(), model.limits[mode]
    if not stands_out(row, model.answers.noise[mode]):
        return without_numbers("not_identifiable", "No inclusion stands out.", origin)
    answer, log_odds = model.answer(row, mode), float(model.ranges.log_odds(row[None], mode)[0])
    elongation = model.round_spot.elongation_deviations(profile.second_harmonic, answer.best, mode)
    doubts = doubts_about(answer.misfit_ratio, elongation, log_odds, limits)
    if doubts:
        return without_numbers("outside_range", " ".join(doubts), origin)
    features = {
        "misfit_ratio": answer.misfit_ratio,
        "outside_log_odds": log_odds,
        "elongation_deviations": elongation,
        "residual": profile.residual,
    }
    if answer.tissue_kpa:
        features |= dict(zip(("tissue_modulus_kpa", "tissue_modulus_std_kpa"), answer.tissue_kpa, strict=True))
    return with_numbers(numbers_in_bands(answer.mean, answer.spread, limits.bands), features, origin)


def stands_out(row: Array, noise: PressNoise) -> bool:
    """Return whether the middle of a profile row [P], mean over the forces, is brighter than noise.

    By itself, or against the rim.
    """
    forces = len(PROFILE_FORCES_N)
    bare = np.concatenate([np.zeros(forces * RINGS), row[forces * RINGS :]])
    covariance = noise.covariance(bare)[: forces * RINGS, : forces * RINGS]
    return any(
        float(weights @ row[: forces * RINGS]) > VISIBLE_DEVIATIONS * float(np.sqrt(weights @ covariance @ weights))
        for weights in (np.tile(rings / forces, forces) for rings in (MIDDLE, MIDDLE_LESS_RIM))
    )


def doubts_about(
    misfit_ratio: float, elongation_deviations: float, outside_log_odds: float, limits: ModeLimits
) -> list[str]:
    """Return a sentence for every reason why this is not one round inclusion inside the trained ranges; [] is good."""
    found = []
    if not misfit_ratio <= limits.misfit_ratio:
        found.append(
            f"No single round inclusion explains this press: misfit {misfit_ratio:.2f}, "
            f"above the usual {limits.misfit_ratio:.2f}."
        )
    if not elongation_deviations <= limits.elongation_deviations:
        found.append(
            f"The inclusion is not round: its elongation is {elongation_deviations:.1f} standard deviations from a round "
            f"one's, above the usual {limits.elongation_deviations:.1f}."
        )
    if not outside_log_odds <= limits.outside_log_odds:
        found.append(
            f"Size or depth rather lies outside its trained range: log odds {outside_log_odds:.1f}, "
            f"above the usual {limits.outside_log_odds:.1f}."
        )
    return found
