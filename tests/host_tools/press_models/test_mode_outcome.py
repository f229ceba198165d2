"""Belts, coverage and critical values of toys: answers with Gaussian errors of a spread that they know."""

from __future__ import annotations

import numpy as np
import pytest
from small_surrogate import COLUMNS, linear_surrogate, white_noise

from device.measurement.confidence_belt import Belt
from device.measurement.parameters import EVEN_STD, PARAMETERS, denormalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.model import RampAnswer, RampAnswers
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, MODULUS, RESPONSE_COLUMNS
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models.confidence_belts import confidence_belts
from host_tools.press_models.mode_outcome import (
    CRITICAL_RATIO,
    EvaluatedPresses,
    ModeOutcome,
    answers_to,
    critical_log_odds,
    elongations,
    evaluate_mode,
)
from host_tools.press_models.noisy_presses import NoiseSampler, PressSet
from host_tools.press_models.recorded_presses import RecordedPresses

STD, COUNT, RECORDED = 0.1, 4000, 150
TOLD = np.arange(len(PARAMETERS)) != MODULUS
RESPONSE = slice(CONTRAST_COLUMNS, CONTRAST_COLUMNS + RESPONSE_COLUMNS)
NOISE = white_noise(STD)


class FirstColumns:
    """In place of an ensemble: the first three columns are the coordinates, seen with the rows' noise."""

    def estimate(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return rows[:, :3], np.full((len(rows), 3), STD)


def even(count: int, columns: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform(-1, 1, (count, columns))


class FirstColumn:
    """In place of a range network: the first column is the log odds."""

    def log_odds(self, rows: np.ndarray) -> np.ndarray:
        return rows[:, 0]


class FirstHarmonic:
    """In place of an ellipticity test: the first of the second harmonics is the deviations."""

    def elongation_deviations(self, second: np.ndarray, best: np.ndarray, mode: str) -> float:
        return float(second[0, 0, 0])


def harmonics(deviations: np.ndarray) -> np.ndarray:
    """Return second harmonics [n, 2, K, J - 2] of which that toy tells deviations [n]."""
    found = np.zeros((len(deviations), 2, len(PROFILE_FORCES_N), RINGS - 2))
    found[:, 0, 0, 0] = deviations
    return found


def gaussian(count: int, seed: int) -> EvaluatedPresses:
    truth = even(count, 3, seed)
    return EvaluatedPresses(
        truth, truth + np.random.default_rng([seed, 1]).normal(0, STD, truth.shape), np.full((count, 3), STD)
    )


def exact_belts(bound: float) -> tuple[Belt, ...]:
    """Belts of an error that is never more than so many spreads, whatever truth and spread."""
    ends, none = np.array([-1.0, 1.0]), np.zeros((2, 2))
    return (Belt(ends, np.log([0.01, 1.0]), none - bound, none + bound),) * 3


def some(recorded: RecordedPresses, count: int) -> RecordedPresses:
    return RecordedPresses(recorded.parameters[:count], recorded.rows[:count], recorded.second_harmonics[:count])


def evaluate_modes(answers: RampAnswers, press_set: PressSet, recorded: RecordedPresses, seed: int = 4) -> ModeOutcome:
    toys = FirstColumns(), answers, press_set, recorded, FirstHarmonic()
    return evaluate_mode("standard", *toys, outside_log_odds=0.3, seed=seed, jobs=1)


@pytest.fixture(scope="module")
def slopes() -> np.ndarray:
    slopes = np.random.default_rng(5).normal(0.0, 0.5, (len(PARAMETERS), RESPONSE_COLUMNS))
    slopes[MODULUS] = 0.0
    return slopes


@pytest.fixture(scope="module")
def answers(slopes) -> RampAnswers:
    return RampAnswers(linear_surrogate(slopes), {"standard": NOISE, "precise": NOISE})


@pytest.fixture(scope="module")
def press_set() -> PressSet:
    normalised = even(COUNT, len(PARAMETERS), 1)
    rows = np.zeros((COUNT, COLUMNS))
    rows[:, :3] = normalised[:, :3]
    return PressSet(normalised.astype(np.float32), rows.astype(np.float32), NoiseSampler(NOISE))


@pytest.fixture(scope="module")
def recorded(answers) -> RecordedPresses:
    """Presses of unknowns in the middle, seen with the surrogate's noise; elongations 1 to 150."""
    normalised = even(RECORDED, len(PARAMETERS), 2) * 0.8
    normalised[:, :3] = 0.0
    rows = answers.surrogate.rows(normalised) + np.random.default_rng(3).normal(0, STD, (RECORDED, COLUMNS))
    return RecordedPresses(denormalise(normalised), rows, harmonics(np.arange(1.0, RECORDED + 1)))


@pytest.fixture(scope="module")
def outcome(answers, press_set, recorded) -> ModeOutcome:
    return evaluate_modes(answers, press_set, recorded)


def test_an_interval_of_1_64_spreads_covers_nine_in_ten_gaussian_errors():
    covered, known = gaussian(3000, 1).covered(exact_belts(1.645))
    assert known.all()
    np.testing.assert_allclose(covered.mean(axis=0), 0.9, atol=0.015)


def test_belts_of_one_half_of_gaussian_answers_cover_nine_in_ten_of_the_other():
    both = gaussian(5000, 2)
    seen, unseen = both.part(slice(3000)), both.part(slice(3000, None))
    covered, _ = unseen.covered(confidence_belts(seen.truth, seen.mean, seen.spread))
    np.testing.assert_allclose(covered.mean(axis=0), 0.9, atol=0.02)


def test_an_interval_covers_the_truth_inside_it_and_not_the_one_beside_it():
    """0.1 +- 2 x 0.1 holds -0.05 and 0.29, not 0.32 and -0.15; a spread above half the prior's tells nothing."""
    truth = np.array([[-0.05, 0.32, 0.9], [0.29, -0.15, -0.9]])
    spread = np.array([[0.1, 0.1, 0.51 * EVEN_STD]] * 2)
    covered, known = EvaluatedPresses(truth, np.full((2, 3), 0.1), spread).covered(exact_belts(2.0))
    np.testing.assert_array_equal(covered, [[True, False, True]] * 2)
    np.testing.assert_array_equal(known, [[True, True, False]] * 2)


def test_a_part_is_of_the_same_presses_in_all_its_arrays():
    whole = gaussian(10, 3)
    part = whole.part(slice(4, 7))
    for name in ("truth", "mean", "spread"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[4:7])


def test_simulated_answers_are_of_the_half_that_the_belts_have_not_seen(outcome, press_set):
    """Noise is as large as the light, 1 + a contrast that is even between -1 and 1: its mean square is 1 + 1/3."""
    np.testing.assert_array_equal(outcome.simulated.truth, press_set.normalised[COUNT // 2 :, :3])
    error = outcome.simulated.mean - outcome.simulated.truth
    np.testing.assert_allclose(error.std(axis=0), STD * np.sqrt(4 / 3), rtol=0.05)
    assert (outcome.simulated.covered(outcome.belts)[0].mean(axis=0) > 0.875).all()


def test_belts_come_from_the_first_halves_alone(outcome, answers, press_set, recorded):
    """Truths that lie elsewhere in the second half, simulated or recorded, leave the belts what they were."""
    parameters = recorded.parameters.copy()
    parameters[RECORDED // 2 :, :3] = denormalise(np.full((1, len(PARAMETERS)), 0.9))[0, :3]
    elsewhere = RecordedPresses(parameters, recorded.rows, recorded.second_harmonics)
    normalised = press_set.normalised.copy()
    normalised[COUNT // 2 :] *= -1
    turned = PressSet(normalised, press_set.rows, press_set.sampler)
    other = evaluate_modes(answers, turned, elsewhere)
    for one, again in zip(outcome.belts, other.belts, strict=True):
        np.testing.assert_array_equal(one.low, again.low)
        np.testing.assert_array_equal(one.high, again.high)
    assert other.simulated.covered(other.belts)[0].mean() < 0.5


def test_recorded_answers_keep_their_truth_and_the_networks_mean(outcome, recorded):
    np.testing.assert_allclose(outcome.recorded.truth, np.zeros((RECORDED // 2, 3)), atol=1e-12)
    np.testing.assert_array_equal(outcome.recorded.mean, recorded.rows[RECORDED // 2 :, :3])
    np.testing.assert_array_equal(outcome.recorded.spread, STD)


def test_a_usual_elongation_is_one_that_few_recordings_pass(outcome, recorded):
    """Elongations of 1, 2 ... 150: the quantile 0.9875 lies at 1 + 0.9875 x 149."""
    assert outcome.elongation_deviations == pytest.approx(1 + CRITICAL_RATIO * (RECORDED - 1))


def test_an_elongation_is_that_of_a_press_about_its_own_best_fit_in_its_mode(recorded):
    class Told:
        def elongation_deviations(self, second, best, mode):
            return second[0, 0, 0] + 1000 * best[0] + len(mode)

    none = np.zeros(3)
    found = [RampAnswer(none, none, 1.0, best=np.full(len(PARAMETERS), number)) for number in (0.0, 1.0)]
    told = elongations(Told(), some(recorded, 2), found, "precise")
    np.testing.assert_array_equal(told, [1 + 7, 2 + 1000 + 7])


def test_a_usual_misfit_is_a_high_quantile_of_chi_square(outcome):
    """Less the eight parameters that fit: COLUMNS - 8 degrees of freedom, whose 0.9875 quantile is 2.24
    deviations above their number (and a little for its skewness); of 150 draws it strays by a twentieth."""
    freedom = COLUMNS - TOLD.sum()
    expected = (freedom + 2.24 * np.sqrt(2 * freedom) + 2 / 3 * (2.24**2 - 1)) / COLUMNS
    assert outcome.misfit_ratio == pytest.approx(expected, rel=0.15)


def test_usual_log_odds_are_those_of_presses_in_which_an_inclusion_stands_out():
    """Of two hundred rows the last half is dark in the middle, and has the larger odds: it does not count."""
    rows = np.zeros((200, COLUMNS))
    rows[:100, :CONTRAST_COLUMNS] = np.linspace(40, 60, 100)[:, None]
    rows[100:, 0], rows[100:, 1:4] = 100.0, -50.0
    assert critical_log_odds(FirstColumn(), rows, NOISE) == pytest.approx(np.quantile(rows[:100, 0], CRITICAL_RATIO))


def test_where_no_inclusion_stands_out_nothing_is_usual():
    with pytest.raises(InvalidQuantity, match="presses in which an inclusion stands out is 0"):
        critical_log_odds(FirstColumn(), np.zeros((5, COLUMNS)), NOISE)


def test_the_log_odds_are_kept_as_they_are_told(outcome):
    assert outcome.outside_log_odds == 0.3


def test_the_same_seed_gives_the_same_answers_and_another_one_other_noise(outcome, answers, press_set, recorded):
    few = some(recorded, 2)
    again, other = (evaluate_modes(answers, press_set, few, seed) for seed in (4, 5))
    np.testing.assert_array_equal(again.simulated.mean, outcome.simulated.mean)
    assert (other.simulated.mean != again.simulated.mean).mean() > 0.99


def test_mode_precise_answers_by_the_fit_and_not_by_the_networks(answers, slopes):
    """The posterior of the linear model is known on paper; the toy networks read zeros."""
    truth = 0.4 * even(2, len(PARAMETERS), 6)
    rows = answers.surrogate.rows(truth)
    found = answers_to("precise", FirstColumns().estimate, answers, rows, 1)
    std = STD * np.sqrt(np.diag(np.linalg.inv(slopes[TOLD] @ slopes[TOLD].T)))[:2]
    for answer, at in zip(found, truth, strict=True):
        np.testing.assert_allclose(answer.mean[:2], at[:2], atol=0.25 * std.max())
        np.testing.assert_allclose(answer.spread[:2], std, rtol=0.1)
        assert answer.spread[MODULUS] == pytest.approx(EVEN_STD, rel=0.1)
