"""Mode paper: a recording of holds to its estimate, by the paper's network and three regressions.

Every press frame is estimated on its own and the estimates are averaged; their standard deviation is the scatter of
this press, not its accuracy. Accuracy is the interval, which comes from held-out scenes. Source: Lee & Won 2013,
section IV: ten images a lesion, averaged.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from device.measurement.bundle import ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.estimate import (
    NO_NUMBERS,
    NOTHING_STANDS_OUT,
    UNKNOWN_IMAGE,
    Estimate,
    Numbers,
    Origin,
    origin_of,
    outside_training,
    saturation,
    with_critical,
    with_numbers,
    without_numbers,
)
from device.measurement.feature_definitions import INCLUSION_FIELD_FEATURES, units_of
from device.measurement.paper_mode.features import FEATURE_NAMES, FeatureSettings, extract_features
from device.measurement.paper_mode.lines import PaperLines
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.recording import Recording

PAPER_UNITS = units_of(INCLUSION_FIELD_FEATURES, INCLUSION_FIELD_FEATURES)
"""The features of the paper's network: O1, O2, O3, in this order."""
CONTACT_N = 0.05
"""Below this mean force the probe touches nothing."""
VISIBLE_CONTRAST = 0.002
"""An inclusion whose peak is fainter than this is not told from the residue of light, force and camera."""


def estimate_paper(recording: Recording, bundle: ModelBundle, calibration: Calibration) -> Estimate:
    """Return the estimate of a recording in mode paper.

    Raises `InvalidQuantity` when the recording lacks a role, or the calibration is not for this model or probe, has no
    lines, or lines of another press than the model was trained with.
    """
    calibration.require_for(recording.serial, bundle)
    lines = calibration.paper_lines
    for problem in lines.other_press(bundle):
        raise problem
    origin = origin_of(recording, "paper", bundle, calibration)
    press = recording.with_role("press")
    if not press:
        raise InvalidQuantity("press frames", 0, "at least one", "record frames while the probe presses the lesion")
    force_n = float(np.mean([frame.force_n for frame in press]))
    if force_n < CONTACT_N:
        reason = f"The mean force is {force_n:.3f} N, below {CONTACT_N} N: press the lesion."
        return without_numbers("no_contact", reason, origin)
    if not lines.holds_at(force_n):
        reason = f"The mean force is {force_n:.3f} N, not the {lines.force_n:g} N of the calibration: press again."
        return without_numbers("rejected", reason, origin)
    if reason := saturation(recording):
        return without_numbers("saturated", reason, origin)
    image_rows = image_features(recording, lines.settings)
    if float(image_rows[:, 0].mean()) < VISIBLE_CONTRAST:
        features = with_critical(_named(FEATURE_NAMES, image_rows), {FEATURE_NAMES[0]: VISIBLE_CONTRAST})
        return without_numbers("not_identifiable", NOTHING_STANDS_OUT, origin, features)
    return _answer(image_rows, bundle, lines, origin)


def image_features(recording: Recording, settings: FeatureSettings) -> NDArray[np.float64]:
    """Return the image features [n, 3] of a recording's press frames."""
    return np.array([extract_features(image, settings).as_row() for image in recording.press_images()])


def _answer(image_rows: NDArray[np.float64], bundle: ModelBundle, lines: PaperLines, origin: Origin) -> Estimate:
    rows = lines.deformation_features(image_rows)
    features = _named(FEATURE_NAMES, image_rows) | _named(bundle.feature_names, rows)
    estimates = bundle.estimate(rows).estimate.astype(float)
    if outside := outside_training(bundle, rows.mean(axis=0)):
        return without_numbers("outside_range", f"{UNKNOWN_IMAGE} {NO_NUMBERS}", origin, features | outside)
    mean, held_out = estimates.mean(axis=0), lines.held_out
    interval, box = held_out.interval(mean), (held_out.box_low, held_out.box_high)
    known = interval.identifiable
    # The scatter of a value that the press does not determine says nothing of what is possible.
    scatter = np.where(known, _scatter(estimates), np.nan)
    numbers = Numbers(mean, scatter, interval.low, interval.high, known, *box)
    return with_numbers(numbers, features, origin, _tissue_taken(bundle))


def _tissue_taken(bundle: ModelBundle) -> str:
    """Return in which tissue the numbers hold, where a card says which one the network was trained in."""
    tissue = bundle.card.get("scene_defaults", {}).get("tissue")
    if not tissue:
        return ""
    taken = f"{tissue['youngs_modulus_kpa']:g} kPa and {tissue['thickness_mm']:g} mm"
    return f"The tissue is taken to have {taken}: this mode tells no other."


def _named(names: Sequence[str], rows: NDArray[np.float64]) -> dict[str, float]:
    """Return the means over the frames of rows [n, F] by name."""
    return {name: float(value) for name, value in zip(names, rows.mean(axis=0), strict=True)}


def _scatter(estimates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation [3] over the frames; of one frame there is none to see."""
    return np.asarray(estimates.std(axis=0, ddof=1) if len(estimates) > 1 else np.zeros(estimates.shape[1]))
