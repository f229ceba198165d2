"""What all modes share of an estimate: value, standard deviation, interval, open ends, with numbers known on paper."""

import numpy as np
import pytest

from device.measurement.confidence_belt import Belt, ends_in_belts
from device.measurement.estimate import (
    UNKNOWN_QUANTITY,
    Numbers,
    Origin,
    numbers_in,
    with_numbers,
    without_numbers,
)
from device.measurement.ramp_modes.intervals import PressIntervals

ORIGIN = Origin("standard", "demo", "00" * 32, "11" * 32, "id", True)
TWO = np.full((2, 2, 1), 2.0)
WITHIN_TWO = Belt(np.array([-1.0, 1.0]), np.array([-9.0, 0.0]), np.array([0.0]), -TWO, TWO)
"""Every truth within two spreads of the mean is accepted, whatever truth and spread are."""
HALF_CELL = 1 / 400
"""Truths are tried on a grid of 401: an interval reaches half a cell further than the last that holds."""


def estimate_of(mean, spread):
    at, width = np.array(mean), np.array(spread)
    numbers = numbers_in(at, width, ends_in_belts(at, width, [WITHIN_TWO] * 3))
    return with_numbers(numbers, {"misfit_ratio": 1.0}, ORIGIN)


def test_values_are_those_of_the_coordinates():
    """2-15 mm, 4-12 mm and 10-160 kPa by ratio: the middles are 8.5 mm, 8 mm and 40 kPa."""
    estimate = estimate_of([0.0, 0.0, 0.0], [0.1, 0.1, 0.1])
    found = [one.value for one in (estimate.size_mm, estimate.depth_mm, estimate.youngs_modulus_kpa)]
    assert found == pytest.approx([8.5, 8.0, 40.0], rel=1e-12)
    assert (estimate.status, estimate.reason) == ("ok", "")


def test_the_published_standard_deviation_is_the_spread_in_the_unknowns_own_unit():
    """0.1 of 13 / 2 mm is 0.65 mm, 0.1 of 8 / 2 mm is 0.4 mm; 40 kPa times (4^0.1 - 4^-0.1) / 2 is 5.563 kPa."""
    estimate = estimate_of([0.0, 0.0, 0.0], [0.1, 0.1, 0.1])
    assert estimate.size_mm.std == pytest.approx(0.65, rel=1e-12)
    assert estimate.depth_mm.std == pytest.approx(0.4, rel=1e-12)
    assert estimate.youngs_modulus_kpa.std == pytest.approx(40 * np.sinh(0.1 * np.log(4)), rel=1e-12)


def test_an_interval_holds_every_truth_within_its_bands():
    """Two spreads of 0.1 about 0 are -0.2 to 0.2, and half a cell more: 8.5 mm -+ 0.2025 * 6.5 mm."""
    size = estimate_of([0.0, 0.0, 0.0], [0.1, 0.1, 0.1]).size_mm
    reach_mm = (0.2 + HALF_CELL) * 6.5
    assert (size.low, size.high) == pytest.approx((8.5 - reach_mm, 8.5 + reach_mm), rel=1e-9)
    assert (size.identifiable, size.low_is_open, size.high_is_open) == (True, False, False)


@pytest.mark.parametrize(
    ("mean", "is_open", "ends_mm"),
    [(0.95, (False, True), (8.5 + (0.75 - HALF_CELL) * 6.5, 15.0)), (-0.95, (True, False), (2.0, 8.5 - 0.7475 * 6.5))],
)
def test_an_interval_that_meets_an_end_of_the_range_ends_and_is_open_there(mean, is_open, ends_mm):
    size = estimate_of([mean, 0.0, 0.0], [0.1, 0.1, 0.1]).size_mm
    assert (size.low_is_open, size.high_is_open) == is_open
    assert (size.low, size.high) == pytest.approx(ends_mm, rel=1e-9)


def test_a_spread_that_says_no_more_than_the_range_leaves_the_whole_range_open():
    """Even between -1 and 1 has a standard deviation of 0.577; half of that determines nothing."""
    estimate = estimate_of([0.0, 0.0, 0.3], [0.1, 0.1, 0.29])
    modulus = estimate.youngs_modulus_kpa
    assert (modulus.low, modulus.high, modulus.low_is_open, modulus.high_is_open) == (10.0, 160.0, True, True)
    assert not modulus.identifiable
    assert estimate.status == "partly_identifiable"
    assert estimate.reason == "This press does not determine Young's modulus."


def test_a_value_beyond_the_range_is_brought_to_the_end_of_its_interval():
    size = estimate_of([1.1, 0.0, 0.0], [0.1, 0.1, 0.1]).size_mm
    assert (size.value, size.high) == (15.0, 15.0)


def test_numbers_lie_within_any_ends_whatever_they_were_made_of():
    """Ends of coordinates -0.2 and 0.4: 8.5 mm less 1.3 mm and more 2.6 mm; 8 mm less 0.8 mm and more 1.6 mm."""
    ends = PressIntervals(np.full(3, -0.2), np.full(3, 0.4), np.array([True, True, False]))
    estimate = with_numbers(numbers_in(np.zeros(3), np.full(3, 0.1), ends), {}, ORIGIN)
    assert (estimate.size_mm.low, estimate.size_mm.high) == pytest.approx((7.2, 11.1))
    assert (estimate.depth_mm.low, estimate.depth_mm.high) == pytest.approx((7.2, 9.6))
    assert estimate.reason == "This press does not determine Young's modulus."


def test_all_that_is_not_determined_is_named():
    wide, box = np.array([0.0, 0.0, 0.0]), (np.zeros(3), np.ones(3))
    numbers = Numbers(np.full(3, 0.5), wide, *box, np.array([False, False, True]), *box)
    estimate = with_numbers(numbers, {}, ORIGIN)
    assert estimate.reason == "This press does not determine size and depth."
    assert estimate.size_mm.low_is_open
    assert estimate.size_mm.high_is_open


def test_an_estimate_without_numbers_says_why_and_where_it_is_from():
    estimate = without_numbers("saturated", "Too bright.", ORIGIN)
    assert {estimate.size_mm, estimate.depth_mm, estimate.youngs_modulus_kpa} == {UNKNOWN_QUANTITY}
    assert (estimate.status, estimate.reason, estimate.mode) == ("saturated", "Too bright.", "standard")


@pytest.mark.parametrize(
    ("spread", "status"),
    [
        ([0.1, 0.1, 0.1], "ok"),
        ([0.1, 0.1, 0.4], "partly_identifiable"),
        ([0.1, 0.4, 0.4], "partly_identifiable"),
        ([0.4, 0.4, 0.4], "not_identifiable"),
    ],
)
def test_the_status_tells_all_from_a_part_from_nothing(spread, status):
    assert estimate_of([0.0, 0.0, 0.0], spread).status == status
