"""Whether the certificate still holds: by the wall clock, and by what the untouched probe looks like since the start.

An untouched face that was dark at calibration cannot show LEDs that fade: then only light that was added to it counts
(`UntouchedFace.is_resolved`); LEDs that fade are seen under the load of a press, as E206. A face that was not judged
yet is warned of and measured with: the weight of a tilted probe is enough force to keep it from being judged.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from device.errors import (
    CalibrationEndsSoon,
    ClockBehindError,
    DeviceError,
    ExpiredCalibration,
    LargeDriftError,
    MissingCalibration,
    SlightDriftError,
    UncheckedCalibration,
)
from device.measurement.calibration import Calibration, days_between
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.tactile_image import Frame
from device.measurement.recording.untouched_face import Drift

WARN_RATIO, BLOCK_RATIO = 0.10, 0.25
"""Change of the untouched face that is warned of, and that nothing is measured with."""
UNTOUCHED_N = 0.01
"""A touch by this force lets out a twentieth of the light of a press (the simulated probe's skin); 0.03 N, a tenth."""
SOON_DAYS = 30.0
OWN_WARNINGS = (CalibrationEndsSoon, SlightDriftError, UncheckedCalibration)
CALIBRATE = "Calibrate the probe and activate the new certificate, then start the daemon again."
COMMISSION = (
    "Commission the probe again and set standard_model, quick_model and calibration to the new files, "
    "then start the daemon again."
)
WIPE = "Wipe the face and keep it from touching anything; if it stays, calibrate the probe."
FREE = "Let nothing touch the probe; if the force stays, the load cell's zero is off by it: tare it, untouched."


class CalibrationWatch:
    """Judges the certificate that the daemon started with, or the lack of one.

    `model_expires_at` is until when a commissioned model holds, None where there is none.
    """

    def __init__(self, calibration: Calibration | None) -> None:
        """Take the certificate, None for a probe that was never calibrated."""
        self.calibration = calibration
        self.model_expires_at: str | None = None
        self._ending: CalibrationEndsSoon | None = None
        self._drift: SlightDriftError | LargeDriftError | None = None
        self._unchecked: UncheckedCalibration | None = None
        self._is_checked = False

    @property
    def id(self) -> str:
        """The id of the certificate, empty without one."""
        return self.calibration.id if self.calibration else ""

    @property
    def lit_ratio(self) -> LedRatio | None:
        """The brightness under which unloaded frames are to be taken for comparison; None without a certificate."""
        return self.calibration.untouched.lit_ratio if self.calibration else None

    def require_valid(self, now: str) -> None:
        """Raise the `DeviceError` by which nothing may be measured at a time (RFC 3339)."""
        if self.calibration is None:
            raise MissingCalibration("The probe is not calibrated: no certificate is active.", CALIBRATE)
        validity = self.calibration.validity
        if validity.is_before(now):
            cause = f"The clock says {now[:10]}, before the calibration of {validity.measured_at[:10]}."
            raise ClockBehindError(cause, "Set the board's clock, and check its time server.")
        model_days = days_between(now, self.model_expires_at) if self.model_expires_at else math.inf
        days_left = validity.days_left(now)
        if model_days < 0:  # a commissioned probe's certificate ends with it
            raise ExpiredCalibration(f"The commissioned model has expired on {self.model_expires_at}.", COMMISSION)
        if days_left < 0:
            raise ExpiredCalibration(f"The calibration has expired on {validity.expires_at}.", CALIBRATE)
        self._ending = None
        if model_days <= days_left and model_days < SOON_DAYS:
            cause = f"The commissioned model expires on {self.model_expires_at}, in {model_days:.0f} days."
            self._ending = CalibrationEndsSoon(cause, "Commission the probe before that day.")
        elif days_left < SOON_DAYS:
            cause = f"The calibration expires on {validity.expires_at}, in {days_left:.0f} days."
            self._ending = CalibrationEndsSoon(cause, "Calibrate the probe before that day.")

    def require_no_drift(self, unloaded: Sequence[Frame]) -> None:
        """Raise `LargeDriftError` when unloaded frames, dark and lit, are too far from the certificate's.

        Frames under a slight touch say nothing about it: then what the last untouched ones said holds, and without any
        since the start it is warned that nothing was said.
        """
        if self.calibration is None:
            return
        load_n = max((frame.force_n for frame in unloaded), key=abs)
        if abs(load_n) <= UNTOUCHED_N:
            self._drift = _checked(self.calibration.untouched.drift(unloaded))
            self._is_checked, self._unchecked = True, None
            if isinstance(self._drift, LargeDriftError):
                raise self._drift
        else:
            self._note_untold(f"Something touches the probe: {load_n:+.3f} N, above {UNTOUCHED_N:g} N.")

    def _note_untold(self, why: str) -> None:
        """Note that frames say nothing; raise the `LargeDriftError` of the last that did, with what keeps it there."""
        if isinstance(self._drift, LargeDriftError):
            raise LargeDriftError(f"{self._drift.cause} It was not compared again: {why}", f"Wipe the face. {FREE}")
        if not self._is_checked:
            self._unchecked = UncheckedCalibration(f"The face was not compared since the start: {why}", FREE)

    def warned(self, others: Sequence[DeviceError]) -> tuple[DeviceError, ...]:
        """Return these warnings with those of the certificate brought up to date."""
        own = [one for one in (self._ending, self._drift, self._unchecked) if isinstance(one, OWN_WARNINGS)]
        return (*(one for one in others if not isinstance(one, OWN_WARNINGS)), *own)


def _checked(drift: Drift) -> SlightDriftError | LargeDriftError | None:
    size = abs(drift.change_ratio)
    if size > BLOCK_RATIO:
        return LargeDriftError(f"{_described(drift)}, above {BLOCK_RATIO:.0%}.", WIPE)
    return SlightDriftError(f"{_described(drift)}, above {WARN_RATIO:.0%}.", WIPE) if size > WARN_RATIO else None


def _described(drift: Drift) -> str:
    if drift.is_of_its_own_light:
        more = "brighter" if drift.change_ratio > 0 else "dimmer"
        return f"The untouched face is {abs(drift.change_ratio):.0%} {more} at {drift.side} than at the calibration"
    light = f"{drift.change_ratio:.0%} of a press's light"
    return f"The untouched face shines at {drift.side}, which it did not at the calibration: {light}"
