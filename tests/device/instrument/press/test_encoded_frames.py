"""Frames that a press keeps are PNGs by its end; what it does not keep is not held, and the newest not yet encoded."""

import threading

import numpy as np
import pytest

from device.files.recording_file import png_of
from device.instrument.press import encoded_frames as encoded_module
from device.instrument.press.encoded_frames import EncodedFrames
from device.measurement.recording.tactile_image import Frame


def frame(t_s):
    return Frame(np.full((16, 16), round(t_s), np.uint8), "press", float(t_s), 0.5, (0.6,) * 4)


@pytest.fixture
def encoded():
    encoded = EncodedFrames()
    yield encoded
    encoded.close()


@pytest.fixture
def asked(monkeypatch):
    """The frames that were encoded, by their times."""
    times = []
    monkeypatch.setattr(encoded_module, "png_of", lambda one: times.append(one.t_s) or png_of(one))
    return times


def test_every_frame_but_the_newest_is_encoded_once(encoded, asked):
    first, second, third = map(frame, range(3))
    encoded.follow([first, second])
    encoded.follow([first, second, third])
    assert [encoded.png_of(one) for one in (first, second)] == [png_of(first), png_of(second)]
    assert asked == [0.0, 1.0]


def test_a_frame_that_a_nearer_one_takes_the_place_of_is_never_encoded(encoded, asked):
    first, far, near = map(frame, range(3))
    for kept in ([first, far], [first, near]):
        encoded.follow(kept)
    encoded.follow([first, near], are_all=True)
    assert {encoded.png_of(one) for one in (first, near)} == {png_of(first), png_of(near)}
    assert sorted(asked) == [0.0, 2.0]


def test_the_newest_is_the_last_in_time_and_not_in_force(encoded, asked):
    """A ramp keeps its frames by growing force; a hand that goes back adds one in the middle."""
    early, late, between = frame(0), frame(1), frame(2)
    encoded.follow([early, between, late])
    for one in (early, late):
        encoded.png_of(one)
    assert sorted(asked) == [0.0, 1.0]


def test_what_a_press_keeps_no_more_is_held_no_more(encoded):
    kept = [frame(number) for number in range(5)]
    encoded.follow(kept, are_all=True)
    assert encoded.held == 5
    encoded.follow(kept[3:], are_all=True)
    assert encoded.held == 2
    encoded.clear()
    assert encoded.held == 0


def test_a_frame_that_nobody_announced_is_encoded_when_it_is_asked_for(encoded):
    assert encoded.png_of(frame(7)) == png_of(frame(7))


def test_frames_are_encoded_by_another_thread(encoded, monkeypatch):
    threads = []
    monkeypatch.setattr(encoded_module, "png_of", lambda one: threads.append(threading.get_ident()) or b"")
    one = frame(0)
    encoded.follow([one], are_all=True)
    assert encoded.png_of(one) == b""
    assert threads != [threading.get_ident()]
