"""What counts as holding a bound."""

import math

import pytest

from host_tools.pages.benchmark import Chapter, absolute, at_least, at_most, relative


def test_a_relative_error_is_over_the_known_value():
    assert relative("", "", 99.0, 100.0, 0.01).error == pytest.approx(0.01)
    assert relative("", "", -99.0, -100.0, 0.02).passed
    assert not relative("", "", 98.9, 100.0, 0.01).passed


def test_an_absolute_error_is_a_difference():
    assert absolute("", "", 3.9, 4.0, 0.2).error == pytest.approx(0.1)


def test_a_number_that_is_none_never_holds():
    assert not at_most("", "", math.nan, 1.0).passed
    assert not relative("", "", math.inf, 1.0, math.inf).passed


@pytest.mark.parametrize(("measured", "holds"), [(9.9, False), (10.0, True), (11.0, True)])
def test_a_least_value_must_be_reached(measured, holds):
    assert at_least("", "", measured, 10.0).passed is holds


def test_a_chapter_passes_when_all_of_it_does():
    good, bad = at_most("", "", 0.5, 1.0), at_most("", "", 2.0, 1.0)
    assert Chapter("", "", "", (good,)).passed
    assert not Chapter("", "", "", (good, bad)).passed


def test_a_share_of_nothing_reaches_no_bound():
    assert not at_least("case", "share", float("nan"), 0.9).passed
