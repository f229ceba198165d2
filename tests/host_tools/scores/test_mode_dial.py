"""One row of the dial: errors of what is answered, and what a guess would have been."""

from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate, Quantity
from device.measurement.quantities import Inclusion
from host_tools.scores.dial import TimedAnswers, _guess, _row, _tissue_row


def press(size_mm, found_mm, seconds, *, identifiable=True, tissue_kpa=5.0):
    quantity = Quantity(found_mm, 0.0, 20.0, 1.0, identifiable)
    if found_mm is None:
        quantity = UNKNOWN_QUANTITY
    features = {} if found_mm is None else {"tissue_modulus_kpa": 5.0, "tissue_modulus_std_kpa": 0.2}
    estimate = Estimate(quantity, quantity, quantity, "ok", "", "standard", "m", "0", "c", True, features)
    return TimedAnswers(Inclusion(size_mm, size_mm, size_mm), tissue_kpa, estimate, seconds)


FOUND = [press(10.0, 11.0, 0.02), press(10.0, 9.5, 0.04), press(10.0, 8.0, 0.03, identifiable=False)]


def test_a_row_has_the_median_error_of_what_is_answered_and_the_share_determined():
    """Errors of 10, 5 and 20 %; the fourth press is not answered."""
    row = _row("standard", [*FOUND, press(10.0, None, 0.03)])
    assert row == ("standard", "10", "30", "3 of 4", "10.0 %", "10.0 %", "10.0 %", "67%", "67%", "67%")


def test_a_guess_is_the_median_of_the_truths():
    """5, 10 and 20 mm, guessed 10: errors of 100, 0 and 50 %."""
    truths = [press(size, 1.0, 0.0) for size in (5.0, 10.0, 20.0)]
    assert _guess({"standard": truths})[4:7] == ("50.0 %",) * 3


def test_the_tissue_is_scored_where_it_is_told():
    """5.0 +- 0.2 kPa for 4.6 and 5.3: off by 0.4 and 0.3, and the range alone would leave 1 kPa / sqrt(3)."""
    found = [press(10.0, 10.0, 0.0, tissue_kpa=tissue) for tissue in (4.6, 5.3)]
    assert _tissue_row([*found, press(10.0, None, 0.0)]) == ("2", "0.35", "0.20", "0.58", "50%")
