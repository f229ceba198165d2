"""The brightness that holds a level, on a plant that is written down here: light is level times ratio."""

import pytest

from device.instrument.acquisition.brightness_loop import HIGHEST_RATIO, LOWEST_RATIO, MOST_CHANGE, BrightnessLoop

START = (0.5, 0.5, 0.5, 0.5)
LEVELS = (25.0, 25.0, 25.0, 25.0)


def light_counts(ratio, levels):
    return sum(part * level for part, level in zip(ratio, levels, strict=True))


def test_without_a_target_the_brightness_stays():
    loop = BrightnessLoop(START, None)
    assert loop.saw((20.0, 30.0, 20.0, 30.0)) is None
    assert loop.ratio == START


def test_light_at_its_level_is_left_alone():
    loop = BrightnessLoop(START, 50.0)
    assert loop.saw(LEVELS) is None
    assert loop.ratio == pytest.approx(START)


@pytest.mark.parametrize(
    ("levels", "ratio"),
    [
        ((20.0, 20.0, 20.0, 20.0), (0.625, 0.625, 0.625, 0.625)),
        ((25.0, 20.0, 25.0, 31.25), (0.5, 0.625, 0.5, 0.4)),
    ],
)
def test_one_press_brings_every_side_to_its_equal_share(levels, ratio):
    """A share is 12.5 counts."""
    loop = BrightnessLoop(START, 50.0)
    assert loop.saw(levels) is None
    assert loop.ratio == pytest.approx(ratio)
    assert light_counts(loop.ratio, levels) == pytest.approx(50.0)
    loop.saw(levels)
    assert loop.ratio == pytest.approx(ratio)


@pytest.mark.parametrize(("levels", "factor"), [((5.0,) * 4, MOST_CHANGE), ((250.0,) * 4, 1 / MOST_CHANGE)])
def test_one_press_moves_the_light_by_no_more_than_the_largest_step(levels, factor):
    loop = BrightnessLoop(START, 50.0)
    loop.saw(levels)
    assert loop.ratio == pytest.approx([0.5 * factor] * 4)


def test_light_that_is_halved_is_back_after_two_presses():
    loop = BrightnessLoop((0.4,) * 4, 40.0)
    for _ in range(2):
        loop.saw((12.5,) * 4)
    assert loop.ratio == pytest.approx([0.8] * 4)


def test_a_side_at_full_brightness_that_misses_its_share_is_warned_of_by_name():
    """The share is 12.5 counts; +y gives 10 at full brightness."""
    loop = BrightnessLoop((0.8,) * 4, 50.0)
    warning = loop.saw((15.625, 10.0, 15.625, 15.625))
    assert loop.ratio == pytest.approx((0.8, HIGHEST_RATIO, 0.8, 0.8))
    assert (warning.code, warning.severity) == ("E210", "warning")
    assert warning.cause == "The light cannot hold its level of 50 counts: +y gives 80% of its share."


def test_a_side_that_is_too_bright_even_at_the_lowest_brightness_is_warned_of():
    """A share of 2.5 counts of light of 100 is a ratio of 0.025, half of the lowest."""
    loop = BrightnessLoop((0.06,) * 4, 10.0)
    warning = loop.saw((100.0,) * 4)
    assert loop.ratio == (LOWEST_RATIO,) * 4
    assert "-x gives 200% of its share" in warning.cause


def test_full_brightness_that_is_just_enough_is_no_warning():
    assert BrightnessLoop((0.9,) * 4, 50.0).saw((12.5,) * 4) is None


def test_nothing_winds_up_at_the_limit():
    """However long the light was short, the first press with all of it sets what it needs."""
    short, fresh = (BrightnessLoop((0.9,) * 4, 50.0) for _ in range(2))
    for _ in range(20):
        short.saw((10.0,) * 4)
    short.saw((15.625,) * 4)
    fresh.saw((15.625,) * 4)
    assert short.ratio == fresh.ratio == pytest.approx([0.8] * 4)


def test_a_dead_side_is_left_where_it_was_and_the_others_hold_the_level():
    loop = BrightnessLoop(START, 50.0)
    levels = (31.25, 0.0, 31.25, 31.25)
    assert loop.saw(levels) is None
    assert loop.ratio == pytest.approx((50 / 3 / 31.25, 0.5, 50 / 3 / 31.25, 50 / 3 / 31.25))
    assert light_counts(loop.ratio, levels) == pytest.approx(50.0)


def test_without_any_light_the_brightness_stays():
    loop = BrightnessLoop(START, 50.0)
    assert loop.saw((0.0, 1.9, 0.0, 0.0)) is None
    assert loop.ratio == START
