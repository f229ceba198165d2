"""Seconds of light, on the clock of a test."""

from __future__ import annotations

import pytest

from device.errors import LightBudgetError, LightRestError
from device.instrument.acquisition.light_budget import LightBudget


class Clock:
    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


def test_a_press_may_use_its_budget_and_no_more(clock):
    budget = LightBudget(10.0, clock=clock)
    budget.note_lit()
    clock.now_s = 10.0
    budget.require_left()
    clock.now_s = 10.1
    with pytest.raises(LightBudgetError, match=r"on for 10 s in the last 15 s, above 10 s") as end:
        budget.require_left()
    assert end.value.code == "E209"
    budget.note_dark()
    clock.now_s += end.value.wait_s
    budget.require_for_press()  # so long it has to rest, and no longer
    clock.now_s -= 1.0
    with pytest.raises(LightRestError):
        budget.require_for_press()


def lit(budget, clock, from_s, until_s):
    clock.now_s = from_s
    budget.note_lit()
    clock.now_s = until_s
    budget.note_dark()


def test_darkness_costs_nothing_and_the_seconds_of_the_next_press_begin_anew(clock):
    budget = LightBudget(10.0, clock=clock)
    lit(budget, clock, 0.0, 9.0)
    clock.now_s = 100.0
    budget.require_left()
    assert budget.press_s == 9.0
    budget.begin_press()
    assert budget.press_s == 0.0
    budget.note_lit()
    clock.now_s = 110.0
    budget.require_left()
    assert budget.press_s == budget.window_s == 10.0


def test_the_light_of_all_presses_of_the_window_counts_and_of_none_before(clock):
    """Of 15 s: 2 s of the first spell are still inside, 3 s of the second, and 1 s of the one that goes on."""
    budget = LightBudget(10.0, clock=clock)
    lit(budget, clock, 0.0, 5.0)
    lit(budget, clock, 10.0, 13.0)
    clock.now_s = 17.0
    budget.note_lit()
    clock.now_s = 18.0
    budget.begin_press()
    assert budget.window_s == 6.0
    assert budget.on_s == 9.0


def test_a_press_is_refused_for_as_long_as_it_takes_until_a_tenth_is_left(clock):
    """9.5 s are used at 9.5 s, of 10 s in 15 s: at 15.5 s the first half second lies behind the window."""
    budget = LightBudget(10.0, clock=clock)
    lit(budget, clock, 0.0, 9.5)
    with pytest.raises(LightRestError, match=r"on for 10 s in the last 15 s, of at most 10 s. Wait 6 s") as refusal:
        budget.require_for_press()
    assert (refusal.value.code, refusal.value.wait_s) == ("E211", 6)
    clock.now_s = 15.4
    with pytest.raises(LightRestError, match="Wait 1 s"):
        budget.require_for_press()
    clock.now_s = 15.5
    budget.require_for_press()


def test_a_scan_begins_only_with_light_for_all_the_presses_it_may_take(clock):
    """Six presses instead of two: three tenths of the window's light, not one."""
    budget = LightBudget(10.0, clock=clock)
    lit(budget, clock, 0.0, 8.0)
    budget.require_for_press()
    with pytest.raises(LightRestError, match="Wait 8 s"):
        budget.require_for_press(5)
    clock.now_s = 16.0
    budget.require_for_press(5)


def test_presses_one_after_the_other_can_be_lit_for_two_thirds_of_the_time(clock):
    """For hours, a press of 7 s begun as soon as it may: what was used up never locks the probe for longer than it."""
    budget, lit_s = LightBudget(300.0, clock=clock), 0.0
    while clock.now_s < 7200.0:
        try:
            budget.require_for_press()
        except LightRestError:
            clock.now_s += 1.0
        else:
            lit(budget, clock, clock.now_s, clock.now_s + 7.0)
            budget.require_left()
            lit_s += 7.0
    assert 0.55 < lit_s / clock.now_s <= 2 / 3


def test_without_a_limit_nothing_is_refused(clock):
    budget = LightBudget(clock=clock)
    lit(budget, clock, 0.0, 1e6)
    budget.require_left()
    budget.require_for_press()


def test_what_was_saved_is_not_told_twice(clock):
    budget = LightBudget(clock=clock)
    budget.note_lit()
    clock.now_s = 4.0
    budget.note_saved(budget.unsaved_s)
    assert budget.unsaved_s == 0.0
    clock.now_s = 7.0
    assert budget.unsaved_s == 3.0
