"""The frame clock: whole periods, in whole nanoseconds."""

from __future__ import annotations

from device.simulation.frame_clock import FrameClock


def test_frames_of_a_clock_begin_at_whole_periods():
    clock = FrameClock(start_ns=1000, frame_ns=100, exposure_ns=30)
    assert [clock.first_begun_after(t_ns) for t_ns in (0, 1000, 1001, 1100, 1101)] == [0, 0, 1, 1, 2]
    assert [clock.last_ended_before(t_ns) for t_ns in (1029, 1030, 1129, 1130)] == [-1, 0, 0, 1]
    assert (clock.frame(2).exposure_start_ns, clock.frame(2).exposure_end_ns) == (1200, 1230)
