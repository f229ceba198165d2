"""The answer to a press: size, depth and Young's modulus, each with a 90 % interval, and a status in words.

What all modes share: where an estimate is from, when an image is saturated, and how numbers, or the lack of them, are
told. Each mode has an estimator of its own, which ends here. Source of the format: docs/contracts.md.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.bundle import ModelBundle
from device.measurement.calibration import Calibration, moment
from device.measurement.confidence_belt import COVERAGE
from device.measurement.mode import Mode
from device.measurement.parameters import COUNT, HIGH, LOW, denormalise_unknowns
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from device.measurement.recording.recording import Recording
from device.measurement.recording.tactile_image import saturated_ratio

EstimateStatus = Literal[
    "ok", "partly_identifiable", "outside_range", "no_contact", "saturated", "not_identifiable", "rejected"
]
"""`partly_identifiable`: some unknowns are determined, most often size and depth; `not_identifiable`: none is."""

SATURATED_RATIO = 0.001
"""More pixels than this at full scale, and the sum and the peak are no longer the light."""
SHADE = "Shade the probe and press again; if the message stays, lower the light."
NOTHING_STANDS_OUT = (
    "No inclusion can be told from the tissue here. Press again where you feel it; if the message stays, "
    "there is none, or it is too small, too soft or too deep for the probe."
)
NOT_ROUND = "The inclusion is not round."
NO_NUMBERS = (
    "No numbers are given. Press again a little beside it; if the message stays, note the finding without numbers."
)
"""What to do when a press is not of one round inclusion that the probe can measure."""
UNKNOWN_IMAGE = "The image is unlike any that the probe can measure."
SPOKEN = {"size_mm": "size", "depth_mm": "depth", "youngs_modulus_kpa": "Young's modulus"}


@dataclass(frozen=True)
class Quantity:
    """One unknown: estimate, 90 % interval, standard deviation, and whether the data determine it.

    `std`: in mode paper the scatter over the frames, None where the data do not determine the unknown; else the spread
    that the model states. An interval that ends where the trained range does is open there: what lies beyond was never
    tried, and may be.
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
    """The answer to one press; the level is that of its intervals."""

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
    model_card_sha256: str = ""
    interval_level_percent: float = 100 * COVERAGE

    def as_record(self) -> dict[str, Any]:
        """Return the estimate as the JSON object of docs/contracts.md."""
        record = asdict(self)
        del record["features"]
        return record


@dataclass(frozen=True)
class Origin:
    """Where an estimate is from: mode, model, certificate, and whether the press was simulated.

    `model_sha256` is of the network, which commissioned probes share with their design; `model_card_sha256` of the
    card, which names the hash of everything that answers.
    """

    mode: Mode
    model: str
    model_sha256: str
    model_card_sha256: str
    calibration_id: str
    simulated: bool


def origin_of(recording: Recording, mode: Mode, bundle: ModelBundle, calibration: Calibration) -> Origin:
    """Return where an estimate is from; raises `InvalidQuantity` for a pixel size that the certificate is not for."""
    calibration.require_scale(recording.camera.scale)
    return Origin(mode, bundle.name, bundle.sha256, bundle.card_sha256, calibration.id, recording.simulated)


def require_trained_for(recording: Recording, bundle: ModelBundle, calibration: Calibration) -> None:
    """Raise `InvalidQuantity` for a probe that the certificate, or the model itself, is not for, or not any more.

    The card's `serials` are the probes whose light and tables the model was trained with; that of a commissioned
    probe's has `expires_at`, too.
    """
    serials = bundle.card.get("serials", [])
    if recording.serial not in serials:
        expected = f"one of {', '.join(serials)}, which {bundle.name} is trained for"
        action = "commission this probe with `host_tools commission`"
        raise InvalidQuantity("serial", recording.serial, expected, action)
    expires_at = bundle.card.get("expires_at")
    if expires_at is not None and moment(recording.started_at, "started_at") > moment(expires_at, "expires_at"):
        action = "commission the probe again"
        raise InvalidQuantity(
            "time of the press", recording.started_at, f"before {expires_at} of {bundle.name}", action
        )
    if calibration.serial != recording.serial:
        found, expected = f"for probe {calibration.serial}", f"for probe {recording.serial}"
        raise InvalidQuantity("calibration", found, expected, "use the probe's own certificate")


