"""Answers of ramps and of scans by toys: which press is the nearest, and what it tells of being round and inside."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, REACH_MM, LinearRows, random_scan_surrogate, white_noise

from device.measurement.parameters import COUNT, HIGH, PARAMETERS, RANGES
from device.measurement.ramp_modes import answers as answers_module
from device.measurement.ramp_modes.answers import RampAnswer, RampAnswers, UnlikeDesign
from device.measurement.ramp_modes.ellipticity import elongation_deviations
from device.measurement.ramp_modes.model import NOT_TOLD_LOG_ODDS, found_values
from device.measurement.ramp_modes.noise import light_ratio
from device.measurement.ramp_modes.radial_profile import FIRST, PROFILE_FORCES_N, RESPONSE, SECOND, SeenPresses
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET, TISSUE
from device.measurement.recording.ring_means import RINGS

STD = 0.002
SHARED = np.array([0.2, -0.3, 0.1, 0.1, -0.2, 0.3, 0.0, -0.1])
FIRST_GUESSES = np.zeros((1, COUNT))


@pytest.fixture(scope="module")
def answers() -> RampAnswers:
    """Rows linear in all but the modulus, which shows in nothing; the noise is white."""
    slopes = np.random.default_rng(5).normal(0.0, 0.02, (len(PARAMETERS), COLUMNS))
    slopes[MODULUS] = 0.0
    slopes[OFFSET, RESPONSE] = 0.0
    return RampAnswers(LinearRows(slopes), white_noise(STD))


def rows_at(answers, offsets_mm, seed=1):
    each = np.column_stack([np.tile(SHARED, (len(offsets_mm), 1)), 2 * np.array(offsets_mm) / HIGH[OFFSET] - 1])
    rows = answers.surrogate.rows(each)
    return rows + light_ratio(rows) * np.random.default_rng([seed, 7]).normal(0, STD, rows.shape)


def test_one_press_lies_within_the_axis_reach_and_a_scans_presses_as_far_as_the_surrogate(answers):
    assert [answers.reach_mm(presses) for presses in (1, 2, 5)] == [HIGH[OFFSET], REACH_MM, REACH_MM]


@pytest.mark.parametrize(("offsets_mm", "nearest"), [((1.4,), 0), ((1.2, 5.0), 0), ((4.0, 6.5, 1.5), 2)])
def test_the_nearest_press_is_told_with_its_best_fit_in_coordinates_of_the_parameters(answers, offsets_mm, nearest):
    """The offset is told to std / (0.02 sqrt(120)) of a coordinate, some 0.01 mm."""
    answer = answers.answer(rows_at(answers, offsets_mm), FIRST_GUESSES)
    assert answer.nearest == nearest
    assert answer.best.shape == (len(PARAMETERS),)
    np.testing.assert_array_equal(answer.best[:OFFSET], answer.fit.best[:OFFSET])
    found_mm = (answer.best[OFFSET] + 1) / 2 * HIGH[OFFSET]
    assert found_mm == pytest.approx(offsets_mm[nearest], abs=0.08)


@pytest.mark.parametrize("offsets_mm", [(1.4,), (1.2, 5.0, 3.3)])
def test_mean_spread_and_tissue_are_those_of_the_posterior(answers, offsets_mm):
    """The tissue runs from 2 to 30 kPa by ratio: a coordinate x is the middle's 15^(x / 2), a spread a share of it."""
    answer = answers.answer(rows_at(answers, offsets_mm), FIRST_GUESSES)
    np.testing.assert_array_equal(answer.mean, answer.fit.mean[:COUNT])
    np.testing.assert_array_equal(answer.spread, answer.fit.spread[:COUNT])
    mean_kpa, spread_kpa = answer.tissue_kpa
    low_kpa, high_kpa, _ = RANGES["tissue_modulus_kpa"]
    middle_kpa, half = np.sqrt(low_kpa * high_kpa), np.log(high_kpa / low_kpa) / 2
    assert mean_kpa == pytest.approx(middle_kpa * np.exp(half * answer.fit.mean[TISSUE]))
    assert spread_kpa == pytest.approx(mean_kpa * half * answer.fit.spread[TISSUE])
    assert mean_kpa == pytest.approx(middle_kpa * np.exp(half * 0.1), abs=4 * spread_kpa)
    assert answer.tissue_from_middle_ratio == pytest.approx(abs(answer.fit.mean[TISSUE]))
    told = np.arange(COUNT) != MODULUS
    assert (answer.intervals.low[told] < answer.mean[told]).all()
    assert answer.intervals.is_identifiable.tolist() == told.tolist()


