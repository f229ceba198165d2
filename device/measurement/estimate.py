"""A recording to its estimate: size, depth and Young's modulus, each with a 90 % interval, and a status in words.

Every press frame is estimated on its own and the estimates are averaged; their standard deviation is the scatter of
this press, not its accuracy. Accuracy is the interval, which comes from held-out scenes. Source: Lee & Won 2013,
section IV: ten images a lesion, averaged.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from device.measurement.calibration import Calibration
from device.measurement.paper_mode.features import FEATURE_NAMES, FeatureSettings, extract_features
from device.measurement.paper_mode.inversion import ModelBundle
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import saturated_ratio

EstimateStatus = Literal["ok", "outside_range", "no_contact", "saturated", "not_identifiable", "rejected"]

CONTACT_N = 0.05
"""Below this mean force the probe touches nothing."""
SATURATED_RATIO = 0.001
"""More pixels than this at full scale, and the sum and the peak are no longer the light."""
VISIBLE_CONTRAST = 0.002
"""An inclusion whose peak is fainter than this is not told from the residue of light, force and camera."""

SPOKEN = {"size_mm": "size", "depth_mm": "depth", "youngs_modulus_kpa": "Young's modulus"}


@dataclass(frozen=True)
class Quantity:
    """One unknown: estimate, 90 % interval, scatter over the frames, and whether the data determine it.

    An interval that ends where the trained range does is open there: what lies beyond was never tried, and may be.
    """

    value: float | None
    low: float | None
    high: float | None
    std: float | None
    identifiable: bool
    low_is_open: bool = False
    high_is_open: bool = False


UNKNOWN_QUANTITY = Quantity(None, None, None, None, False)


@dataclass(frozen=True)
class Estimate:
    """The answer to one press."""

    size_mm: Quantity
    depth_mm: Quantity
    youngs_modulus_kpa: Quantity
    status: EstimateStatus
    reason: str
    mode: str
    model: str
    model_sha256: str
    calibration_id: str
    simulated: bool
    features: dict[str, float]

    def as_record(self) -> dict[str, Any]:
        """Return the estimate as the JSON object of docs/contracts.md."""
        record = asdict(self)
        del record["features"]
        return record


def estimate_recording(recording: Recording, bundle: ModelBundle, calibration: Calibration) -> Estimate:
    """Return the estimate of a recording.

    Raises `InvalidQuantity` when the recording lacks a role, or the calibration is not for this model or probe.
    """
    calibration.require_for(recording.serial, bundle)
    calibration.require_scale(recording.camera.scale)
    press = recording.with_role("press")
    if not press:
        raise InvalidQuantity("press frames", 0, "at least one", "record frames while the probe presses the lesion")
    force_n = float(np.mean([frame.force_n for frame in press]))
    if force_n < CONTACT_N:
        reason = f"The mean force is {force_n:.3f} N, below {CONTACT_N} N: press the lesion."
        return _without_answer("no_contact", reason, recording, bundle, calibration)
    if not calibration.holds_at(force_n):
        reason = (
            f"The mean force is {force_n:.3f} N, not the {calibration.force_n:g} N of the calibration: press again."
        )
        return _without_answer("rejected", reason, recording, bundle, calibration)
    saturated = max(saturated_ratio(frame.counts) for frame in press)
    if saturated > SATURATED_RATIO:
        reason = f"{saturated:.1%} of the pixels are saturated, above {SATURATED_RATIO:.1%}: lower the light."
        return _without_answer("saturated", reason, recording, bundle, calibration)
    image_rows = image_features(recording, calibration.settings)
    peak = float(image_rows[:, 0].mean())
    if peak < VISIBLE_CONTRAST:
        reason = f"No inclusion stands out: peak contrast {peak:.2%}, below {VISIBLE_CONTRAST:.1%}."
        return _without_answer("not_identifiable", reason, recording, bundle, calibration)
    return _answer(image_rows, recording, bundle, calibration)


def image_features(recording: Recording, settings: FeatureSettings) -> NDArray[np.float64]:
    """Return the image features [n, 3] of a recording's press frames."""
    return np.array([extract_features(image, settings).as_row() for image in recording.press_images()])


def _answer(
    image_rows: NDArray[np.float64], recording: Recording, bundle: ModelBundle, calibration: Calibration
) -> Estimate:
    rows = calibration.deformation_features(image_rows)
    estimates = bundle.estimate(rows).estimate.astype(float)
    mean, std = estimates.mean(axis=0), _scatter(estimates)
    outside = bundle.outside_training_range(rows.mean(axis=0))
    if outside:
        return _without_answer("outside_range", " ".join(outside), recording, bundle, calibration)
    interval = calibration.held_out.interval(mean)
    value = np.clip(mean, interval.low, interval.high)  # a network may extrapolate; its interval cannot
    status, reason = _verdict(interval.identifiable)
    quantities: dict[str, Any] = {
        name: Quantity(
            float(value[i]),
            float(interval.low[i]),
            float(interval.high[i]),
            float(std[i]),
            bool(interval.identifiable[i]),
            low_is_open=bool(interval.low[i] <= calibration.held_out.box_low[i]),
            high_is_open=bool(interval.high[i] >= calibration.held_out.box_high[i]),
        )
        for i, name in enumerate(UNKNOWNS)
    }
    return Estimate(
        **quantities,
        status=status,
        reason=reason,
        features=_named(image_rows.mean(axis=0), rows.mean(axis=0), bundle),
        **_origin(recording, bundle, calibration),
    )


def _named(image_row: NDArray[np.float64], row: NDArray[np.float64], bundle: ModelBundle) -> dict[str, float]:
    names = (*FEATURE_NAMES, *bundle.feature_names)
    return {name: float(value) for name, value in zip(names, (*image_row, *row), strict=True)}


def _scatter(estimates: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the standard deviation [3] over the frames; of one frame there is none to see."""
    return np.asarray(estimates.std(axis=0, ddof=1) if len(estimates) > 1 else np.zeros(estimates.shape[1]))


def _verdict(identifiable: NDArray[np.bool_]) -> tuple[EstimateStatus, str]:
    open_ones = [SPOKEN[name] for name, known in zip(UNKNOWNS, identifiable, strict=True) if not known]
    if open_ones:
        return "not_identifiable", f"This press does not determine {' and '.join(open_ones)}."
    return "ok", ""


def _without_answer(
    status: EstimateStatus, reason: str, recording: Recording, bundle: ModelBundle, calibration: Calibration
) -> Estimate:
    unknown: dict[str, Any] = dict.fromkeys(UNKNOWNS, UNKNOWN_QUANTITY)
    origin = _origin(recording, bundle, calibration)
    return Estimate(**unknown, status=status, reason=reason, features={}, **origin)


def _origin(recording: Recording, bundle: ModelBundle, calibration: Calibration) -> dict[str, Any]:
    return {
        "mode": "paper",
        "model": bundle.name,
        "model_sha256": bundle.sha256,
        "calibration_id": calibration.id,
        "simulated": recording.simulated,
    }
