"""The fit with known nuisances on surrogates whose rows are known on paper."""

from __future__ import annotations

import numpy as np
import pytest
from small_surrogate import COLUMNS, linear_surrogate, random_surrogate, white_noise

from device.measurement.parameters import HIGH, LOW, PARAMETERS, denormalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.answers import RampAnswers
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, MODULUS, RESPONSE_COLUMNS
from host_tools.scores import noise_free
from host_tools.scores.noise_free import known_nuisances_fit, noise_free_chapter

RESPONSE = slice(CONTRAST_COLUMNS, CONTRAST_COLUMNS + RESPONSE_COLUMNS)
ALIKE = np.ones(COLUMNS)
TRUTH = np.array([0.2, -0.3, 0.4, 0.1, -0.2, 0.3, 0.0, -0.1, 0.25])
SIDE = 1e-6


@pytest.fixture(scope="module")
def slopes() -> np.ndarray:
    return np.random.default_rng(5).normal(0.0, 0.15, (len(PARAMETERS), RESPONSE_COLUMNS))


@pytest.mark.parametrize("modulus", [-0.9, 0.4, 0.95])
def test_an_exact_row_gives_back_size_depth_and_modulus(slopes, modulus):
    normalised = np.where(np.arange(len(PARAMETERS)) == MODULUS, modulus, TRUTH)
    surrogate = linear_surrogate(slopes)
    found = known_nuisances_fit(surrogate, surrogate.rows(normalised[None])[0], normalised, ALIKE)
    np.testing.assert_allclose(found, denormalise(normalised)[:3], rtol=1e-6)


def test_a_press_lies_along_the_images_rows_as_the_rows_that_it_is_fitted_to():
    """Sizes, depths and moduli that any direction would make of it are others."""
    surrogate = random_surrogate()
    along, mean = (surrogate.rows(TRUTH[None], direction_rad)[0] for direction_rad in (np.zeros(1), None))
    np.testing.assert_allclose(known_nuisances_fit(surrogate, along, TRUTH, ALIKE), denormalise(TRUTH)[:3], rtol=1e-5)
    assert np.abs(known_nuisances_fit(surrogate, mean, TRUTH, ALIKE) / denormalise(TRUTH)[:3] - 1).max() > 0.01


def test_a_row_that_does_not_fit_is_fitted_by_least_squares(slopes):
    """Size and depth of the linear model; the modulus is told by columns of its own, which they do not touch."""
    own = slopes.copy()
    own[MODULUS, :-5], own[:MODULUS, -5:] = 0.0, 0.0
    surrogate = linear_surrogate(own)
    added = np.zeros(RESPONSE_COLUMNS)
    added[:-5] = np.random.default_rng(6).normal(0, 0.05, RESPONSE_COLUMNS - 5)
    row = surrogate.rows(TRUTH[None])[0]
    row[RESPONSE] += added
    moved, *_ = np.linalg.lstsq(own[:2].T, added, rcond=None)
    assert np.abs(moved).min() > 0.005
    normalised = TRUTH.copy()
    normalised[:2] += moved
    np.testing.assert_allclose(
        known_nuisances_fit(surrogate, row, TRUTH, ALIKE), denormalise(normalised)[:3], rtol=1e-5
    )


def test_nuisances_are_believed_and_not_fitted(slopes):
    """Told a wrong albedo, the fit answers with another inclusion."""
    surrogate = linear_surrogate(slopes)
    row = surrogate.rows(TRUTH[None])[0]
    wrong = np.where(np.array(PARAMETERS) == "albedo", TRUTH + 0.5, TRUTH)
    found = known_nuisances_fit(surrogate, row, wrong, ALIKE)
    assert np.abs(found / denormalise(TRUTH)[:3] - 1).max() > 0.01


def test_the_true_unknowns_are_not_looked_at(slopes):
    surrogate = linear_surrogate(slopes)
    row = surrogate.rows(TRUTH[None])[0]
    hidden = np.where(np.arange(len(PARAMETERS)) < 3, np.nan, TRUTH)
    np.testing.assert_allclose(known_nuisances_fit(surrogate, row, hidden, ALIKE), denormalise(TRUTH)[:3], rtol=1e-6)


def test_a_fit_stays_inside_the_trained_ranges(slopes):
    """Twice as large a size coordinate as the range has: the answer is the range's end."""
    surrogate = linear_surrogate(slopes)
    row = surrogate.rows(TRUTH[None])[0]
    row[RESPONSE] += 2.0 * slopes[0]
    found = known_nuisances_fit(surrogate, row, TRUTH, ALIKE)
    assert found[0] == pytest.approx(HIGH[0], rel=1e-3)
    assert (found >= LOW[:3] - SIDE).all()
    assert (found <= HIGH[:3] + SIDE).all()


def test_the_chapter_scores_each_unknown_over_all_presses_and_by_octiles(tables, monkeypatch):
    """Presses that are answered with i % too much size, i being their rank by it: octiles of five ranks each."""
    noise = white_noise(0.01)
    fitted = []

    def answer(surrogate, row, normalised, std):
        truth = denormalise(normalised)[:3]
        fitted.append(truth[0])
        return truth

    monkeypatch.setattr(noise_free, "profile_rows", lambda tables, parameters: np.zeros((1, COLUMNS)))
    monkeypatch.setattr(noise_free, "known_nuisances_fit", answer)
    answers = RampAnswers(linear_surrogate(np.zeros((len(PARAMETERS), RESPONSE_COLUMNS))), noise)
    noise_free_chapter(answers, tables, presses=40, jobs=1)
    ranked = np.sort(fitted)

    def larger(surrogate, row, normalised, std):
        truth = denormalise(normalised)[:3]
        return truth * [1 + np.searchsorted(ranked, truth[0]) / 100, 1.0, 1.0]

    monkeypatch.setattr(noise_free, "known_nuisances_fit", larger)
    chapter = noise_free_chapter(answers, tables, presses=40, jobs=1)
    overall, octiles = chapter.tables
    assert overall.rows[0] == ("size_mm", "40", "19.500", f"{np.arange(40).std():.3f}", "0.000", "39.000")
    assert octiles.rows[0] == ("size_mm", *(f"{2 + 5 * number:.3f}" for number in range(8)))
    assert octiles.rows[1] == ("depth_mm", *["0.000"] * 8)
    assert chapter.benchmarks[0].error == pytest.approx(19.5)


def test_too_few_presses_for_a_score_of_the_modulus_are_refused(tables):
    with pytest.raises(InvalidQuantity, match="presses without noise is 39, but must be at least 40 presses"):
        noise_free_chapter(
            RampAnswers(linear_surrogate(np.zeros((9, RESPONSE_COLUMNS))), white_noise(0.01)), tables, presses=39
        )