@pytest.mark.parametrize("offsets_mm", [(1.4,), (1.2, 5.0)])
def test_the_misfit_of_presses_of_the_model_is_one_but_for_what_was_fitted(answers, offsets_mm):
    """Of 153 columns, and 120 more of a further press, as many fewer as parameters fit; a mean of 12 strays by 4 %."""
    misfits = [answers.answer(rows_at(answers, offsets_mm, seed), FIRST_GUESSES).misfit_ratio for seed in range(12)]
    columns = COLUMNS + 120 * (len(offsets_mm) - 1)
    assert np.mean(misfits) == pytest.approx(1 - (OFFSET - 1 + len(offsets_mm)) / columns, abs=0.1)


def test_of_several_first_guesses_of_a_scan_the_best_fit_counts(answers):
    """A linear model has one best fit: wherever begun, it is found."""
    rows = rows_at(answers, (1.2, 5.0))
    one = answers.answer(rows, FIRST_GUESSES)
    several = answers.answer(rows, np.array([[0.99, 0.99, 0.99], [-0.99, 0.5, 1.7]]))
    np.testing.assert_allclose(several.fit.best, one.fit.best, atol=1e-3)


@pytest.mark.parametrize(("offsets_mm", "direction_rad"), [((1.4,), (0.4,)), ((1.2, 5.0, 3.3), (0.4, -1.5, 2.0))])
def test_with_their_directions_presses_are_answered_as_if_none_mattered(answers, offsets_mm, direction_rad):
    """What a direction adds to the first harmonic, ten times the noise, is taken out again; untold it is misfit."""
    rows, directions = rows_at(answers, offsets_mm), np.array(direction_rad)
    along = np.zeros(COLUMNS)
    along[FIRST] = 10 * STD * np.random.default_rng(4).choice([-1.0, 1.0], FIRST.stop - FIRST.start)
    turned = RampAnswers(LinearRows(answers.surrogate.slopes, along), answers.noise)
    seen = rows + np.cos(2 * directions)[:, None] * along
    expected, found = answers.answer(rows, FIRST_GUESSES), turned.answer(seen, FIRST_GUESSES, directions)
    assert found.nearest == expected.nearest
    np.testing.assert_allclose(found.mean, expected.mean, atol=1e-6)
    np.testing.assert_allclose(found.spread, expected.spread, atol=1e-6)
    assert found.misfit_ratio == pytest.approx(expected.misfit_ratio, rel=1e-6)
    assert turned.answer(seen, FIRST_GUESSES).misfit_ratio > 5 * found.misfit_ratio


def test_a_scans_fit_begins_where_its_presses_are_explained_in_their_own_directions(answers, monkeypatch):
    begun, starts = [], answers_module.scan_starts

    def asked(*told):
        begun.append(told[-1])
        return starts(*told)

    monkeypatch.setattr(answers_module, "scan_starts", asked)
    direction_rad = np.array([0.4, -1.5])
    answers.answer(rows_at(answers, (1.2, 5.0)), FIRST_GUESSES, direction_rad)
    answers.answer(rows_at(answers, (1.2, 5.0)), FIRST_GUESSES)
    assert begun == [direction_rad, None]


def answer_at(offset_mm: float, nearest: int, unlike: UnlikeDesign | None = None) -> RampAnswer:
    at = np.append(SHARED, 2 * offset_mm / HIGH[OFFSET] - 1)
    return RampAnswer(None, None, 1.25, nearest, at, (24.49, 0.5), unlike)


