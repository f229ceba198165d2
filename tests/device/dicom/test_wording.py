"""What the rows below the picture say of a measurement: numbers with their intervals, in ASCII."""

import pytest
from written_exam import ESTIMATE, quantity

from device.dicom.wording import ROW_LENGTH, remarks, rows, spoken_quantity
from device.measurement.estimate import NOTHING_STANDS_OUT
from device.measurement.quantities import UNKNOWNS

REFUSED = {
    "estimate": {**ESTIMATE, **{name: quantity(None, None, None) for name in UNKNOWNS}, "reason": NOTHING_STANDS_OUT},
    "warnings": [{"code": "E206", "title": "LED \u2014 warm", "cause": "It has 61 \u00b0C."}],
}


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


def test_a_press_that_was_refused_says_below_the_picture_why_and_what_was_noticed():
    said = rows(REFUSED, simulated=False, phantom=True)
    assert said[:3] == ["Size: not determined", "Depth of top: not determined", "Young's modulus: not determined"]
    told = " ".join(said[3:])
    assert told == f"{NOTHING_STANDS_OUT} LED ? warm. PHANTOM. Documents size, depth and modulus. Not a diagnosis."
    assert max(map(len, said)) <= ROW_LENGTH
    assert all(row.isascii() for row in said)


def test_remarks_are_whole_and_a_press_without_any_has_none():
    assert remarks(REFUSED, simulated=True) == [
        "Simulated press: no tissue was touched.", NOTHING_STANDS_OUT, "LED \u2014 warm: It has 61 \u00b0C.",
    ]  # fmt: skip
    assert remarks({"estimate": {**ESTIMATE, "reason": ""}, "warnings": []}, simulated=False) == []
