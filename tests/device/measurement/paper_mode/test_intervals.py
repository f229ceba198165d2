"""90 % means 90 %: intervals counted on synthetic scenes whose noise is known."""

import numpy as np
import pytest

from device.measurement.confidence_belt import COVERAGE
from device.measurement.paper_mode.intervals import HeldOut
from device.measurement.quantities import InvalidQuantity

LOW, HIGH = np.array([1.0, 4.0, 40.0]), np.array([15.0, 12.0, 120.0])
NOISE = np.array([0.3, 0.2, 5.0])


def scenes(rng, count, noise=NOISE):
    truth = rng.uniform(LOW, HIGH, (count, 3))
    return truth + rng.normal(0.0, noise, truth.shape), truth


def held_out(noise=NOISE, count=1000, seed=7):
    return HeldOut(*scenes(np.random.default_rng(seed), count, noise), LOW, HIGH)


def intervals(model, estimates):
    found = [model.interval(estimate) for estimate in estimates]
    low, high, identifiable = (np.array([getattr(i, name) for i in found]) for name in ("low", "high", "identifiable"))
    return low, high, identifiable


def test_nine_tenths_of_new_truths_lie_inside():
    """3000 scenes on 1000 held-out ones: counting alone scatters by about 1 %."""
    estimate, truth = scenes(np.random.default_rng(8), 3000)
    low, high, _ = intervals(held_out(), estimate)
    inside = ((low <= truth) & (truth <= high)).mean(axis=0)
    np.testing.assert_allclose(inside, COVERAGE, atol=0.025)


def test_neither_tail_holds_more_than_its_share():
    estimate, truth = scenes(np.random.default_rng(9), 3000)
    low, high, _ = intervals(held_out(), estimate)
    np.testing.assert_allclose((truth < low).mean(axis=0), 0.05, atol=0.025)
    np.testing.assert_allclose((truth > high).mean(axis=0), 0.05, atol=0.025)


def test_the_width_is_that_of_the_noise():
    """The central 90 % of a normal distribution span 3.29 standard deviations."""
    estimate = np.tile((LOW + HIGH) / 2, (100, 1)) + np.linspace(-1, 1, 100)[:, None]
    low, high, identifiable = intervals(held_out(), estimate)
    np.testing.assert_allclose((high - low).mean(axis=0), 3.29 * NOISE, rtol=0.2)
    assert identifiable.all()


def test_a_bias_of_the_estimate_is_taken_out():
    """Estimates that are always 1 mm too large: the interval lies around the truth, not around the estimate."""
    estimate, truth = scenes(np.random.default_rng(5), 1000, noise=0.05)
    found = HeldOut(estimate + np.array([1.0, 0.0, 0.0]), truth, LOW, HIGH).interval(np.array([9.0, 8.0, 80.0]))
    assert (found.low[0] + found.high[0]) / 2 == pytest.approx(8.0, abs=0.1)


def test_an_unknown_that_the_data_do_not_determine_gets_the_box_and_says_so():
    """The estimated modulus does not depend on the true one: its interval is about 90 % of the box."""
    estimate, truth = scenes(np.random.default_rng(6), 2000)
    estimate[:, 2] = 80.0 + np.random.default_rng(1).normal(0.0, 1.0, 2000)
    found = HeldOut(estimate, truth, LOW, HIGH).interval(np.array([8.0, 8.0, 80.0]))
    assert found.identifiable.tolist() == [True, True, False]
    assert found.high[2] - found.low[2] > 0.7 * (HIGH - LOW)[2]


def test_only_scenes_that_look_alike_count():
    """Noise ten times larger below 8 mm of depth: a shallow estimate keeps its narrow interval."""
    rng = np.random.default_rng(3)
    truth = rng.uniform(LOW, HIGH, (2000, 3))
    noise = np.where(truth[:, 1:2] < 8.0, 0.03, 0.3) * (1.0, 1.0, 10.0)
    model = HeldOut(truth + rng.normal(0.0, 1.0, truth.shape) * noise, truth, LOW, HIGH)
    shallow, deep = (model.interval(np.array([8.0, depth_mm, 80.0])) for depth_mm in (5.5, 10.5))
    ratio = (deep.high - deep.low) / (shallow.high - shallow.low)
    assert np.all(ratio > 5)


@pytest.mark.parametrize("corner", [LOW - 0.1, HIGH + 0.1, np.array([1.0, 12.0, 120.0])])
def test_an_interval_never_leaves_the_box(corner):
    found = held_out().interval(corner)
    assert np.all(found.low >= LOW)
    assert np.all(found.high <= HIGH)
    assert np.all(found.low <= found.high)


def test_an_estimate_far_outside_the_box_is_not_sure_of_itself_though_nothing_is_left_of_its_interval():
    found = held_out().interval(np.array([30.0, 8.0, 80.0]))
    assert found.low[0] == found.high[0] == HIGH[0]
    assert found.identifiable.tolist() == [False, True, True]


def test_too_few_scenes_to_speak_of_nine_tenths_are_refused():
    estimate, truth = scenes(np.random.default_rng(2), 79)
    with pytest.raises(InvalidQuantity, match="^held-out scenes is 79, but must be at least 80"):
        HeldOut(estimate, truth, LOW, HIGH)


@pytest.mark.parametrize(
    ("estimate", "truth"), [((100, 3), (99, 3)), ((100, 2), (100, 2)), ((100,), (100,)), ((100, 1), (100, 3))]
)
def test_tables_of_other_shapes_are_refused_with_both(estimate, truth):
    with pytest.raises(InvalidQuantity, match=r"^held-out shapes is \(100.* and \("):
        HeldOut(np.ones(estimate), np.ones(truth), LOW, HIGH)


@pytest.mark.parametrize("part", [0, 1])
def test_a_number_that_is_not_finite_is_refused(part):
    tables = scenes(np.random.default_rng(2), 100)
    tables[part][50, 1] = np.nan
    with pytest.raises(InvalidQuantity, match="^held-out scenes is not finite"):
        HeldOut(*tables, LOW, HIGH)


@pytest.mark.parametrize("box_low", [HIGH, np.array([1.0, 4.0, 120.0]), np.array([np.nan, 4.0, 40.0]), LOW[:2]])
def test_a_box_that_is_none_is_refused(box_low):
    tables = scenes(np.random.default_rng(2), 100)
    with pytest.raises(InvalidQuantity, match="^held-out box is"):
        HeldOut(*tables, box_low, HIGH)
