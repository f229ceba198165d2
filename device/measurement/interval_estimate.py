"""Means and spreads to an estimate in words: values in mm and kPa, each in its 90 % interval, or why there is none.

Shared by the modes whose networks answer in coordinates (`press_parameters.to_unit`).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from device.measurement.arrays import Array
from device.measurement.calibration import Calibration
from device.measurement.confidence_belt import Bands, Interval
from device.measurement.estimate import SATURATED_RATIO, SPOKEN, UNKNOWN_QUANTITY, Estimate, EstimateStatus, Quantity
from device.measurement.mode import Mode
from device.measurement.paper_mode.inversion import ModelBundle
from device.measurement.parameters import unknowns_from_unit
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import saturated_ratio

Origin = dict[str, Any]


def origin_of(recording: Recording, mode: Mode, bundle: ModelBundle, calibration: Calibration) -> Origin:
    """Return where an estimate is from; refuse a probe or pixel size that model and certificate are not for.

    Raises `InvalidQuantity`. The card's `serials` are the probes whose light and tables the model was trained with.
    """
    serials = bundle.card.get("serials", [])
    if recording.serial not in serials:
        expected = f"one of {', '.join(serials)}, which {bundle.name} is trained for"
        raise InvalidQuantity(
            "serial", recording.serial, expected, "press in mode paper, or train a model for this one"
        )
    if calibration.serial != recording.serial:
        found, expected = f"for probe {calibration.serial}", f"for probe {recording.serial}"
        raise InvalidQuantity("calibration", found, expected, "use the probe's own certificate")
    calibration.require_scale(recording.camera.scale)
    return {
        "mode": mode,
        "model": bundle.name,
        "model_sha256": bundle.sha256,
        "calibration_id": calibration.id,
        "simulated": recording.simulated,
    }


def saturation(recording: Recording) -> str:
    """Return a sentence when too many pixels of the press are at full scale; "" is good."""
    ratio = max((saturated_ratio(frame.counts) for frame in recording.with_role("press")), default=0.0)
    if ratio <= SATURATED_RATIO:
        return ""
    return f"{ratio:.1%} of the pixels are saturated, above {SATURATED_RATIO:.1%}: lower the light."


def with_numbers(
    mean: Array, spread: Array, bands: Sequence[Bands], features: dict[str, float], origin: Origin
) -> Estimate:
    """Return the estimate of mean and spread [3] in coordinates; `std` is the spread in the unknown's own unit."""
    intervals = [band.interval(float(at), float(width)) for band, at, width in zip(bands, mean, spread, strict=True)]
    unknown = [SPOKEN[name] for name, one in zip(UNKNOWNS, intervals, strict=True) if not one.is_identifiable]
    reason = f"This press does not determine {' and '.join(unknown)}." if unknown else ""
    status: EstimateStatus = "not_identifiable" if unknown else "ok"
    quantities = _quantities(mean, spread, intervals)
    return Estimate(**quantities, status=status, reason=reason, features=features, **origin)


def without_numbers(status: EstimateStatus, reason: str, origin: Origin) -> Estimate:
    """Return an estimate that says why there are no numbers."""
    unknown: dict[str, Any] = dict.fromkeys(UNKNOWNS, UNKNOWN_QUANTITY)
    return Estimate(**unknown, status=status, reason=reason, features={}, **origin)


def _quantities(mean: Array, spread: Array, intervals: Sequence[Interval]) -> dict[str, Any]:
    low, high = (unknowns_from_unit(np.array([one[end] for one in intervals])) for end in (0, 1))
    value = np.clip(unknowns_from_unit(mean), low, high)
    below, above = (unknowns_from_unit(mean + sign * spread) for sign in (-1, 1))
    return {
        name: Quantity(
            float(value[i]),
            float(low[i]),
            float(high[i]),
            float(above[i] - below[i]) / 2,
            one.is_identifiable,
            low_is_open=one.low <= -1.0,
            high_is_open=one.high >= 1.0,
        )
        for i, (name, one) in enumerate(zip(UNKNOWNS, intervals, strict=True))
    }
