"""One row of the dial: errors of what is answered and of all presses, and what a guess would have been."""

import pytest

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.quantities import Inclusion
from host_tools.scores import dial
from host_tools.scores.dial import TimedAnswers, _guess, _row, _tissue_row, timed_presses
from host_tools.scores.score_recordings import PRIOR_GUESS


def press(size_mm, found_mm, seconds, *, identifiable=True, tissue_kpa=5.0):
    quantity = Quantity(found_mm, 0.0, 20.0, 1.0, identifiable)
    if found_mm is None:
        quantity = UNKNOWN_QUANTITY
    features = {} if found_mm is None else {"tissue_modulus_kpa": 5.0, "tissue_modulus_std_kpa": 0.2}
    estimate = Estimate(quantity, quantity, quantity, "ok", "", "standard", "m", "0", "c", True, features)
    return TimedAnswers(Inclusion(size_mm, size_mm, size_mm), tissue_kpa, estimate, seconds)


FOUND = [press(10.0, 11.0, 0.02), press(10.0, 9.5, 0.04), press(10.0, 8.0, 0.03, identifiable=False)]


def test_a_row_has_the_median_error_of_what_is_answered_and_the_share_determined():
    """Errors of 10, 5 and 20 %; the fourth press is not answered, and the guesses are 8.5 mm, 8 mm and 40 kPa."""
    row = _row("standard", [*FOUND, press(10.0, None, 0.03)])
    assert row[:7] == ("standard", "10", "30", "3 of 4", "10.0 %", "10.0 %", "10.0 %")
    assert row[7:] == ("12.5 %", "15.0 %", "15.0 %", "67%", "67%", "67%")


def test_a_guess_is_the_middle_of_the_ranges():
    """The modulus' by its logarithm: the root of 10 and 160 kPa."""
    assert PRIOR_GUESS.as_tuple() == pytest.approx((8.5, 8.0, 40.0))


@pytest.mark.parametrize(("mode", "ramps"), [("quick", 1), ("standard", 1), ("precise", 2)])
def test_a_scan_has_two_ramps_and_is_of_the_same_inclusions(tables, monkeypatch, mode, ramps):
    asked = []

    def recorded(tables, at, mode, seed, *, levels, further_mm):
        asked.append((at, further_mm))

    monkeypatch.setattr(dial, "recorded_press", recorded)
    found = timed_presses(lambda recording, mode: FOUND[0].estimate, mode, tables, presses=3)
    assert [len(further_mm) for _, further_mm in asked] == [ramps - 1] * 3
    assert all(2.0 < further_mm[0] < 7.0 for _, further_mm in asked if ramps > 1)
    expected = timed_presses(lambda recording, mode: FOUND[0].estimate, "standard", tables, presses=3)
    assert [one.truth for one in found] == [one.truth for one in expected]


def test_the_guess_is_scored_on_all_presses():
    """Of 5, 10 and 20 mm: 8.5, 8 and 40 miss by 70, 15 and 57.5 %, by 60, 20 and 60 %, by 700, 300 and 100 %."""
    truths = [press(size, 1.0, 0.0) for size in (5.0, 10.0, 20.0)]
    assert _guess(truths)[4:10] == ("", "", "", "57.5 %", "60.0 %", "300.0 %")


def test_the_tissue_is_scored_where_it_is_told():
    """5.0 kPa +- 4 % for 4.6 and 5.3: off by 8.7 and 5.7 %, and the range alone would leave ln 15 / 2 / sqrt(3)."""
    found = [press(10.0, 10.0, 0.0, tissue_kpa=tissue) for tissue in (4.6, 5.3)]
    assert _tissue_row([*found, press(10.0, None, 0.0)]) == ("2", "7.3%", "4.0%", "78%", "50%")
