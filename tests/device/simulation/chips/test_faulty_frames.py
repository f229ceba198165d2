"""A faulty camera leaves out, shows stale or tears exactly the frames that begin while its fault lasts."""

from __future__ import annotations

import time

import pytest

from device.simulation.chips.faulty_frames import LATE_CAMERA_KEEPS_EVERY, CameraCrash, FaultyFrames
from device.simulation.chips.frame_clock import FrameClock, Timing
from device.simulation.faults import NO_FAULTS, FaultTimeline, ScriptedFault

START_S, FRAME_S = 100.0, 0.01


def faulty(kind: str, *, until_frame: float) -> tuple[FaultyFrames, FrameClock]:
    """The frames of a camera, the first of which begins with its fault."""
    timeline = FaultTimeline([ScriptedFault(kind, until_s=until_frame * FRAME_S)], clock=lambda: START_S)
    clock = FrameClock(round(1e9 * START_S), Timing(round(1e9 * FRAME_S), round(1e9 * FRAME_S / 2)))
    return FaultyFrames(timeline), clock


def test_a_sound_camera_delivers_every_frame_as_it_is() -> None:
    frames, clock = FaultyFrames(NO_FAULTS), FrameClock(0, Timing(1000, 500))
    frames.answer()
    assert all(frames.is_delivered(clock.frame(number)) for number in range(20))
    assert frames.shown_in(clock.frame(3)).number == 3
    assert frames.torn_into(clock.frame(3)) is None


def test_a_stalled_camera_delivers_none_of_the_frames_that_begin_in_its_fault() -> None:
    frames, clock = faulty("camera_stall", until_frame=4.5)
    assert [number for number in range(8) if frames.is_delivered(clock.frame(number))] == [5, 6, 7]


def test_a_late_camera_delivers_the_multiples_of_its_number_alone() -> None:
    frames, clock = faulty("camera_late", until_frame=1000)
    assert [number for number in range(25) if frames.is_delivered(clock.frame(number))] == [
        0,
        LATE_CAMERA_KEEPS_EVERY,
        2 * LATE_CAMERA_KEEPS_EVERY,
    ]


@pytest.mark.parametrize(("kind", "expected"), [("camera_stale", [0, 0, 1, 2, 4]), ("camera_torn", [0, 1, 2, 3, 4])])
def test_only_a_stale_camera_shows_the_frame_before_and_the_first_has_none(kind: str, expected: list[int]) -> None:
    frames, clock = faulty(kind, until_frame=3.5)
    assert [frames.shown_in(clock.frame(number)).number for number in range(5)] == expected


def test_a_torn_frame_goes_over_to_the_one_before_and_the_first_is_whole() -> None:
    frames, clock = faulty("camera_torn", until_frame=3.5)
    torn = [frames.torn_into(clock.frame(number)) for number in range(5)]
    assert [frame.number if frame else None for frame in torn] == [None, 0, 1, 2, None]


def test_a_camera_whose_process_dies_says_so_at_the_call() -> None:
    with pytest.raises(CameraCrash):
        faulty("camera_crashed", until_frame=1000)[0].answer()


def test_a_call_of_a_camera_that_hangs_returns_when_the_fault_is_over() -> None:
    over_s = time.monotonic() + 0.05
    FaultyFrames(FaultTimeline([ScriptedFault("camera_hung", until_s=0.05)])).answer()
    assert time.monotonic() >= over_s
