"""What the rows below the picture say of a measurement: numbers with their intervals, in ASCII."""

import pytest
from written_exam import quantity

from device.dicom.wording import spoken_quantity


@pytest.mark.parametrize(
    ("value", "low", "high", "is_open", "words"),
    [
        (14.1855, 13.674, 15.0, {}, "Size: 14.2 mm (90 %: 13.6 to 15.0 mm)"),
        (14.1855, 13.38, 15.0, {"high_is_open": True}, "Size: 14.2 mm (90 %: 13.3 mm or more)"),
        (5.2, 4.0, 7.41, {"low_is_open": True}, "Size: 5.2 mm (90 %: 7.5 mm or less)"),
        (9.0, 4.0, 15.0, {"low_is_open": True, "high_is_open": True}, "Size: 9 mm (90 %: any value)"),
        (None, None, None, {}, "Size: not determined"),
        (9.0, 4.0, 15.0, {"identifiable": False}, "Size: not determined"),
    ],
)
def test_an_interval_is_never_narrower_than_it_was_measured_and_an_open_end_has_no_number(
    value, low, high, is_open, words
):
    said = spoken_quantity("size_mm", {**quantity(value, low, high), **is_open})
    assert said == words
    assert said.isascii()
