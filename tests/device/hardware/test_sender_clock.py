"""Times of measurement from a sender's clock, over lines that come late."""

import numpy as np
import pytest

from device.hardware.openscale import MOST_DRIFT_RATIO, RESTART_S, SenderClock

AHEAD_S, PERIOD_S = 1234.5, 0.0125
SENT_S = PERIOD_S * np.arange(2000)


def stamped(sent_s: np.ndarray, arrivals_s: np.ndarray) -> np.ndarray:
    clock = SenderClock()
    return np.array([clock.measured_s(*pair) for pair in zip(sent_s, arrivals_s, strict=True)])


def test_a_line_that_comes_late_is_stamped_when_it_was_measured():
    """Every tenth line waits for 80 ms: it moves by no more than the drift that is allowed for, 0.1 ms a line."""
    late_s = np.where(np.arange(2000) % 10 == 9, 0.08, 0.0)
    error_s = stamped(SENT_S, SENT_S + AHEAD_S + late_s) - (SENT_S + AHEAD_S)
    assert error_s.min() >= -1e-9
    assert error_s.max() <= MOST_DRIFT_RATIO * PERIOD_S + 1e-9


def test_random_lateness_of_tens_of_milliseconds_leaves_two():
    """Waits of 15 ms on average: in fifty lines one comes at once, and the drift allowed for meanwhile is 6 ms."""
    late_s = np.random.default_rng(1).exponential(0.015, len(SENT_S))
    error_s = (stamped(SENT_S, SENT_S + AHEAD_S + late_s) - (SENT_S + AHEAD_S))[200:]
    assert error_s.max() < 0.007
    assert np.sqrt(np.mean(error_s**2)) < 0.002
    assert np.sqrt(np.mean(late_s**2)) > 0.02


@pytest.mark.parametrize("drift", [-0.009, 0.009])
def test_a_clock_that_drifts_is_followed(drift):
    """25 s at 0.9 % are 225 ms; half of the lines are 10 ms late."""
    true_s = AHEAD_S + SENT_S * (1 + drift)
    late_s = 0.01 * (np.arange(len(SENT_S)) % 2)
    error_s = stamped(SENT_S, true_s + late_s) - true_s
    assert np.abs(error_s).max() < 2 * PERIOD_S * (MOST_DRIFT_RATIO + abs(drift))


def test_a_sender_that_begins_anew_is_believed_anew():
    clock = SenderClock()
    assert clock.measured_s(50.0, 100.0) == 100.0
    assert clock.measured_s(0.01, 103.0) == 103.0
    assert clock.measured_s(0.02, 103.01) == pytest.approx(103.01)


def test_a_pause_of_the_sender_that_its_clock_does_not_tell_is_a_new_beginning():
    clock = SenderClock()
    clock.measured_s(1.0, 100.0)
    assert clock.measured_s(1.01, 100.02 + RESTART_S) == 100.02 + RESTART_S


def test_times_never_go_back():
    """The first line was late; the second, which is not, shows it too late."""
    clock = SenderClock()
    assert clock.measured_s(0.0, 100.08) == 100.08
    assert clock.measured_s(0.0125, 100.0925) == pytest.approx(100.0925)
    assert clock.measured_s(0.0250, 100.0930) == 100.0930
