"""Frames against the light they were taken under: levels that can be computed by hand."""

from __future__ import annotations

import numpy as np
import pytest

from device.errors import DarkSideError, StaleFrameError
from device.instrument.acquisition.frame_level import LevelWatch, require_lit
from device.measurement.recording.tactile_image import Frame

DARK, LIT, SIDE = (0.0,) * 4, (0.6,) * 4, (0.6, 0.0, 0.0, 0.0)


def frame(led_ratio, counts, force_n=0.5):
    return Frame(np.full((8, 8), counts, np.uint8), "reference", 0.0, force_n, led_ratio)


def see(*frames):
    watch = LevelWatch()
    for one in frames:
        watch.saw(one)


@pytest.mark.parametrize(
    "levels",
    [[(LIT, 70), (DARK, 4), (DARK, 4)], [(DARK, 4), (SIDE, 20), (SIDE, 21)], [(LIT, 70), (SIDE, 22), (SIDE, 20)]],
)
def test_frames_that_follow_the_light_at_once_are_taken(levels):
    see(*(frame(*one) for one in levels))


@pytest.mark.parametrize(
    "levels",
    [[(LIT, 70), (DARK, 70), (DARK, 4)], [(DARK, 4), (SIDE, 5), (SIDE, 20)], [(LIT, 70), (SIDE, 60), (SIDE, 20)]],
)
def test_a_frame_with_the_level_of_the_light_before_is_stale(levels):
    with pytest.raises(StaleFrameError, match="gave an old image") as fault:
        see(*(frame(*one) for one in levels))
    assert fault.value.code == "E105"


def test_the_levels_are_told():
    with pytest.raises(StaleFrameError, match=r"it has 69 counts, as under the old one \(70\), and the next has 4."):
        see(frame(LIT, 70), frame(DARK, 69), frame(DARK, 4))


def test_a_light_that_changes_nothing_tells_nothing():
    """An untouched face is dark under any light: 3 counts are no change."""
    see(frame(DARK, 4), frame(LIT, 4), frame(LIT, 7))


def test_a_hand_that_eases_meanwhile_is_not_taken_for_a_stale_frame():
    """The level falls with the force: 0.5, 0.4, 0.2 N."""
    see(frame(LIT, 70, 0.5), frame(SIDE, 56, 0.4), frame(SIDE, 8, 0.2))


def test_a_level_that_changes_under_one_light_is_none_of_its_business():
    see(frame(LIT, 70), frame(LIT, 70), frame(LIT, 30), frame(LIT, 70))


def test_a_torn_frame_is_not_taken_for_a_stale_one():
    """Its lower half shows the light before; another check sees the step."""
    see(frame(DARK, 4), frame(SIDE, 11), frame(SIDE, 20))


def test_a_light_of_one_frame_is_not_judged():
    see(frame(LIT, 70), frame(DARK, 70), frame(SIDE, 20))


def test_a_press_is_lit_when_each_of_its_frames_is():
    require_lit([frame(LIT, 70), frame(LIT, 6, 0.1)], dark_counts=4.0)


def test_a_press_with_a_frame_without_light_has_no_light():
    with pytest.raises(DarkSideError, match="1.0 counts above dark at 0.10 N, below 2") as fault:
        require_lit([frame(LIT, 70), frame(LIT, 5, 0.1)], dark_counts=4.0)
    assert fault.value.code == "E203"
