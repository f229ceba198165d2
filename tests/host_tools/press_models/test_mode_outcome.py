"""Answers, coverage and critical values of toys: posteriors that are known on paper, figures that are what they say."""

from __future__ import annotations

from dataclasses import asdict, replace

import numpy as np
import pytest
from linear_press import NOISE, STD, TOLD, on_paper, random_slopes
from small_surrogate import COLUMNS, LinearRows, linear_surrogate, white_noise

from device.measurement.parameters import COUNT, EVEN_STD, PARAMETERS, normalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswer, RampAnswers
from device.measurement.ramp_modes.intervals import PressIntervals, intervals_of
from device.measurement.ramp_modes.joint_region import joint_region
from device.measurement.ramp_modes.model import CriticalValues
from device.measurement.ramp_modes.posterior import CELLS, MIDDLES, TOGETHER, ModulusCells, PressFit
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST, PROFILE_FORCES_N, RESPONSE, SeenPresses
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models import mode_outcome as module
from host_tools.press_models.mode_outcome import (
    CRITICAL_RATIO,
    EvaluatedPresses,
    answers_to,
    critical_values,
    evaluated,
    outcome_of,
)
from host_tools.press_models.recorded_presses import RecordedPresses

K, RECORDED = len(PARAMETERS), 200
FLAT = RampAnswers(LinearRows(np.zeros((K, COLUMNS))), white_noise(1e-3))


def middle(rows: np.ndarray) -> np.ndarray:
    return np.zeros((1, COUNT))


def answer_of(mean: float, spread: float, misfit_ratio: float = 1.0) -> RampAnswer:
    """Return an answer of a Gaussian posterior, all but the modulus the same whatever that is."""
    at, width = np.full(K, mean), np.full(K, spread)
    likely = np.exp(-0.5 * ((MIDDLES - mean) / spread) ** 2)
    cells = ModulusCells(
        likely / likely.sum(), np.tile(at, (CELLS, 1)), np.tile(width, (CELLS, 1)), np.full(CELLS, 100.0)
    )
    fit = PressFit(at, at, width, 1000.0, cells)
    return RampAnswer(fit, intervals_of(fit), misfit_ratio, 0, at, (5.0, 0.2))


def recorded_of(rows: np.ndarray) -> RecordedPresses:
    """Return recorded presses of one ramp with rows [n, P], of inclusions in the middle of the ranges."""
    parameters = np.tile([8.5, 8.0, 40.0, 5.0, 30.0, 2.0, 0.5, 1.0, 1.0], (len(rows), 1))
    none = np.zeros((1, 2, len(PROFILE_FORCES_N), RINGS - 2))
    return RecordedPresses(parameters, [SeenPresses(row[None], none, np.zeros(1)) for row in rows])


@pytest.fixture
def figures(monkeypatch) -> None:
    """Found values that are told by the rows: their first column, twice and thrice it."""

    def found_values(answer, seen, answers, log_odds):
        first = seen.rows[0, 0]
        return CriticalValues(first, 2 * first, float(log_odds(seen.rows)[0]), 4 * first)

    monkeypatch.setattr(module, "found_values", found_values)


def thrice(rows: np.ndarray) -> np.ndarray:
    return 3 * rows[:, 0]


def test_an_interval_covers_the_truth_inside_it_ends_included_and_not_the_one_beside_it():
    truth = np.array([[-0.1, 0.32, 0.9], [0.3, -0.15, -1.0]])
    low, high = np.array([[-0.1, -0.1, -1.0]] * 2), np.array([[0.3, 0.3, 1.0]] * 2)
    presses = EvaluatedPresses(truth, truth, low, high, np.ones((2, 3), bool))
    np.testing.assert_array_equal(presses.is_covered, [[True, False, True]] * 2)


def test_a_part_is_of_the_same_presses_in_all_its_arrays():
    rng = np.random.default_rng(3)
    whole = EvaluatedPresses(*rng.normal(size=(4, 10, 3)), rng.integers(0, 2, (10, 3)).astype(bool))
    part = whole.part(slice(4, 7))
    for name in ("truth", "mean", "low", "high", "is_known", "is_covered"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[4:7])


