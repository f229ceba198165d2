"""Whether a certificate still holds: by the clock and by the untouched face."""

import numpy as np
import pytest
from small_certificate import small_certificate

from device.errors import (
    ClockBehindError,
    ClockJumpError,
    ExpiredCalibration,
    LargeDriftError,
    MissingCalibration,
)
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.measurement.recording.tactile_image import Frame
from device.measurement.recording.untouched_face import UntouchedFace

LIT, DARK = (0.6, 0.6, 0.6, 0.6), (0.0, 0.0, 0.0, 0.0)
IN_TIME, LAST_MONTH = "2026-06-01T00:00:00Z", "2026-12-20T03:04:05Z"


@pytest.fixture
def watch():
    """Valid for the year 2026, with a face that shone with 20 counts."""
    return CalibrationWatch(small_certificate(untouched=UntouchedFace(4.0, (20.0,) * 4, 0.01, 100.0, 0.6)))


def unloaded(light, force_n=0.0):
    return [
        Frame(np.full((32, 32), 4 + round(counts), np.uint8), role, 0.0, force_n, ratio)
        for role, counts, ratio in (("dark", 0, DARK), ("reference", light, LIT))
    ]


def codes(watch, *others):
    return [warning.code for warning in watch.warned(others)]


def test_a_certificate_in_its_time_says_nothing(watch):
    watch.require_valid(IN_TIME)
    watch.require_no_drift(unloaded(20))
    assert codes(watch) == []


def test_a_probe_that_was_never_calibrated_measures_nothing():
    watch = CalibrationWatch(None)
    assert watch.id == ""
    watch.require_no_drift(unloaded(20))
    with pytest.raises(MissingCalibration, match="not calibrated.*activate"):
        watch.require_valid(IN_TIME)


def test_after_its_last_day_nothing_is_measured(watch):
    watch.require_valid("2027-01-02T03:04:05Z")
    with pytest.raises(ExpiredCalibration, match="has expired on 2027-01-02"):
        watch.require_valid("2027-01-02T03:04:06Z")


def test_a_clock_that_is_before_the_calibration_is_not_believed(watch):
    with pytest.raises(ClockBehindError, match="The clock says 1970-01-01, before the calibration of 2026-01-02"):
        watch.require_valid("1970-01-01T00:00:09.123Z")


def test_the_last_month_is_warned_of_and_the_warning_ends_with_it(watch):
    watch.require_valid(LAST_MONTH)
    assert codes(watch) == ["E407"]
    assert "in 13 days" in watch.warned(())[0].cause
    watch.require_valid(IN_TIME)
    assert codes(watch) == []


def test_a_commissioned_model_that_ends_before_the_certificate_is_warned_of_and_ends_the_presses(watch):
    watch.model_expires_at = "2026-07-01T00:00:00Z"
    watch.require_valid("2026-05-01T00:00:00Z")
    assert codes(watch) == []
    watch.require_valid("2026-06-20T00:00:00Z")
    assert codes(watch) == ["E407"]
    assert "commissioned model expires on 2026-07-01T00:00:00Z, in 11 days" in watch.warned(())[0].cause
    with pytest.raises(ExpiredCalibration, match="commissioned model has expired on 2026-07-01") as expired:
        watch.require_valid("2026-07-02T00:00:00Z")
    assert "set standard_model, quick_model and calibration to the new files" in expired.value.remedy


def test_where_certificate_and_commissioned_model_end_together_it_is_told_to_commission(watch):
    watch.model_expires_at = watch.calibration.validity.expires_at
    watch.require_valid(LAST_MONTH)
    assert watch.warned(())[0].remedy == "Commission the probe before that day."
    with pytest.raises(ExpiredCalibration) as refusal:
        watch.require_valid("2027-02-01T00:00:00Z")
    assert refusal.value.remedy.startswith("Commission the probe again")


