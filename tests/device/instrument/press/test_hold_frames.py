"""Which frames of a held press count, and that one alone is never trusted."""

import numpy as np
import pytest

from device.config import PressSection
from device.instrument.acquisition.frame_check import TearWatch
from device.instrument.press.frame_choice import HoldFrames
from device.instrument.press.states import Guidance, PressState
from device.measurement.recording.tactile_image import Frame

PRESS = PressSection(target_n=0.5, band_ratio=0.05)
STATES = (PressState.TOO_LIGHT, PressState.CAPTURING)


@pytest.fixture
def frames_of():
    def some(count):
        return HoldFrames(count, PRESS, TearWatch(10.0))

    return some


def frame(force_n, level=80, torn=False):
    counts = np.full((32, 32), level, np.uint8)
    if torn:
        counts[16:] = 4
    return Frame(counts, "press", 0.0, force_n, (0.6,) * 4)


def see(hold, *frames):
    return [hold.see(one, STATES[one.force_n >= PRESS.band_n[0]]) for one in frames]


def test_a_single_frame_is_compared_with_one_more(frames_of):
    """Two are taken and the second is kept."""
    hold, first, second = frames_of(1), frame(0.5), frame(0.51)
    see(hold, first)
    assert not hold.is_complete
    see(hold, second)
    assert hold.is_complete
    assert len(hold.frames) == 1
    assert hold.frames[0] is second


def test_a_single_frame_that_is_torn_is_not_kept(frames_of):
    hold = frames_of(1)
    see(hold, frame(0.5, torn=True), frame(0.5), frame(0.5), frame(0.5))
    assert hold.is_complete
    assert hold.frames[0].counts.min() == 80


def test_the_target_is_wanted_until_all_frames_are_there(frames_of):
    hold = frames_of(2)
    assert hold.wanted_n == (0.5,)
    assert see(hold, frame(0.5)) == [Guidance.HOLD_STILL]
    assert hold.wanted_n == (0.5,)
    see(hold, frame(0.5))
    assert hold.wanted_n == ()


def test_the_way_to_the_hold_is_remembered_from_the_first_touch_on(frames_of):
    hold, touch = frames_of(2), frame(0.1)
    assert see(hold, touch, frame(0.3)) == [Guidance.PRESS_HARDER] * 2
    see(hold, frame(0.5), frame(0.5))
    seen, held = hold.light_and_hard()
    assert seen is touch
    assert [one.force_n for one in held] == [0.5, 0.5]
    hold.begin_again()
    see(hold, frame(0.36))
    assert hold.light_and_hard() is None  # above 0.7 of the target: too near to the hold to tell