def test_answers_stand_beside_their_truths_with_the_intervals_that_the_device_gives():
    truth = np.array([[0.0, 0.1, -0.2], [0.3, 0.3, 0.9]])
    found = evaluated(truth, [answer_of(0.0, 0.1), answer_of(0.2, 0.9 * EVEN_STD)])
    np.testing.assert_array_equal(found.truth, truth)
    np.testing.assert_array_equal(found.mean, [[0.0] * 3, [0.2] * 3])
    np.testing.assert_allclose(found.low, [[-0.16449] * 3, [-1.0] * 3], atol=1e-4)
    np.testing.assert_allclose(found.high, [[0.16449] * 3, [1.0] * 3], atol=1e-4)
    np.testing.assert_array_equal(found.is_known, [[True] * 3, [False] * 3])
    np.testing.assert_array_equal(found.in_region, [[True] * 2] * 2)  # of no posterior the whole range


def test_answers_to_no_press_join_others():
    nothing = evaluated(np.zeros((0, COUNT)), [])
    assert {getattr(nothing, name).shape for name in ("mean", "low", "high", "is_known")} == {(0, COUNT)}
    assert nothing.in_region is not None
    assert nothing.in_region.shape == (0, len(TOGETHER))


def test_truths_stand_in_the_joint_regions_of_their_answers():
    rng = np.random.default_rng(1)
    at = 0.1 * rng.standard_normal((2000, COUNT))
    regions = tuple(joint_region(at[:, :count], np.full(2000, 1 / 2000)) for count in TOGETHER)
    answer = answer_of(0.0, 0.1)
    answer = replace(answer, fit=replace(answer.fit, regions=regions))
    found = evaluated(np.array([[0.0, 0.1, 0.0], [0.15, 0.1, 0.25], [0.3, 0.0, 0.0]]), [answer] * 3)
    np.testing.assert_array_equal(found.in_region, [[True, True], [True, False], [False, False]])
    assert found.part(slice(1, 2)).in_region.shape == (1, 2)


def test_intervals_of_gaussian_answers_cover_nine_in_ten():
    rng = np.random.default_rng(1)
    truth = 0.2 + rng.normal(0, 0.1, (3000, 3))
    found = evaluated(truth, [answer_of(0.2, 0.1)] * len(truth))
    np.testing.assert_allclose(found.is_covered.mean(axis=0), 0.9, atol=0.015)


def test_presses_are_answered_by_the_fit_from_first_guesses_of_their_own():
    """The posterior of the linear model is known on paper, wherever it is begun."""
    slopes = random_slopes()
    answers = RampAnswers(linear_surrogate(slopes), NOISE)
    truth = 0.4 * np.random.default_rng(6).uniform(-1, 1, (2, K))
    rows = answers.surrogate.rows(truth)
    asked = []

    def guess(of: np.ndarray) -> np.ndarray:
        asked.append(of)
        return np.full((len(of), COUNT), 0.2)

    found = answers_to(answers, guess, list(rows[:, None]), [np.zeros(1)] * 2, 1)
    for answer, row, read in zip(found, rows, asked, strict=True):
        np.testing.assert_array_equal(read, row[None])
        mean, covariance = on_paper(row, slopes)
        spread = np.sqrt(np.diag(covariance))[:2]
        np.testing.assert_allclose(answer.mean[:2], mean[:2], atol=0.25 * spread.max())
        np.testing.assert_allclose(answer.spread[:2], spread, rtol=0.1)
        assert answer.spread[MODULUS] == pytest.approx(EVEN_STD, rel=0.1)
    assert STD < 0.1
    assert TOLD.sum() == K - 1


def test_each_press_is_answered_in_the_directions_of_its_own_ramps():
    """What a direction adds to a linear model is explained with it, and with another one is not."""
    rng = np.random.default_rng(8)
    slopes, along = rng.normal(0.0, 0.01, (K, COLUMNS)), np.zeros(COLUMNS)
    slopes[OFFSET, RESPONSE], along[FIRST] = 0.0, 0.02 * rng.choice([-1.0, 1.0], FIRST.stop - FIRST.start)
    answers = RampAnswers(LinearRows(slopes, along), white_noise(1e-3))
    directions = [np.array([0.3]), np.array([1.5, -0.8])]
    at = np.append(np.full(OFFSET, 0.1), 0.2)
    rows = [answers.surrogate.rows(np.tile(at, (len(one), 1)), one) for one in directions]
    found = answers_to(answers, middle, rows, directions, 1)
    assert max(answer.misfit_ratio for answer in found) < 0.01
    swapped = answers_to(answers, middle, rows, [directions[1][:1], directions[1][::-1]], 1)
    assert min(answer.misfit_ratio for answer in swapped) > 1


