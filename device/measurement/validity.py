"""From when until when a calibration holds: it counts from the phantoms' recordings, not from when it was computed.

So computing it again from old recordings makes no probe younger. Simulated recordings are of 1970 by convention.
"""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from device.measurement.quantities import Bound, InvalidQuantity, require

ACTION = "calibrate the probe again"
VALID_DAYS = Bound(1, 36_500, "days")
"""A hundred years are for simulated probes, which do not age."""


@dataclass(frozen=True)
class Validity:
    """When the first phantom was recorded, and the moment after which the calibration does not hold."""

    measured_at: str
    expires_at: str

    def __post_init__(self) -> None:
        measured, expires = (moment(getattr(self, name), name) for name in ("measured_at", "expires_at"))
        if not expires > measured:
            raise InvalidQuantity("expires_at", self.expires_at, f"after {self.measured_at}", ACTION)

    @classmethod
    def of(cls, measured_at: str, valid_days: float) -> Validity:
        """Return the validity of so many days from a moment; raises `InvalidQuantity` outside `VALID_DAYS`."""
        require("valid_days", valid_days, VALID_DAYS, "state for how long the probe may be trusted")
        begin = moment(measured_at, "measured_at")
        return cls(written(begin), written(begin + timedelta(days=valid_days)))

    def days_left(self, at: str) -> float:
        """Return the days from a moment (RFC 3339) until the calibration expires, negative after that."""
        return (moment(self.expires_at, "expires_at") - moment(at, "time")) / timedelta(days=1)

    def is_before(self, at: str) -> bool:
        """Return whether a moment lies before the phantoms were recorded: then its clock is wrong."""
        return moment(at, "time") < moment(self.measured_at, "measured_at")


def moment(text: str, name: str) -> datetime:
    """Return a time of RFC 3339 with its zone; raise `InvalidQuantity` for anything else."""
    try:
        parsed = datetime.fromisoformat(text)
    except (TypeError, ValueError) as error:
        raise InvalidQuantity(name, repr(text), "a time of RFC 3339", ACTION) from error
    if parsed.tzinfo is None:
        raise InvalidQuantity(name, repr(text), "a time with its zone, as 2027-01-31T12:00:00Z", ACTION)
    return parsed


def written(at: datetime) -> str:
    """Return a moment as RFC 3339 in UTC, to a second."""
    return at.astimezone(UTC).isoformat(timespec="seconds").replace("+00:00", "Z")
