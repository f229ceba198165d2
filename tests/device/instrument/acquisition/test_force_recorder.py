"""Force over time, from a cell whose samples are written down here: 1000 counts are 1 N, 500 counts are no load."""

import itertools
import math
import threading
from queue import Empty, Queue

import numpy as np
import pytest

from device.errors import LoadCellError, OverloadedCellError, ZeroShiftError
from device.hardware.interfaces import CellSample, ForceScale
from device.instrument.acquisition import force_recorder
from device.instrument.acquisition.force_recorder import ForceRecorder
from device.instrument.acquisition.load_limit import LoadLimit

SCALE = ForceScale(sensitivity_counts_per_n=1000.0, tare_counts=500.0)
LIMIT = LoadLimit(ForceScale(sensitivity_counts_per_n=1000.0, tare_counts=0.0), max_load_n=5.0, max_drift_n=1.0)
"""At commissioning the zero was 0 counts: today's 500 counts of weight are half a newton of the load it bears."""
UNPLUGGED = LoadCellError("The cell is gone.", "Plug it in.")
HELD = ZeroShiftError("The zero is 2 N off.", "Lift the probe.")


def tare(read):
    """The tare of a probe that nobody touches; it takes no reading."""
    return SCALE, LIMIT


class ScriptedCell:
    """Gives what was put into its script; silence and what is put as an error are errors."""

    def __init__(self, *samples):
        self.script, self.is_closed, self.pause_s = Queue(), False, 0.0
        self.say(*samples)

    def say(self, *samples):
        for sample in samples:
            self.script.put(sample)

    def read(self, *, timeout_s):
        try:
            sample = self.script.get(timeout=timeout_s)
        except Empty:
            raise LoadCellError("The cell is silent.", "Check its cable.") from None
        if isinstance(sample, Exception):
            raise sample
        return CellSample(*sample)

    def close(self):
        self.is_closed = True


@pytest.fixture(autouse=True)
def _short_waits(monkeypatch):
    monkeypatch.setattr(force_recorder, "SILENCE_S", 0.5)
    monkeypatch.setattr(force_recorder, "RETRY_S", 0.005)


@pytest.fixture
def cell():
    return ScriptedCell((1.0, 500.0), (2.0, 2500.0), (4.0, 1500.0))


@pytest.fixture
def recorder(cell):
    recorder = ForceRecorder(cell, tare)
    recorder.at(4.0)
    yield recorder
    closing = threading.Thread(target=recorder.close)
    closing.start()
    cell.say(UNPLUGGED)  # wakes the reading thread
    closing.join()


def reached(condition):
    """Wait, at most half a minute, until a condition holds."""
    waiting = threading.Event()
    return any(condition() or waiting.wait(0.005) for _ in range(6000))


@pytest.mark.parametrize(("t_s", "force_n"), [(1.0, 0.0), (1.25, 0.5), (1.5, 1.0), (2.0, 2.0), (3.0, 1.5), (4.0, 1.0)])
def test_the_force_is_interpolated_between_samples(recorder, t_s, force_n):
    assert recorder.at(t_s) == pytest.approx(force_n)


def test_a_ramp_with_a_tremor_is_known_to_a_millinewton_in_the_middle_of_every_exposure(cell, recorder):
    """80 samples a second of 0.15 N/s and 2 mN at 9.3 Hz: the chord of the tremor is 0.1 mN off at most."""

    def force_n(t_s):
        return 0.15 * (t_s - 5.0) + 0.002 * math.sin(2 * math.pi * 9.3 * t_s)

    cell.say(*((5.0 + k / 80, 500.0 + 1000.0 * force_n(5.0 + k / 80)) for k in range(400)))
    middles_s = [5.1 + k / 30 + 0.002 for k in range(120)]
    assert [recorder.at(t_s) for t_s in middles_s] == pytest.approx([force_n(t_s) for t_s in middles_s], abs=0.001)
    straight = [recorder.at(t_s) - 0.15 * (t_s - 5.0) for t_s in middles_s]
    assert max(straight) > 0.0015  # the tremor is followed, not averaged out