def test_round_and_inside_are_told_by_the_nearest_press():
    answers = RampAnswers(random_scan_surrogate(), white_noise(STD))
    rng = np.random.default_rng(3)
    rows, seconds = rng.normal(0, 0.1, (3, COLUMNS)), rng.normal(0, 0.1, (3, 2, len(PROFILE_FORCES_N), RINGS - 2))
    answer, direction_rad = answer_at(1.5, nearest=2), np.array([0.3, -1.0, 0.8])
    found = found_values(answer, SeenPresses(rows, seconds, direction_rad), answers, lambda of: of[:, 7])
    assert (found.misfit_ratio, found.outside_log_odds) == (1.25, rows[2, 7])
    assert found.tissue_from_middle_ratio == pytest.approx(0.85, abs=1e-3)
    (of_round,) = answers.surrogate.rows(answer.best[None], direction_rad[2:])
    expected = elongation_deviations(seconds[2], of_round, answers.noise)
    assert found.elongation_deviations == expected > 0


def test_what_the_forward_model_itself_says_in_a_direction_is_round_in_that_one_alone():
    answers = RampAnswers(random_scan_surrogate(), white_noise(STD))
    answer, direction_rad = answer_at(1.5, nearest=1), np.array([-1.0, 0.8])
    along = answers.surrogate.rows(np.tile(answer.best, (2, 1)), direction_rad)[:, SECOND]
    seconds = np.stack([along, np.zeros_like(along)], axis=1).reshape(2, 2, len(PROFILE_FORCES_N), RINGS - 2)
    rows = np.zeros((2, COLUMNS))
    found, turned = (
        found_values(answer, SeenPresses(rows, seconds, told), answers, lambda of: of[:, 0]).elongation_deviations
        for told in (direction_rad, direction_rad[::-1])
    )
    assert found == pytest.approx(0.0, abs=1e-9)
    assert turned > 0.01


def test_presses_that_all_lie_beside_tell_neither_round_nor_inside():
    """Networks have seen presses up to 2 mm aside: beyond, only the misfit can reject."""
    answers = RampAnswers(random_scan_surrogate(), white_noise(STD))
    seen = SeenPresses(np.zeros((1, COLUMNS)), np.ones((1, 2, len(PROFILE_FORCES_N), RINGS - 2)), np.zeros(1))
    found = found_values(answer_at(2.1, nearest=0), seen, answers, lambda of: of[:, 0] + 9)
    assert found.misfit_ratio == 1.25
    assert (found.elongation_deviations, found.outside_log_odds) == (0.0, NOT_TOLD_LOG_ODDS)
    assert found.tissue_from_middle_ratio == pytest.approx(0.85, abs=1e-3)


@pytest.mark.parametrize(
    ("offset_mm", "is_round_told", "is_inside_told"), [(1.9, True, True), (2.8, True, False), (2.9, False, False)]
)
def test_a_commissioned_probe_tells_round_up_to_the_corner_of_both_axes(offset_mm, is_round_told, is_inside_told):
    """Of 40 pairs of inclusions close together 24 were read as one there, and none of those was asked whether it is."""
    answers = RampAnswers(random_scan_surrogate(), white_noise(STD))
    seen = SeenPresses(np.zeros((1, COLUMNS)), np.ones((1, 2, len(PROFILE_FORCES_N), RINGS - 2)), np.zeros(1))
    row = np.random.default_rng(3).normal(0, 0.1, COLUMNS)
    unlike = UnlikeDesign(row, np.zeros(COLUMNS), np.zeros((COLUMNS, 1)), np.zeros(len(row[SECOND])))
    found = found_values(answer_at(offset_mm, 0, unlike), seen, answers, lambda of: of[:, 0] + 9)
    expected = elongation_deviations(seen.second_harmonics[0], row, answers.noise) if is_round_told else 0.0
    assert found.elongation_deviations == expected
    assert (expected > 0) == is_round_told
    assert found.outside_log_odds == (9 if is_inside_told else NOT_TOLD_LOG_ODDS)
