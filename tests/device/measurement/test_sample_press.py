"""The posterior of a linear forward model with Gaussian noise is known on paper; nothing here is a real press."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, linear_surrogate, white_noise

from device.measurement.fit_press import PressPosterior
from device.measurement.press_parameters import EVEN_STD, PARAMETERS
from device.measurement.press_surrogate import CONTRAST_COLUMNS, GROWTH_COLUMNS, MODULUS
from device.measurement.sample_press import PressFit, fit_press

STD = 0.05
TOLD = np.arange(len(PARAMETERS)) != MODULUS
"""The modulus shows in nothing: its slope is 0."""
GROWTH = slice(CONTRAST_COLUMNS, CONTRAST_COLUMNS + GROWTH_COLUMNS)
TRUTH = np.array([0.2, -0.3, 0.4, 0.1, -0.2, 0.3, 0.0, -0.1, 0.25])
START = np.zeros(len(PARAMETERS))
NOISE = white_noise(STD)


@pytest.fixture(scope="module")
def slopes() -> np.ndarray:
    slopes = np.random.default_rng(5).normal(0.0, 0.15, (len(PARAMETERS), GROWTH_COLUMNS))
    slopes[MODULUS] = 0.0
    return slopes


@pytest.fixture(scope="module")
def row(slopes) -> np.ndarray:
    return linear_surrogate(slopes).rows(TRUTH[None])[0] + np.random.default_rng(6).normal(0, STD, COLUMNS)


@pytest.fixture(scope="module")
def fit(row, slopes) -> PressFit:
    return fit_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)


def on_paper(row: np.ndarray, slopes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean and covariance of the Gaussian posterior of what the row tells of; the ends of the ranges are far away."""
    covariance = STD**2 * np.linalg.inv(slopes[TOLD] @ slopes[TOLD].T)
    return covariance @ slopes[TOLD] @ row[GROWTH] / STD**2, covariance


def test_the_posterior_of_a_linear_model_is_the_gaussian_of_linear_algebra(fit, row, slopes):
    mean, covariance = on_paper(row, slopes)
    spread = np.sqrt(np.diag(covariance))
    assert (np.abs(mean) + 4 * spread < 1).all()
    np.testing.assert_allclose(fit.spread[TOLD], spread, rtol=0.05)
    assert np.abs((fit.mean[TOLD] - mean) / spread).max() < 5 / np.sqrt(fit.effective_samples)


def test_what_the_row_does_not_tell_keeps_the_spread_of_its_even_prior(fit):
    assert fit.spread[MODULUS] == pytest.approx(EVEN_STD, rel=0.05)
    assert fit.mean[MODULUS] == pytest.approx(0.0, abs=5 * EVEN_STD / np.sqrt(fit.effective_samples))


def test_the_samples_are_worth_enough(fit):
    assert 200 < fit.effective_samples <= 6000


def test_the_same_row_twice_gives_the_same_answer(fit, row, slopes):
    again = fit_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)
    np.testing.assert_array_equal(again.mean, fit.mean)
    np.testing.assert_array_equal(again.spread, fit.spread)


def test_a_parameter_at_the_end_of_its_range_is_not_estimated_beyond_it(slopes):
    truth = TRUTH.copy()
    truth[0] = 1.0
    row = linear_surrogate(slopes).rows(truth[None])[0]
    fit = fit_press(PressPosterior(row, linear_surrogate(slopes), NOISE), START)
    mean, covariance = on_paper(row, slopes)
    assert mean[0] == pytest.approx(1.0)
    spread = np.sqrt(covariance[0, 0])
    assert fit.mean[0] == pytest.approx(1 - spread * np.sqrt(2 / np.pi), abs=0.1 * spread)
    assert fit.spread[0] == pytest.approx(spread * np.sqrt(1 - 2 / np.pi), rel=0.1)


def test_a_start_outside_the_ranges_is_brought_inside(fit, row, slopes):
    outside = fit_press(PressPosterior(row, linear_surrogate(slopes), NOISE), np.full(len(PARAMETERS), 1.7))
    np.testing.assert_allclose(outside.best, fit.best, atol=1e-3)
