"""Belts from simulated answers: they cover nine in ten, whatever the truth is."""

import numpy as np
import pytest

from device.measurement.confidence_belt import Belt
from device.measurement.quantities import InvalidQuantity
from host_tools.press_models import confidence_belts as module
from host_tools.press_models.confidence_belts import SpreadAnswers, confidence_belts, widened


def shrunk_answers(count, seed, noise=0.15):
    """Posterior means of an even truth seen with noise: they shrink to the middle, most at the ends."""
    rng = np.random.default_rng(seed)
    truth = rng.uniform(-1, 1, count)
    seen = truth + rng.normal(0, noise, count)
    grid = np.linspace(-1, 1, 201)
    weight = np.exp(-0.5 * ((grid - seen[:, None]) / noise) ** 2)
    weight /= weight.sum(axis=1, keepdims=True)
    mean = weight @ grid
    return truth, mean, np.sqrt(np.maximum(weight @ grid**2 - mean**2, 1e-6))


def belt_of(truth, mean, spread, modulus=None, seed=7):
    """The belt of one unknown; with a modulus that has nothing to do with it, unless one is given."""
    drawn = np.random.default_rng(seed).uniform(-1, 1, len(truth)) if modulus is None else modulus
    return confidence_belts(*(column[:, None] for column in (truth, mean, spread)), drawn)[0]


def is_inside(belt, truth, mean, spread):
    intervals = [belt.interval(m, s) for m, s in zip(mean, spread, strict=True)]
    return np.array([one.low <= t <= one.high for one, t in zip(intervals, truth, strict=True)])


def test_intervals_cover_nine_in_ten_in_every_octile_of_the_truth():
    """A Bayesian interval covers 0.9 on the average, but misses most truths at the ends of the range."""
    belt = belt_of(*shrunk_answers(12_000, 1))
    truth, mean, spread = shrunk_answers(6000, 2)
    inside = is_inside(belt, truth, mean, spread)
    octile = np.minimum(((truth + 1) * 4).astype(int), 7)
    assert inside.mean() == pytest.approx(0.9, abs=0.02)
    assert min(inside[octile == k].mean() for k in range(8)) > 0.85


def test_what_the_modulus_moves_is_covered_in_its_every_octile():
    """Answers that read soft ones too small and hard ones too large, by up to 1.2 of their spread."""

    def moved(count, seed):
        truth, mean, spread = shrunk_answers(count, seed)
        modulus = np.random.default_rng([seed, 1]).uniform(-1, 1, count)
        return truth, mean + 1.2 * modulus * spread, spread, modulus

    belt = belt_of(*moved(12_000, 4))
    *answers, modulus = moved(8000, 5)
    inside = is_inside(belt, *answers)
    octile = np.minimum(((modulus + 1) * 4).astype(int), 7)
    assert min(inside[octile == k].mean() for k in range(8)) > 0.84
    assert 0.89 < inside.mean() < 0.94
    plain = belt_of(*moved(12_000, 4)[:3])
    unaware = is_inside(plain, *answers)
    assert min(unaware[octile == k].mean() for k in range(8)) < 0.82


def test_quantiles_that_lie_too_far_out_are_brought_back(monkeypatch):
    """Quantiles twice too far out: the factor is half of what it was."""
    columns = shrunk_answers(4000, 3)
    right = belt_of(*columns)
    learned = module._learned
    monkeypatch.setattr(module, "_learned", lambda *presses: module._scaled(learned(*presses), 2.0))
    narrowed = belt_of(*columns)
    np.testing.assert_allclose(narrowed.high, right.high, rtol=0.05, atol=0.05)
    np.testing.assert_allclose(narrowed.low, right.low, rtol=0.05, atol=0.05)


def test_too_few_presses_that_determine_an_unknown_are_refused():
    truth = np.linspace(-1, 1, 100)[:, None]
    with pytest.raises(InvalidQuantity, match="presses that determine an unknown is 100, but must be at least 120"):
        confidence_belts(truth, truth, np.full_like(truth, 0.2), truth[:, 0])


@pytest.mark.parametrize(("share", "is_determined"), [(0.04, False), (0.5, True)])
def test_an_unknown_that_presses_rarely_determine_is_never_called_determined(share, is_determined):
    """Answers that are exactly right cannot tell how wide the belts of the few are to be."""
    truth = np.linspace(-1, 1, 1000)
    spread = np.where(np.arange(1000) % 100 < 100 * share, 0.1, 0.5)
    belt = belt_of(truth, truth, spread)
    assert belt.interval(0.3, 0.1).is_identifiable == is_determined
    assert (belt.interval(0.3, 0.1)[:2] == (-1.0, 1.0)) != is_determined


def flat_belts(bound: float) -> tuple[Belt, ...]:
    ends, none = np.array([-1.0, 1.0]), np.zeros((2, 2))
    return (Belt(ends, np.log([0.01, 1.0]), none - bound, none + bound),) * 3


def test_belts_widen_by_the_factor_that_covers_as_many_recordings_as_chance_lets_be_told():
    """Errors of 0.1, 0.2 ... 10 spreads in belts of 1: of a hundred, 90 less 3 by chance: the 87th, 8.7."""
    error = np.repeat(np.arange(0.1, 10.05, 0.1)[:, None], 3, axis=1)
    spread = np.full_like(error, 0.05)
    wide = widened(flat_belts(1.0), error * spread, np.zeros_like(error), spread)
    for one in wide:
        np.testing.assert_allclose(one.high, 8.7, atol=0.05)
        np.testing.assert_allclose(one.low, -one.high)


def test_belts_that_hold_recordings_stay_what_they_are():
    error = np.repeat(np.linspace(-1, 1, 50)[:, None], 3, axis=1)
    spread = np.full_like(error, 0.05)
    same = widened(flat_belts(2.0), error * spread, np.zeros_like(error), spread)
    np.testing.assert_allclose(same[0].high, 2.0)


def test_recordings_that_determine_nothing_widen_nothing():
    belts, none = flat_belts(1.0), np.zeros((20, 3))
    assert widened(belts, none + 5.0, none, none + 1.0) == belts


def test_answers_within_belts_have_the_intervals_that_the_device_gives():
    rng = np.random.default_rng(5)
    answers = SpreadAnswers(rng.uniform(-1, 1, (6, 3)), rng.uniform(-1, 1, (6, 3)), rng.uniform(0.05, 0.5, (6, 3)))
    found = answers.within(flat_belts(1.5))
    np.testing.assert_array_equal(found.truth, answers.truth)
    np.testing.assert_array_equal(found.mean, answers.mean)
    for number in np.ndindex(6, 3):
        one = flat_belts(1.5)[0].interval(answers.mean[number], answers.spread[number])
        assert (found.low[number], found.high[number], found.is_known[number]) == one


def test_a_part_of_answers_is_of_the_same_presses():
    answers = SpreadAnswers(*np.random.default_rng(6).normal(size=(3, 8, 3)))
    part = answers.part(slice(2, 5))
    for name in ("truth", "mean", "spread"):
        np.testing.assert_array_equal(getattr(part, name), getattr(answers, name)[2:5])
