"""The posterior of a linear forward model with Gaussian noise is known on paper; nothing here is a real press."""

import numpy as np
import pytest
from linear_press import NOISE, RESPONSE, START, STD, TOLD, TRUTH, noisy_row, random_slopes
from small_surrogate import COLUMNS, linear_surrogate, random_surrogate

from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET


@pytest.fixture(scope="module")
def slopes() -> np.ndarray:
    return random_slopes()


@pytest.fixture(scope="module")
def row(slopes) -> np.ndarray:
    return noisy_row(slopes)


def test_the_best_fit_of_a_linear_model_is_its_ridge_regression(row, slopes):
    best = best_fit(PressPosterior(row, linear_surrogate(slopes), NOISE), START)
    precision = slopes @ slopes.T / STD**2 + np.eye(len(PARAMETERS)) / EVEN_STD**2
    np.testing.assert_allclose(best, np.linalg.solve(precision, slopes @ row[RESPONSE] / STD**2), atol=1e-4)


def test_the_misfit_of_rows_of_the_model_is_as_large_as_their_columns(slopes):
    """Less the eight parameters that fit; the mean of 40 chi-squares of 79 degrees strays by 2."""
    surrogate, rng = linear_surrogate(slopes), np.random.default_rng(7)
    rows = surrogate.rows(TRUTH[None]) + rng.normal(0, STD, (40, COLUMNS))
    posteriors = [PressPosterior(row, surrogate, NOISE) for row in rows]
    misfits = [np.sum(posterior.residuals(best_fit(posterior, START)) ** 2) for posterior in posteriors]
    assert np.mean(misfits) == pytest.approx(COLUMNS - TOLD.sum(), abs=8)


def test_a_row_that_no_parameters_explain_has_a_far_larger_misfit(row, slopes):
    strange = row.copy()
    strange[:CONTRAST_COLUMNS] += 10 * STD
    usual, other = (PressPosterior(one, linear_surrogate(slopes), NOISE) for one in (row, strange))
    assert np.sum(usual.residuals(best_fit(usual, START)) ** 2) < 1.5 * COLUMNS
    assert np.sum(other.residuals(best_fit(other, START)) ** 2) > 20 * COLUMNS


def test_nothing_is_possible_outside_the_ranges_and_inside_residuals_count_and_the_offsets_disk(row, slopes):
    """A place that is even over a disk is as likely at an offset as the offset is long."""
    posterior = PressPosterior(row, linear_surrogate(slopes), NOISE)
    log = posterior.log_density(np.array([TRUTH, np.where(TOLD, TRUTH, 1.01)]))
    expected = np.log1p(TRUTH[OFFSET]) - 0.5 * np.sum(posterior.residuals(TRUTH) ** 2)
    assert log[0] == pytest.approx(expected)
    assert log[1] == -np.inf


def test_the_jacobian_of_the_residuals_equals_central_differences():
    surrogate = random_surrogate()
    posterior, step = PressPosterior(surrogate.rows(0.1 * TRUTH[None])[0], surrogate, NOISE), 1e-5
    away = step * np.eye(len(PARAMETERS))
    differences = [(posterior.residuals(TRUTH + a) - posterior.residuals(TRUTH - a)) / (2 * step) for a in away]
    expected = np.array(differences).T
    np.testing.assert_allclose(
        posterior.residuals_and_jacobian(TRUTH[None])[1][0], expected, atol=1e-6 * np.abs(expected).max()
    )
