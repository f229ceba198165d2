"""Frames that the camera's process takes before they are asked for: each, in order, and none that is not wanted."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest

from device.errors import CameraError
from device.hardware import camera_worker
from device.hardware.camera_worker import MOST_AHEAD, CaptureReply, CaptureRequest, FramesAhead
from device.hardware.frame_ring import FrameRing
from device.hardware.interfaces import CameraFrame

SHAPE, FRAME_S, EXPOSURE_US = (2, 3), 0.016, 4000.0


class NumberedFrames:
    """A camera whose frame k begins at k frame times and has k counts; as picamera2, it never goes back."""

    def __init__(self) -> None:
        self.next, self.fails_at = 1, 0

    def capture(self, *, begun_after_s: float, timeout_s: float) -> CameraFrame:
        number = max(self.next, math.ceil(begun_after_s / FRAME_S - 1e-9))
        if number == self.fails_at:
            self.fails_at = 0
            raise CameraError("The camera gave no frame.", "Check its cable.")
        self.next = number + 1
        return CameraFrame(np.full(SHAPE, number, np.uint8), number * FRAME_S, EXPOSURE_US, 1.0)

    def rest(self) -> None:
        pass

    def close(self) -> None:
        pass


@pytest.fixture
def camera() -> NumberedFrames:
    return NumberedFrames()


@pytest.fixture
def ring() -> Iterator[FrameRing]:
    made = FrameRing.create(SHAPE)
    made.unlink()
    yield made
    made.close()


@pytest.fixture
def frames(camera: NumberedFrames, ring: FrameRing, monkeypatch: pytest.MonkeyPatch) -> FramesAhead:
    monkeypatch.setattr(camera_worker, "FRESH_S", 60.0)  # however busy this machine is
    return FramesAhead(camera, ring)


def after(reply: CaptureReply) -> CaptureRequest:
    """The request for the very next frame, as a press makes it."""
    return CaptureRequest(reply.exposure_start_s + 1e-6, 1.0)


def number_of(reply: CaptureReply) -> int:
    return round(reply.exposure_start_s / FRAME_S)


def stream(frames: FramesAhead) -> CaptureReply:
    """Take two frames one after the other; return the last."""
    return frames.next(after(frames.next(CaptureRequest(0.0, 1.0))))


def test_whoever_takes_every_frame_finds_those_that_came_while_he_was_late(frames, camera, ring):
    last = stream(frames)
    assert [frames.take_one_ahead() for _ in range(MOST_AHEAD + 1)] == [True] * MOST_AHEAD + [False]
    camera.next += 10  # what the camera's library does not keep
    for number in range(3, 3 + MOST_AHEAD):
        last = frames.next(after(last))
        assert number_of(last) == number
        np.testing.assert_array_equal(ring.read(last.number), np.full(SHAPE, number, np.uint8))
    assert number_of(frames.next(after(last))) == 15


def test_what_is_ahead_of_the_frame_that_is_read_never_lies_over_it(frames, ring):
    last = stream(frames)
    while frames.take_one_ahead():
        pass
    np.testing.assert_array_equal(ring.read(last.number), np.full(SHAPE, 2, np.uint8))


def test_a_single_frame_makes_no_stream(frames):
    frames.next(CaptureRequest(0.0, 1.0))
    assert not frames.take_one_ahead()


def test_a_frame_from_before_the_light_was_set_is_not_handed_out(frames):
    last = stream(frames)
    while frames.take_one_ahead():
        pass
    lit_s = last.exposure_start_s + 1.5 * FRAME_S
    assert number_of(frames.next(CaptureRequest(lit_s, 1.0))) == 4
    assert not frames.take_one_ahead()  # the light may be set again: who asks next will say


def test_one_that_has_waited_is_not_handed_out_as_new(frames, camera, monkeypatch):
    last = stream(frames)
    while frames.take_one_ahead():
        pass
    monkeypatch.setattr(camera_worker, "FRESH_S", 0.0)
    camera.next += 10
    assert number_of(frames.next(after(last))) == 15
    assert not frames.take_one_ahead()


def test_a_camera_that_rests_keeps_nothing(frames, camera):
    last = stream(frames)
    while frames.take_one_ahead():
        pass
    frames.forget()
    camera.next += 10
    assert number_of(frames.next(after(last))) == 15
    assert not frames.take_one_ahead()


def test_an_error_ahead_is_told_to_nobody_who_did_not_ask(frames, camera):
    last = stream(frames)
    camera.fails_at = 3
    assert not frames.take_one_ahead()
    assert number_of(frames.next(after(last))) == 3
    camera.fails_at = 4
    with pytest.raises(CameraError, match="gave no frame"):
        frames.next(CaptureRequest(4 * FRAME_S, 1.0))
