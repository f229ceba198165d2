"""Intervals from belts, with answers worked out on paper."""

import numpy as np
import pytest

from device.measurement.confidence_belt import Belt, belts_of, ends_in_belts
from device.measurement.quantities import UNKNOWNS, InvalidQuantity

TRUTH, LOG_SPREAD, BESIDE = np.array([-1.0, 1.0]), np.log([0.01, 0.2]), np.array([0.0])


def belts(low, high):
    return Belt(TRUTH, LOG_SPREAD, BESIDE, np.full((2, 2, 1), low), np.full((2, 2, 1), high))


def test_constant_bounds_give_the_mean_plus_and_minus_that_many_spreads():
    """-1.64 <= (truth - 0.2) / 0.1 <= 1.64: from 0.036 to 0.364, to half a step of the grid."""
    interval = belts(-1.64, 1.64).interval(0.2, 0.1, 0.0)
    assert (interval.low, interval.high) == (pytest.approx(0.036, abs=0.005), pytest.approx(0.364, abs=0.005))
    assert interval.is_identifiable


def test_what_the_grid_cuts_off_at_both_ends_is_given_back():
    """Over means that lie anywhere between two truths of the grid, half a step of it makes up for what is cut off.

    So the ends are right on average: 1.64 spreads of 0.1 below and above the mean, where 401 truths stand 0.005 apart.
    """
    means = np.linspace(0.1, 0.2, 1001)
    ends = np.array([belts(-1.64, 1.64).interval(mean, 0.1, 0.0)[:2] for mean in means])
    assert (ends[:, 0] - means).mean() == pytest.approx(-0.164, abs=2e-4)
    assert (ends[:, 1] - means).mean() == pytest.approx(0.164, abs=2e-4)


def test_bounds_that_grow_with_the_truth_shift_the_interval():
    """At truth t the answer usually lies t spreads too low: t - 1 <= (t - m) / s <= t + 1 with s = 0.1, m = 0."""
    low, high = np.array([[-2.0, -2.0], [0.0, 0.0]]), np.array([[0.0, 0.0], [2.0, 2.0]])
    shifted = Belt(TRUTH, LOG_SPREAD, BESIDE, low[:, :, None], high[:, :, None])
    interval = shifted.interval(0.0, 0.1, 0.0)
    assert interval.low == pytest.approx(-1 / 9, abs=0.005)
    assert interval.high == pytest.approx(1 / 9, abs=0.005)


def test_the_belt_lies_between_those_of_the_answers_beside_it():
    """Of one spread where the unknown beside it reads -1, and of three where it reads 1: of one and a half at -0.5."""
    high = np.tile([1.0, 3.0], (2, 2, 1))
    belt = Belt(TRUTH, LOG_SPREAD, np.array([-1.0, 1.0]), -high, high)
    for beside, bound in ((-1.0, 1.0), (-0.5, 1.5), (1.0, 3.0), (2.0, 3.0)):
        assert belt.interval(0.0, 0.1, beside)[:2] == pytest.approx((-0.1 * bound, 0.1 * bound), abs=0.005)


def test_bounds_of_many_presses_are_those_of_each():
    rng = np.random.default_rng(4)
    tables = rng.normal(size=(2, 3, 2, 4))
    belt = Belt(np.array([-1.0, 0.2, 1.0]), LOG_SPREAD, np.array([-1.0, -0.4, 0.1, 1.0]), *tables)
    truth, spread, beside = rng.uniform(-1, 1, (3, 5)) * [[1], [0.09], [1]] + [[0], [0.1], [0]]
    together = np.array(belt.bounds(truth, spread, beside))
    for number in range(5):
        one = slice(number, number + 1)
        np.testing.assert_allclose(together[:, one], belt.bounds(truth[one], spread[one], beside[one]))


