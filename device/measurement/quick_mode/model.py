"""A recording of held presses to its estimate in mode quick: one network, one call.

It answers in the time of a frame, and knows less of presses that are not of one round inclusion: at one force gel is
an inclusion. Only an oblong spot and a contrast outside what it has learnt from get no numbers. Source: docs/modes.md.
"""

from __future__ import annotations

from device.measurement.arrays import Array
from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.confidence_belt import bands_of
from device.measurement.estimate import (
    Estimate,
    numbers_in_bands,
    origin_of,
    require_trained_for,
    saturation,
    with_numbers,
    without_numbers,
)
from device.measurement.paper_mode.feature_definitions import QUICK_FEATURES, units_of
from device.measurement.parameters import unknowns_to_unit
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.profile import QUICK_NAMES, quick_press
from device.measurement.quick_mode.roundness import doubt_about_roundness
from device.measurement.recording.recording import Recording
from device.measurement.recording.ring_means import MIDDLE, MIDDLE_LESS_RIM, RINGS

QUICK_UNITS = units_of(QUICK_NAMES, QUICK_FEATURES)
"""The features of a network that reads one held press."""
SEEN_BY = MIDDLE, MIDDLE_LESS_RIM
"""Where an inclusion shows: in the middle by itself, or in the middle against the rim."""


class QuickModel:
    """A verified bundle whose network reads one held press, with the bands of its intervals.

    `faintest_contrast`: of each of `SEEN_BY`, what is more than noise. `elongation_ratio`: the largest usual one.
    """

    def __init__(self, bundle: ModelBundle) -> None:
        """Raises `BundleRefused` when the card of a bundle that reads `QUICK_UNITS` lacks bands or a limit."""
        self.bundle = bundle
        try:
            entry = bundle.card["modes"]["quick"]
            self.bands = bands_of(entry)
            self.elongation_ratio = float(entry["elongation_ratio"])
            self.faintest_contrast = tuple(float(entry["faintest_contrast"][i]) for i in range(len(SEEN_BY)))
        except (IndexError, KeyError, TypeError, ValueError, InvalidQuantity) as error:
            raise BundleRefused(bundle.folder, "modes.quick", f"incomplete ({error})", "complete") from error

    def prove(self) -> None:
        """Run the golden vectors; raises `BundleRefused` when one does not hold."""
        self.bundle.prove()

    def sees(self, contrast: Array) -> bool:
        """Return whether an inclusion stands out in the contrast [J] of the rings."""
        return any(
            float(weights @ contrast) > faintest
            for weights, faintest in zip(SEEN_BY, self.faintest_contrast, strict=True)
        )


def estimate_quick(recording: Recording, model: QuickModel, calibration: Calibration) -> Estimate:
    """Return the estimate of a recording in mode quick.

    Raises `InvalidQuantity` for a probe or pixel size that model and certificate are not for, or a press that was not
    held at the force that the network has learnt from.
    """
    require_trained_for(recording, model.bundle, calibration)
    origin = origin_of(recording, "quick", model.bundle, calibration)
    if reason := saturation(recording):
        return without_numbers("saturated", reason, origin)
    row, ratio = quick_press(recording)
    if not model.sees(row[:RINGS]):
        return without_numbers("not_identifiable", "No inclusion stands out.", origin)
    doubts = [*doubt_about_roundness(ratio, model.elongation_ratio), *model.bundle.outside_training_range(row)]
    if doubts:
        return without_numbers("outside_range", " ".join(doubts), origin)
    raw = model.bundle.estimate(row[None])
    features = dict(zip(model.bundle.feature_names, map(float, row), strict=True)) | {"elongation_ratio": ratio}
    numbers = numbers_in_bands(unknowns_to_unit(raw.estimate[0]), raw.spread[0], model.bands)
    return with_numbers(numbers, features, origin)
