"""How an interval is written: the cases that the screen's own rule is held to, too."""

import pytest
from shown_intervals import SHOWN

from device.measurement.shown_quantity import shown_ends, shown_interval, shown_mean_and_spread, shown_value


@pytest.mark.parametrize(("low", "value", "high", "shown"), SHOWN)
def test_as_many_digits_as_the_interval_supports_and_ends_outwards(low, value, high, shown):
    assert (shown_value({"low": low, "value": value, "high": high}), *shown_ends(low, high)) == shown


@pytest.mark.parametrize(("low", "value", "high", "shown"), SHOWN)
def test_what_is_written_holds_the_interval(low, value, high, shown):
    assert float(shown[1]) <= low + 1e-6
    assert float(shown[2]) >= high - 1e-6


@pytest.mark.parametrize(
    ("low_is_open", "high_is_open", "words"),
    [
        (False, False, "13.6 to 15.0 mm"),
        (True, False, "15.0 mm or less"),
        (False, True, "13.6 mm or more"),
        (True, True, "any value"),
    ],
)
def test_an_open_end_has_no_number(low_is_open, high_is_open, words):
    quantity = {"low": 13.674, "high": 15.0, "low_is_open": low_is_open, "high_is_open": high_is_open}
    assert shown_interval("size_mm", quantity) == words


@pytest.mark.parametrize(
    ("mean", "spread", "shown"),
    [
        (10.234, 0.3456, ("10.23", "0.35")),
        (83.456, 9.96, ("83", "10")),
        (83.456, 1.23, ("83.5", "1.2")),
        (83.456, 12.3, ("83", "12")),
        (10.234, 0.0012, ("10.23", "0.00")),
        (10.234, 0.0, ("10.23", "0.00")),
    ],
)
def test_a_spread_has_two_digits_that_count_and_its_mean_as_many_decimals(mean, spread, shown):
    assert shown_mean_and_spread(mean, spread) == shown