def test_the_latest_force_is_that_of_the_last_sample(recorder):
    assert recorder.latest_n == pytest.approx(1.0)


def test_a_time_after_the_last_sample_waits_for_the_next(recorder, cell):
    """4 s: 1 N, 6 s: 3 N. Asked for 5 s before the sample of 6 s has come."""
    later = threading.Timer(0.05, cell.say, [(6.0, 3500.0)])
    later.start()
    assert recorder.at(5.0) == pytest.approx(2.0)


def test_a_time_before_the_first_sample_is_refused_not_extrapolated(recorder):
    with pytest.raises(LoadCellError, match=r"No force is known 0\.250 s before the first sample"):
        recorder.at(0.75)


def test_silence_is_an_error_after_the_time_allowed(recorder):
    with pytest.raises(LoadCellError, match=r"no sample for 0\.05 s"):
        recorder.at(5.0, timeout_s=0.05)


@pytest.mark.parametrize(
    ("t_s", "window_s", "range_n"), [(4.0, 3.0, 2.0), (4.0, 2.5, np.inf), (4.0, 0.5, np.inf), (3.0, 1.0, np.inf)]
)
def test_the_range_is_largest_minus_smallest_of_three_samples_and_more(recorder, t_s, window_s, range_n):
    """Of two a hand that trembles may be as steady as a bench: an amplifier that is slow must not say so."""
    assert recorder.range_n(t_s, window_s=window_s) == pytest.approx(range_n)


def test_a_zero_that_has_crept_is_moved_to_what_is_read(recorder):
    read_n, shift_n = recorder.latest_n, recorder.zero_shift_n
    recorder.move_zero(0.003)
    assert recorder.latest_n == pytest.approx(read_n - 0.003)
    assert recorder.zero_shift_n == pytest.approx(shift_n + 0.003)
    with pytest.raises(ZeroShiftError):
        recorder.move_zero(100.0)
    assert recorder.zero_shift_n == pytest.approx(shift_n + 0.003)


def test_a_window_without_a_sample_is_not_steady(recorder):
    assert recorder.range_n(3.0, window_s=0.5) == float("inf")


def test_a_fault_is_kept_until_samples_come_again(recorder, cell):
    cell.say(UNPLUGGED)
    assert reached(lambda: recorder.fault)
    with pytest.raises(LoadCellError, match="The cell is gone"):
        _ = recorder.latest_n
    with pytest.raises(LoadCellError, match="The cell is gone"):
        recorder.at(9.0, timeout_s=0.02)
    cell.say((9.0, 1250.0))
    assert recorder.at(9.0) == pytest.approx(0.75)
    assert recorder.latest_n == pytest.approx(0.75)


def test_an_overload_counts_from_the_zero_of_commissioning_and_is_over_when_the_load_is_taken_off(recorder, cell):
    """5.0 N from the first tare is borne, 5.1 N is not, though both are half a newton less by today's tare."""
    cell.say((5.0, 5000.0))
    assert recorder.at(5.0) == pytest.approx(4.5)
    cell.say((6.0, 5100.0))
    assert reached(lambda: recorder.fault)
    with pytest.raises(OverloadedCellError, match=r"carries \+5\.10 N"):
        _ = recorder.latest_n
    with pytest.raises(OverloadedCellError):
        recorder.at(6.0, timeout_s=0.02)
    cell.say((7.0, 600.0))
    assert recorder.at(7.0) == pytest.approx(0.1)
    assert recorder.latest_n == pytest.approx(0.1)


