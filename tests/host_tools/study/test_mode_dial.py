"""One row of the dial: errors of what is answered, and what a guess would have been."""

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.quantities import Inclusion
from host_tools.study.mode_dial import Timed, _guess, _row


def press(size_mm, found_mm, seconds, *, identifiable=True):
    quantity = Quantity(found_mm, 0.0, 20.0, 1.0, identifiable)
    if found_mm is None:
        quantity = UNKNOWN_QUANTITY
    estimate = Estimate(quantity, quantity, quantity, "ok", "", "standard", "m", "0", "c", True, {})
    return Timed(Inclusion(size_mm, size_mm, size_mm), estimate, seconds)


FOUND = [press(10.0, 11.0, 0.02), press(10.0, 9.5, 0.04), press(10.0, 8.0, 0.03, identifiable=False)]


def test_a_row_has_the_median_error_of_what_is_answered_and_the_share_determined():
    """Errors of 10, 5 and 20 %; the fourth press is not answered."""
    row = _row("standard", [*FOUND, press(10.0, None, 0.03)])
    assert row == ("standard", "10", "30", "3 of 4", "10.0 %", "10.0 %", "10.0 %", "67%", "67%", "67%")


def test_a_guess_is_the_median_of_the_truths():
    """5, 10 and 20 mm, guessed 10: errors of 100, 0 and 50 %."""
    truths = [press(size, 1.0, 0.0) for size in (5.0, 10.0, 20.0)]
    assert _guess({"standard": truths})[4:7] == ("50.0 %",) * 3