@pytest.mark.parametrize(
    ("light", "expected"), [(20, []), (19, []), (18, []), (17, ["E405"]), (15, ["E405"]), (24, ["E405"])]
)
def test_more_than_a_tenth_is_warned_of(watch, light, expected):
    watch.require_no_drift(unloaded(light))
    assert codes(watch) == expected


@pytest.mark.parametrize(("light", "words"), [(14, "30% dimmer at"), (26, "30% brighter at"), (0, "100% dimmer at")])
def test_with_more_than_a_quarter_nothing_is_measured(watch, light, words):
    with pytest.raises(LargeDriftError, match=words):
        watch.require_no_drift(unloaded(light))


def test_a_face_that_was_wiped_is_measured_again_and_a_warning_is_withdrawn(watch):
    with pytest.raises(LargeDriftError):
        watch.require_no_drift(unloaded(40))
    watch.require_no_drift(unloaded(23))
    assert codes(watch) == ["E405"]
    watch.require_no_drift(unloaded(20))
    assert codes(watch) == []


@pytest.mark.parametrize("force_n", [0.03, -0.03, 0.011])
def test_light_of_a_slight_touch_is_not_taken_for_drift_but_the_check_is_missing(watch, force_n):
    """A zero that is off looks like a touch: the warning says by how much, and how to take a new one."""
    watch.require_no_drift(unloaded(40, force_n))
    [warning] = watch.warned(())
    assert (warning.code, warning.is_lasting) == ("E409", True)
    assert f"Something touches the probe: {force_n:+.3f} N, above 0.01 N" in warning.cause
    assert "nothing touch the probe" in warning.remedy
    assert "zero is off" in warning.remedy


def test_the_check_is_missing_until_the_probe_is_free_and_not_again_by_a_later_touch(watch):
    for force_n, expected in ((0.03, ["E409"]), (0.02, ["E409"]), (0.01, []), (0.03, [])):
        watch.require_no_drift(unloaded(20, force_n))
        assert codes(watch) == expected


def test_a_slight_touch_does_not_withdraw_what_was_warned_of(watch):
    watch.require_no_drift(unloaded(17))
    watch.require_no_drift(unloaded(20, force_n=0.03))
    assert codes(watch) == ["E405"]


def test_a_face_that_has_drifted_and_is_then_touched_stays_blocked_and_says_what_keeps_it_so(watch):
    with pytest.raises(LargeDriftError, match="dimmer|brighter") as judged:
        watch.require_no_drift(unloaded(40))
    assert "touches the probe" not in str(judged.value)
    with pytest.raises(LargeDriftError, match=r"not compared again: Something touches the probe: -0\.030 N") as latched:
        watch.require_no_drift(unloaded(20, force_n=-0.03))
    assert latched.value.remedy.startswith("Wipe the face. Let nothing touch the probe")
    assert "tare it, untouched" in latched.value.remedy
    watch.require_no_drift(unloaded(20))
    assert codes(watch) == []


def test_a_probe_without_a_certificate_has_no_check_to_miss():
    watch = CalibrationWatch(None)
    watch.require_no_drift(unloaded(20, force_n=0.03))
    assert codes(watch) == []


def test_warnings_of_others_stay(watch):
    jumped = ClockJumpError("The clock was set.", "Check it.")
    watch.require_no_drift(unloaded(17))
    warned = watch.warned((jumped,))
    assert [one.code for one in warned] == ["E701", "E405"]
    assert [one.code for one in watch.warned(warned)] == ["E701", "E405"]


def test_light_that_a_dark_face_lets_out_is_told_as_part_of_a_presss():
    watch = CalibrationWatch(small_certificate(untouched=UntouchedFace(4.0, (0.0,) * 4, 0.0, 60.0, 0.6)))
    watch.require_no_drift(unloaded(0))
    assert codes(watch) == []
    with pytest.raises(LargeDriftError, match="30% of a press's light, above 25%"):
        watch.require_no_drift(unloaded(18))