def test_the_samples_of_an_overload_are_taken_as_they_come_not_one_a_retry(recorder, cell, monkeypatch):
    """Fifty of them would otherwise keep the fault for fifty retries after it is over."""
    monkeypatch.setattr(force_recorder, "RETRY_S", 60.0)
    cell.say(*((5.0 + k, 9000.0) for k in range(50)), (60.0, 500.0))
    assert recorder.at(60.0, timeout_s=5.0) == pytest.approx(0.0)


def test_what_was_recorded_before_a_fault_is_still_known(recorder, cell):
    cell.say(UNPLUGGED)
    assert reached(lambda: recorder.fault)
    assert recorder.at(1.5) == pytest.approx(1.0)


def test_a_cell_that_is_silent_at_the_start_is_a_fault_until_it_speaks(monkeypatch):
    monkeypatch.setattr(force_recorder, "SILENCE_S", 0.05)
    monkeypatch.setattr(force_recorder, "FIRST_SAMPLE_S", 0.05)
    cell = ScriptedCell()
    recorder = ForceRecorder(cell, tare)
    with pytest.raises(LoadCellError, match="silent"):
        _ = recorder.latest_n
    cell.say((1.0, 2500.0))
    assert recorder.at(1.0) == pytest.approx(2.0)
    recorder.close()
    assert cell.is_closed


def tare_of_a_held_probe(read):
    """Two readings are a tare; above 1000 counts the probe is held."""
    counts = max(read().counts for _ in range(2))
    if counts > 1000.0:
        raise HELD
    return SCALE, LIMIT


def test_a_probe_that_is_held_at_the_start_is_a_fault_until_it_is_lifted_and_then_tared(monkeypatch):
    monkeypatch.setattr(force_recorder, "SILENCE_S", 0.05)
    cell = ScriptedCell(*((float(k), 2500.0) for k in range(2)))
    recorder = ForceRecorder(cell, tare_of_a_held_probe)
    for ask in (lambda: recorder.latest_n, lambda: recorder.zero_shift_n, lambda: recorder.mean_n(window_s=1.0)):
        with pytest.raises(LoadCellError):
            ask()
    cell.say(*((2.0 + k, 2500.0) for k in range(6)), *((8.0 + k, 500.0) for k in range(2)), (10.0, 600.0))
    assert recorder.at(10.0, timeout_s=5.0) == pytest.approx(0.1)
    assert recorder.fault is None
    assert recorder.zero_shift_n == pytest.approx(0.5)
    recorder.close()


def test_a_recorder_that_is_closed_while_it_tares_ends(monkeypatch):
    monkeypatch.setattr(force_recorder, "RETRY_S", 60.0)
    recorder = ForceRecorder(ScriptedCell((0.0, 2500.0), (1.0, 2500.0)), tare_of_a_held_probe)
    assert recorder.fault is HELD
    recorder.close()
    assert not recorder._thread.is_alive()


def test_closing_releases_the_cell(cell, monkeypatch):
    monkeypatch.setattr(force_recorder, "SILENCE_S", 0.05)
    recorder = ForceRecorder(cell, tare)
    recorder.close()
    assert cell.is_closed


def test_the_mean_is_that_of_the_last_seconds_or_the_newest_sample(recorder, monkeypatch):
    """Samples at 1, 2 and 4 s are 0, 2 and 1 N."""
    for now_s, window_s, mean_n in ((4.0, 2.5, 1.5), (4.0, 10.0, 1.0), (9.0, 1.0, 1.0)):
        monkeypatch.setattr(force_recorder.time, "monotonic", lambda now_s=now_s: now_s)
        assert recorder.mean_n(window_s=window_s) == pytest.approx(mean_n)


def test_a_cell_at_fault_has_no_mean(recorder, cell):
    cell.say(UNPLUGGED)
    assert reached(lambda: recorder.fault)
    with pytest.raises(LoadCellError):
        recorder.mean_n(window_s=1.0)


def test_the_zero_of_this_start_is_told_from_that_of_commissioning(recorder):
    assert recorder.zero_shift_n == pytest.approx(0.5)


