"""From when until when a calibration holds."""

import pytest

from device.measurement.calibration import Validity, moment
from device.measurement.quantities import InvalidQuantity

YEAR = Validity.of("2027-01-31T12:00:00Z", 365)


def test_days_count_from_the_recordings():
    assert (YEAR.measured_at, YEAR.expires_at) == ("2027-01-31T12:00:00Z", "2028-01-31T12:00:00Z")


def test_a_leap_year_has_a_day_more_than_365():
    assert Validity.of("2028-01-31T12:00:00Z", 365).expires_at == "2029-01-30T12:00:00Z"


@pytest.mark.parametrize(
    ("at", "days"),
    [("2028-01-31T12:00:00Z", 0.0), ("2028-01-01T12:00:00.000Z", 30.0), ("2028-02-01T14:00:00+02:00", -1.0)],
)
def test_the_days_left_of_a_moment(at, days):
    assert YEAR.days_left(at) == pytest.approx(days)


def test_a_clock_before_the_recordings_is_told():
    assert YEAR.is_before("2027-01-31T11:59:59Z")
    assert not YEAR.is_before("2027-01-31T12:00:00Z")


@pytest.mark.parametrize("days", [0, 36_501, -1, float("nan"), "365"])
def test_a_day_to_a_hundred_years_are_taken(days):
    with pytest.raises(InvalidQuantity, match="valid_days"):
        Validity.of("2027-01-31T12:00:00Z", days)


@pytest.mark.parametrize("text", ["yesterday", "2027-01-31T12:00:00", 7, None])
def test_what_is_no_time_with_a_zone_is_refused_by_name(text):
    with pytest.raises(InvalidQuantity, match="started_at"):
        moment(text, "started_at")