def saturation(recording: Recording) -> str:
    """Return a sentence when too many pixels of the press are at full scale; "" is good."""
    ratio = max((saturated_ratio(frame.counts) for frame in recording.with_role("press")), default=0.0)
    if ratio <= SATURATED_RATIO:
        return ""
    return f"The image is too bright: {ratio:.1%} of its pixels are saturated, above {SATURATED_RATIO:.1%}. {SHADE}"


@dataclass(frozen=True, eq=False)
class Numbers:
    """Each [3] in the unknowns' own units: value, standard deviation, 90 % interval, whether the data determine it.

    A standard deviation of which nothing is known is NaN.
    `range_low`, `range_high`: the trained range, with whose ends an interval is open.
    """

    value: Array
    std: Array
    low: Array
    high: Array
    is_identifiable: NDArray[np.bool_]
    range_low: Array
    range_high: Array

    def quantities(self) -> dict[str, Quantity]:
        """Return them by the names of the unknowns; a model may extrapolate, but no value leaves its interval."""
        value = np.clip(self.value, self.low, self.high)
        return {
            name: Quantity(
                float(value[i]),
                float(self.low[i]),
                float(self.high[i]),
                float(self.std[i]) if np.isfinite(self.std[i]) else None,
                bool(self.is_identifiable[i]),
                low_is_open=bool(self.low[i] <= self.range_low[i]),
                high_is_open=bool(self.high[i] >= self.range_high[i]),
            )
            for i, name in enumerate(UNKNOWNS)
        }


class IntervalEnds(Protocol):
    """Ends [3] of the unknowns' intervals in coordinates, and whether the press narrows each one's range down."""

    @property
    def low(self) -> Array:
        """Lower ends."""
        ...

    @property
    def high(self) -> Array:
        """Upper ends."""
        ...

    @property
    def is_identifiable(self) -> NDArray[np.bool_]:
        """Whether the data determine it."""
        ...


def numbers_in(mean: Array, spread: Array, ends: IntervalEnds) -> Numbers:
    """Return the numbers of mean and spread [3] in coordinates (`parameters.normalise`), within intervals.

    The standard deviation is half of what mean - spread to mean + spread spans in the unknown's own unit.
    """
    low, high = denormalise_unknowns(ends.low), denormalise_unknowns(ends.high)
    below, above = (denormalise_unknowns(mean + sign * spread) for sign in (-1, 1))
    known = ends.is_identifiable
    return Numbers(denormalise_unknowns(mean), (above - below) / 2, low, high, known, LOW[:COUNT], HIGH[:COUNT])


def with_numbers(
    numbers: Numbers, features: Mapping[str, float], origin: Origin, taken_for_granted: str = ""
) -> Estimate:
    """Return the estimate of numbers; it says which of the unknowns the press does not determine.

    `taken_for_granted`: a sentence on what the numbers rest on and the press does not tell.
    """
    quantities: dict[str, Any] = numbers.quantities()
    unknown = [SPOKEN[name] for name, one in quantities.items() if not one.identifiable]
    undetermined = f"This press does not determine {' and '.join(unknown)}." if unknown else ""
    reason = " ".join(filter(None, (undetermined, taken_for_granted)))
    of_unknown: dict[int, EstimateStatus] = {0: "ok", len(UNKNOWNS): "not_identifiable"}
    status = of_unknown.get(len(unknown), "partly_identifiable")
    return Estimate(**quantities, status=status, reason=reason, features=dict(features), **asdict(origin))


def without_numbers(
    status: EstimateStatus, reason: str, origin: Origin, features: Mapping[str, float] = MappingProxyType({})
) -> Estimate:
    """Return an estimate that says why there are no numbers; the figures behind the reason are among its features."""
    unknown: dict[str, Any] = dict.fromkeys(UNKNOWNS, UNKNOWN_QUANTITY)
    return Estimate(**unknown, status=status, reason=reason, features=dict(features), **asdict(origin))


def with_critical(found: Mapping[str, float], critical: Mapping[str, float]) -> dict[str, float]:
    """Return features with the critical value of each, beyond which a press gets no numbers, under `critical_`."""
    return dict(found) | {f"critical_{name}": value for name, value in critical.items()}


def outside_training(bundle: ModelBundle, row: Array) -> dict[str, float]:
    """Return the trained range of each feature in a row [F] that lies outside it, as features; {} is good."""
    return {
        f"trained_{end}_{name}": value
        for name, ends in bundle.outside_training_range(row).items()
        for end, value in zip(("low", "high"), ends, strict=True)
    }