def test_the_largest_force_is_that_of_the_samples_since_and_of_the_time_itself(recorder):
    """Samples of 0, 2 and 1 N at 1, 2 and 4 s."""
    assert recorder.peak_n(1.0, 3.0) == pytest.approx(2.0)
    assert recorder.peak_n(2.0, 3.0) == pytest.approx(1.5)
    assert recorder.peak_n(0.0, 1.5) == pytest.approx(1.0)


def test_around_a_line_a_ramp_does_not_vary_and_tremor_does(cell, recorder):
    """A ramp of 0.5 N/s from 5 to 6 s; then a tooth of 0.1 N on the same ramp, of which the line takes a part."""
    cell.say(*[(5.0 + k / 10, 500.0 + 50.0 * k) for k in range(11)])
    recorder.at(6.0)
    assert recorder.range_n(6.0, window_s=1.0) == pytest.approx(0.5)
    assert recorder.range_n(6.0, window_s=1.0, around_line=True) == pytest.approx(0.0, abs=1e-9)
    cell.say(*[(6.0 + k / 10, 1000.0 + 50.0 * k + 100.0 * (k % 2)) for k in range(1, 11)])
    recorder.at(7.0)
    assert recorder.range_n(7.0, window_s=1.0, around_line=True) == pytest.approx(0.1, abs=0.02)
    assert recorder.range_n(3.0, window_s=0.5, around_line=True) == float("inf")


def test_the_history_does_not_grow_beyond_its_bound(cell, recorder):
    cell.say(*[(5.0 + k / 100, 500.0) for k in range(2 * force_recorder.KEPT_SAMPLES)])
    recorder.at(5.0 + (2 * force_recorder.KEPT_SAMPLES - 1) / 100)
    assert len(recorder._samples) == force_recorder.KEPT_SAMPLES