def test_the_size_is_told_by_how_deep_and_depth_and_modulus_by_how_large():
    """Belts of as many spreads of 0.1 as 1 and the mean beside it."""
    ends = np.array([0.0, 1.0])
    high = np.tile(1 + ends, (2, 2, 1))
    told = ends_in_belts(np.array([0.2, 0.7, 0.1]), np.full(3, 0.1), [Belt(TRUTH, LOG_SPREAD, ends, -high, high)] * 3)
    assert told.high - [0.2, 0.7, 0.1] == pytest.approx([0.17, 0.12, 0.12], abs=0.005)


def test_an_interval_ends_where_the_range_does():
    assert belts(-1.64, 1.64).interval(0.98, 0.1, 0.0).high == 1.0


def test_an_unknown_that_the_press_does_not_narrow_down_keeps_all_of_its_range():
    """Half of an even range's spread is 0.289."""
    assert belts(-1.0, 1.0).interval(0.3, 0.29, 0.0) == (-1.0, 1.0, False)
    assert belts(-1.0, 1.0).interval(0.3, 0.28, 0.0).is_identifiable


@pytest.mark.parametrize("place", range(3))
def test_what_is_no_number_narrows_nothing_down(place):
    answer = [0.2, 0.1, 0.0]
    answer[place] = np.nan
    assert belts(-1.0, 1.0).interval(*answer) == (-1.0, 1.0, False)


def test_an_interval_that_is_all_of_the_range_narrows_nothing_down():
    """Six spreads of 0.25 reach from the middle beyond both ends."""
    assert belts(-6.0, 6.0).interval(0.0, 0.25, 0.0) == (-1.0, 1.0, False)


@pytest.mark.parametrize("bound", [1.64, 6.0])
def test_an_interval_is_made_of_what_json_knows(bound):
    interval = belts(-bound, bound).interval(np.float64(0.2), np.float64(0.2), 0.0)
    assert [type(one) for one in interval] == [float, float, bool]


def test_an_answer_unusual_for_every_truth_is_given_two_spreads_on_each_side():
    assert belts(5.0, 6.0).interval(1.0, 0.1, 0.0)[:2] == pytest.approx((0.8, 1.0))


def test_tables_of_another_shape_are_refused():
    with pytest.raises(InvalidQuantity, match="shape of the belt"):
        Belt(TRUTH, LOG_SPREAD, BESIDE, np.zeros((2, 2)), np.zeros((2, 2, 1)))


def test_each_unknown_has_the_interval_of_its_own_belts():
    """Belts of one, two and three spreads of 0.1, the last of an unknown that is not determined."""
    mean, spread = np.array([0.2, 0.0, 0.1]), np.array([0.1, 0.1, 0.4])
    three = [belts(-bound, bound) for bound in (1.0, 2.0, 3.0)]
    ends = ends_in_belts(mean, spread, three)
    for number, belt in enumerate(three):
        alone = belt.interval(float(mean[number]), float(spread[number]), 0.0)
        assert (ends.low[number], ends.high[number], ends.is_identifiable[number]) == alone
    assert ends.is_identifiable.tolist() == [True, True, False]


def test_belts_for_another_number_of_unknowns_are_refused():
    with pytest.raises(ValueError, match="zip"):
        ends_in_belts(np.zeros(3), np.ones(3), [belts(-1.0, 1.0)] * 2)


def stated(**more):
    """Belts of two spreads, as a card states those of each unknown."""
    two = np.full((2, 2, 1) if more else (2, 2), 2.0)
    one = {"truth": TRUTH.tolist(), "log_spread": LOG_SPREAD.tolist(), "low": (-two).tolist(), "high": two.tolist()}
    return {"bands": dict.fromkeys(UNKNOWNS, one | more)}


@pytest.mark.parametrize("more", [{"beside": [0.0]}, {}])
def test_a_card_of_before_says_the_same_whatever_is_beside(more):
    belt = belts_of(stated(**more))[1]
    for beside in (-1.0, 0.7):
        assert belt.interval(0.0, 0.1, beside)[:2] == pytest.approx((-0.2, 0.2), abs=0.005)
