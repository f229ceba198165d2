"""A recording of held presses to its estimate in mode quick: one network, one call.

It answers in the time of a frame, and knows less of presses that are not of one round inclusion: at one force gel is
an inclusion. Only an oblong spot and a contrast outside what it has learnt from get no numbers. Source: docs/modes.md.
"""

from __future__ import annotations

from device.measurement.arrays import Array
from device.measurement.bundle import BundleRefused, ModelBundle
from device.measurement.calibration import Calibration
from device.measurement.confidence_belt import belts_of, ends_in_belts
from device.measurement.estimate import (
    NO_NUMBERS,
    NOT_ROUND,
    NOTHING_STANDS_OUT,
    UNKNOWN_IMAGE,
    Estimate,
    numbers_in,
    origin_of,
    outside_training,
    require_trained_for,
    saturation,
    with_critical,
    with_numbers,
    without_numbers,
)
from device.measurement.feature_definitions import QUICK_FEATURES, units_of
from device.measurement.parameters import RANGES, normalise_unknowns
from device.measurement.quantities import InvalidQuantity
from device.measurement.quick_mode.profile import QUICK_NAMES, quick_press
from device.measurement.recording.recording import Recording
from device.measurement.recording.ring_means import MIDDLE, MIDDLE_LESS_RIM, RINGS

QUICK_UNITS = units_of(QUICK_NAMES, QUICK_FEATURES)
"""The features of a network that reads one held press."""
SEEN_BY = {"middle_contrast": MIDDLE, "middle_less_rim_contrast": MIDDLE_LESS_RIM}
"""Where an inclusion shows: in the middle by itself, or in the middle against the rim; weights of the rings [J]."""
_LOW_KPA, _HIGH_KPA, _ = RANGES["tissue_modulus_kpa"]
TISSUE_TAKEN = f"The tissue is taken to have {_LOW_KPA:g} to {_HIGH_KPA:g} kPa: one force does not tell it."


class QuickModel:
    """A verified bundle whose network reads one held press, with the belts of its intervals.

    Critical values: `faintest_contrast` of each of `SEEN_BY`, less is noise; `elongation_ratio`, more is not round.
    """

    def __init__(self, bundle: ModelBundle) -> None:
        """Raises `BundleRefused` when the card of a bundle that reads `QUICK_UNITS` lacks belts or a limit.

        And where it is of other ranges of the parameters.
        """
        self.bundle = bundle
        bundle.fields.require_known_ranges()
        try:
            entry = bundle.card["modes"]["quick"]
            self.belts = belts_of(entry)
            self.elongation_ratio = float(entry["elongation_ratio"])
            faintest = (float(entry["faintest_contrast"][i]) for i in range(len(SEEN_BY)))
            self.faintest_contrast = dict(zip(SEEN_BY, faintest, strict=True))
        except (IndexError, KeyError, TypeError, ValueError, InvalidQuantity) as error:
            raise BundleRefused(bundle.folder, "modes.quick", f"incomplete ({error})", "complete") from error

    def prove(self) -> None:
        """Run the golden vectors; raises `BundleRefused` when one does not hold."""
        self.bundle.prove()


def visible_contrast(contrast: Array) -> dict[str, float]:
    """Return how bright the middle of the contrast [J] of the rings is, by itself and against the rim."""
    return {name: float(weights @ contrast) for name, weights in SEEN_BY.items()}


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
    seen, faintest = visible_contrast(row[:RINGS]), model.faintest_contrast
    found = dict(zip(model.bundle.feature_names, map(float, row), strict=True)) | {"elongation_ratio": ratio} | seen
    features = with_critical(found, {"elongation_ratio": model.elongation_ratio} | faintest)
    if not any(seen[name] > faintest[name] for name in SEEN_BY):
        return without_numbers("not_identifiable", NOTHING_STANDS_OUT, origin, features)
    outside = outside_training(model.bundle, row)
    rejections = [*([] if ratio <= model.elongation_ratio else [NOT_ROUND]), *([UNKNOWN_IMAGE] if outside else [])]
    if rejections:
        return without_numbers("outside_range", " ".join([*rejections, NO_NUMBERS]), origin, features | outside)
    raw = model.bundle.estimate(row[None])
    mean, spread = normalise_unknowns(raw.estimate[0]), raw.spread[0]
    numbers = numbers_in(mean, spread, ends_in_belts(mean, spread, model.belts))
    return with_numbers(numbers, features, origin, TISSUE_TAKEN)