def test_the_history_answers_as_all_its_samples_do_after_it_has_moved(cell, recorder):
    """By `np.interp` and by hand over the samples that are kept; after two and a half times its length."""
    rng, kept = np.random.default_rng(1), force_recorder.KEPT_SAMPLES
    times_s = 5.0 + np.cumsum(rng.uniform(0.0, 0.02, 5 * kept // 2))
    counts = rng.uniform(0.0, 3000.0, len(times_s)).round()
    cell.say(*zip(times_s.tolist(), counts.tolist(), strict=True))
    recorder.at(times_s[-1])
    times_s, forces_n = times_s[-kept:], (counts[-kept:] - 500.0) / 1000.0
    for t_s in [times_s[0], *rng.uniform(times_s[0], times_s[-1], 50), times_s[-1]]:
        assert math.isclose(recorder.at(t_s), np.interp(t_s, times_s, forces_n), abs_tol=1e-12)
        inside = (times_s > t_s - 0.15) & (times_s <= t_s)
        assert recorder.peak_n(t_s - 0.15, t_s) == max([recorder.at(t_s), *forces_n[inside]])
        of_window = forces_n[(times_s >= t_s - 0.15) & (times_s <= t_s)]
        expected = np.ptp(of_window) if len(of_window) >= force_recorder.FEWEST_IN_WINDOW else np.inf
        assert recorder.range_n(t_s, window_s=0.15) == expected
    with pytest.raises(LoadCellError, match=r"No force is known 1\.000 s before the first sample"):
        recorder.at(times_s[0] - 1.0)


def tare_of_two(read):
    """The mean of two readings, of a probe that is held when it is above 1000 counts."""
    counts = sum(read().counts for _ in range(2)) / 2
    if counts > 1000.0:
        raise HELD
    return ForceScale(1000.0, counts), LoadLimit(ForceScale(1000.0, counts), max_load_n=5.0, max_drift_n=1.0)


@pytest.fixture
def first_tared():
    """A recorder whose first tare is 500 counts; with it, how to ask for another while the cell goes on saying some."""
    cell, times_s = ScriptedCell(*((t_s, 500.0) for t_s in (0.0, 0.5, 1.0))), itertools.count(2.0, 0.01)
    recorder = ForceRecorder(cell, tare_of_two)

    def retared(counts):
        is_done = threading.Event()

        def go_on():
            while not is_done.wait(0.005):
                cell.say((next(times_s), counts))

        speaker = threading.Thread(target=go_on)
        speaker.start()
        try:
            return recorder.retare()
        finally:
            is_done.set()
            speaker.join()

    yield recorder, cell, retared
    cell.say(UNPLUGGED)
    recorder.close()


def test_a_tare_that_is_taken_anew_holds_for_what_was_recorded_before_it_too(first_tared):
    """No step in the history: a press that begins now must not see the drift as a change of force."""
    recorder, cell, retared = first_tared
    assert recorder.at(1.0) == pytest.approx(0.0)
    assert retared(550.0) == pytest.approx(0.05)
    cell.say((1000.0, 1550.0))
    assert recorder.at(1000.0) == pytest.approx(1.0)
    assert recorder.at(1.0) == pytest.approx(-0.05)
    assert recorder.range_n(1000.0, window_s=999.0) == pytest.approx(1.05)
    assert recorder.zero_shift_n == pytest.approx(0.05)


def test_a_tare_of_a_held_probe_is_refused_and_the_zero_is_what_it_was(first_tared):
    recorder, _, retared = first_tared
    with pytest.raises(ZeroShiftError):
        retared(2500.0)
    assert recorder.latest_n == pytest.approx(2.0)


def test_tares_one_after_the_other_do_not_carry_the_zero_further_than_one_may(first_tared):
    """Without a tare of commissioning the first one of the start counts: once 0.6 N is borne, twice is too much."""
    recorder, _, retared = first_tared
    assert retared(-100.0) == pytest.approx(-0.6)
    with pytest.raises(ZeroShiftError, match=r"-1\.20 N from the 500 of commissioning"):
        retared(-700.0)
    assert recorder.zero_shift_n == pytest.approx(-0.6)


def test_a_cell_at_fault_is_not_tared(first_tared):
    recorder, cell, _ = first_tared
    cell.say(UNPLUGGED)
    assert reached(lambda: recorder.fault)
    with pytest.raises(LoadCellError, match="The cell is gone"):
        recorder.retare()


def test_a_cell_that_falls_silent_while_it_is_tared_is_told(first_tared, monkeypatch):
    recorder, _, _ = first_tared
    monkeypatch.setattr(force_recorder, "SILENCE_S", 0.05)
    with pytest.raises(LoadCellError):
        recorder.retare()


def test_a_touch_is_told_by_the_sample_that_shows_it(cell, recorder):
    """1 N at first; the wait ends with 1.6 N, long before its time, and not with the 1.4 N before."""
    cell.say((5.0, 1900.0), (6.0, 2100.0))
    assert recorder.reaches(1.5, timeout_s=60.0)
    assert recorder.latest_n == pytest.approx(1.6)


def test_samples_gather_until_the_force_of_a_frame_is_asked_for(cell, recorder):
    recorder.take_time()
    assert cell.pause_s == force_recorder.REST_PAUSE_S
    assert not recorder.reaches(1.5, timeout_s=0.001)
    assert cell.pause_s == force_recorder.REST_PAUSE_S
    recorder.at(4.0)
    assert cell.pause_s == 0.0


def test_a_wait_for_a_touch_ends_with_its_time_and_with_a_fault(cell, recorder):
    assert not recorder.reaches(1.5, timeout_s=0.001)
    assert recorder.reaches(0.5, timeout_s=60.0)
    cell.say(UNPLUGGED)
    with pytest.raises(LoadCellError, match="gone"):
        recorder.reaches(1.5, timeout_s=60.0)
