"""Seconds of light, on the clock of a test."""

from __future__ import annotations

import pytest

from device.errors import LightBudgetError
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
    with pytest.raises(LightBudgetError, match=r"on for 10 s in this press, above 10 s") as end:
        budget.require_left()
    assert end.value.code == "E209"


def test_darkness_costs_nothing_and_the_next_press_begins_anew(clock):
    budget = LightBudget(10.0, clock=clock)
    budget.note_lit()
    clock.now_s = 9.0
    budget.note_dark()
    clock.now_s = 100.0
    budget.require_left()
    assert budget.press_s == 9.0
    budget.begin_press()
    assert budget.press_s == 0.0
    budget.note_lit()
    clock.now_s = 110.0
    budget.require_left()


def test_what_was_saved_is_not_told_twice(clock):
    budget = LightBudget(clock=clock)
    budget.note_lit()
    clock.now_s = 4.0
    budget.note_saved(budget.unsaved_s)
    assert budget.unsaved_s == 0.0
    clock.now_s = 7.0
    assert budget.unsaved_s == 3.0