def seen_rows(count: int) -> np.ndarray:
    """Return rows whose contrast in the middle is far above noise, and whose first column is 1 to `count`."""
    rows = np.zeros((count, COLUMNS))
    rows[:, CONTRAST] = 1.0
    rows[:, 0] = np.arange(1.0, count + 1)
    return rows


@pytest.mark.usefixtures("figures")
def test_each_critical_value_is_one_that_few_recordings_pass():
    """Figures of 1, 2 ... 200: the quantile 0.99 lies at 1 + 0.99 x 199, 198.01 of 200."""
    found = critical_values(recorded_of(seen_rows(RECORDED)), [answer_of(0.0, 0.1)] * RECORDED, FLAT, thrice)
    expected = 1 + CRITICAL_RATIO * (RECORDED - 1)
    assert tuple(asdict(found).values()) == pytest.approx((expected, 2 * expected, 3 * expected, 4 * expected))
    assert (np.arange(1, RECORDED + 1) > found.misfit_ratio).mean() == pytest.approx(1 - CRITICAL_RATIO)


@pytest.mark.usefixtures("figures")
def test_critical_log_odds_are_those_of_presses_in_which_an_inclusion_stands_out():
    """The last half is dark but for the first column, and has the larger odds: these do not count, their misfits do."""
    rows = seen_rows(RECORDED)
    half = RECORDED // 2
    rows[half:, 1:] = 0.0
    rows[half:, 1 : RINGS // 2] = -2 * RECORDED
    found = critical_values(recorded_of(rows), [answer_of(0.0, 0.1)] * RECORDED, FLAT, thrice)
    assert found.outside_log_odds == pytest.approx(3 * (1 + CRITICAL_RATIO * (half - 1)))
    assert found.misfit_ratio == pytest.approx(1 + CRITICAL_RATIO * (RECORDED - 1))


@pytest.mark.usefixtures("figures")
def test_an_inclusion_stands_out_of_a_scan_when_it_does_in_one_of_its_ramps():
    rows = seen_rows(2)
    recorded = recorded_of(rows)
    recorded.seen[1] = recorded.seen[1]._replace(rows=np.stack([np.zeros(COLUMNS), rows[1]]))
    found = critical_values(recorded, [answer_of(0.0, 0.1)] * 2, FLAT, lambda rows: rows[-1:, 0])
    assert found.outside_log_odds == pytest.approx(1 + CRITICAL_RATIO)


@pytest.mark.usefixtures("figures")
def test_where_no_inclusion_stands_out_nothing_is_usual():
    recorded = recorded_of(np.zeros((5, COLUMNS)))
    with pytest.raises(InvalidQuantity, match="presses in which an inclusion stands out is 0"):
        critical_values(recorded, [answer_of(0.0, 0.1)] * 5, FLAT, thrice)


@pytest.mark.usefixtures("figures")
def test_an_outcome_keeps_what_it_makes_of_both_kinds_of_presses():
    truth = np.zeros((2, 3))
    simulated = evaluated(truth, [answer_of(0.0, 0.1)] * 2)
    recorded, found = recorded_of(seen_rows(3)), [answer_of(0.3, 0.1)] * 3
    outcome = outcome_of(simulated, recorded, found, FLAT, thrice, np.ones(len(simulated.truth), int))
    assert outcome.simulated is simulated
    np.testing.assert_allclose(outcome.recorded.truth, normalise(recorded.parameters)[:, :3])
    np.testing.assert_array_equal(outcome.recorded.mean, 0.3)
    assert asdict(outcome.critical) == asdict(critical_values(recorded, found, FLAT, thrice))


def test_guesses_in_the_middle_are_enough_for_a_press_that_tells_nothing():
    """A flat model: everything stays what it was before."""
    (answer,) = answers_to(FLAT, middle, [np.zeros((1, COLUMNS))], [np.zeros(1)], 1)
    assert isinstance(answer.intervals, PressIntervals)
    assert not answer.intervals.is_identifiable.any()
    np.testing.assert_allclose(answer.spread, EVEN_STD, rtol=0.1)
    assert answer.misfit_ratio == pytest.approx(0.0, abs=1e-12)
