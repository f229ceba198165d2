"""The frame clock: whole periods, in whole nanoseconds."""

from __future__ import annotations

from device.simulation.chips.frame_clock import FrameClock, Timing


def test_frames_of_a_clock_begin_at_whole_periods():
    clock = FrameClock(1000, Timing(frame_ns=100, exposure_ns=30))
    assert [clock.first_begun_after(t_ns) for t_ns in (0, 1000, 1001, 1100, 1101)] == [0, 0, 1, 1, 2]
    assert [clock.last_ended_before(t_ns) for t_ns in (1029, 1030, 1129, 1130)] == [-1, 0, 0, 1]
    assert (clock.frame(2).exposure_start_ns, clock.frame(2).exposure_end_ns) == (1200, 1230)


def test_a_change_holds_from_its_frame_on():
    """From frame 3, at 1300 ns, frames last 50 ns and expose for 20: the next begin at 1350, 1400 ..."""
    clock = FrameClock(1000, Timing(100, 30))
    clock.change(3, Timing(50, 20, gain=2.0))
    frames = [clock.frame(number) for number in range(6)]
    assert [frame.exposure_start_ns for frame in frames] == [1000, 1100, 1200, 1300, 1350, 1400]
    assert [frame.exposure_end_ns - frame.exposure_start_ns for frame in frames] == [30, 30, 30, 20, 20, 20]
    assert [frame.timing.gain for frame in frames] == [1.0] * 3 + [2.0] * 3
    assert [clock.first_begun_after(t_ns) for t_ns in (0, 1201, 1300, 1301, 1350)] == [0, 3, 3, 4, 4]
    assert [clock.last_ended_before(t_ns) for t_ns in (1229, 1319, 1320, 1370)] == [1, 2, 3, 4]


def test_a_change_takes_the_place_of_one_that_was_still_to_come():
    clock = FrameClock(0, Timing(100, 30))
    clock.change(5, Timing(100, 40))
    clock.change(4, Timing(100, 50))
    assert [clock.frame(number).timing.exposure_ns for number in (3, 4, 5, 6)] == [30, 50, 50, 50]
