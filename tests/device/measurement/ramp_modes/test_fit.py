"""The posterior of a linear forward model with Gaussian noise is known on paper; nothing here is a real press."""

import numpy as np
import pytest
from linear_press import NOISE, RESPONSE, START, STD, TOLD, TRUTH, noisy_row, random_slopes
from small_surrogate import COLUMNS, linear_surrogate, random_surrogate

from device.measurement.parameters import EVEN_STD, PARAMETERS
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, DEPTH, MODULUS, OFFSET, SIZE, TISSUE


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
    """Ten deviations on every contrast, by which the light and so its noise grows by half."""
    strange = row.copy()
    strange[:CONTRAST_COLUMNS] += 10 * STD
    usual, other = (PressPosterior(one, linear_surrogate(slopes), NOISE) for one in (row, strange))
    assert np.sum(usual.residuals(best_fit(usual, START)) ** 2) < 1.5 * COLUMNS
    assert np.sum(other.residuals(best_fit(other, START)) ** 2) > 0.9 * CONTRAST_COLUMNS * (10 / (1 + 10 * STD)) ** 2


def test_nothing_is_possible_outside_the_ranges_and_inside_residuals_count_and_the_offsets_disk(row, slopes):
    """A place that is even over a disk is as likely at an offset as the offset is long."""
    posterior = PressPosterior(row, linear_surrogate(slopes), NOISE)
    log = posterior.log_density(np.array([TRUTH, np.where(TOLD, TRUTH, 1.01)]))
    expected = np.log1p(TRUTH[OFFSET]) - 0.5 * np.sum(posterior.residuals(TRUTH) ** 2)
    assert log[0] == pytest.approx(expected)
    assert log[1] == -np.inf


def test_what_is_not_possible_has_no_density(row, slopes):
    """An inclusion as soft as its tissue, and one whose lower end would touch a thin slab's base."""
    posterior = PressPosterior(row, linear_surrogate(slopes), NOISE)
    soft, deep = np.zeros(len(PARAMETERS)), np.zeros(len(PARAMETERS))
    soft[[MODULUS, TISSUE]] = -0.9, 0.5
    deep[[SIZE, DEPTH, TISSUE + 1]] = 0.9, 0.9, -0.9
    log = posterior.log_density(np.array([np.zeros(len(PARAMETERS)), soft, deep]))
    np.testing.assert_array_equal(np.isfinite(log), [True, False, False])


@pytest.mark.parametrize("direction_rad", [None, np.array([0.7]), np.array([np.nan])])
def test_the_jacobian_of_the_residuals_equals_central_differences(direction_rad):
    surrogate, step = random_surrogate(), 1e-5
    row = surrogate.rows(0.1 * TRUTH[None], direction_rad)[0]
    posterior = PressPosterior(row, surrogate, NOISE, direction_rad=direction_rad)
    away = step * np.eye(len(PARAMETERS))
    differences = [(posterior.residuals(TRUTH + a) - posterior.residuals(TRUTH - a)) / (2 * step) for a in away]
    expected = np.array(differences).T
    found, jacobian = posterior.residuals_and_jacobian(TRUTH[None])
    np.testing.assert_allclose(jacobian[0], expected, atol=1e-6 * np.abs(expected).max())
    np.testing.assert_allclose(found[0], posterior.residuals(TRUTH), rtol=1e-12)


def test_a_press_is_explained_in_the_direction_in_which_its_inclusion_lies_and_in_no_other():
    """But for half a turn, after which frame and LEDs look the same."""
    surrogate, direction = random_surrogate(), 0.7
    row = surrogate.rows(TRUTH[None], np.array([direction]))[0]

    def residuals(told_rad):
        told = None if told_rad is None else np.array([told_rad])
        return np.abs(PressPosterior(row, surrogate, NOISE, direction_rad=told).residuals(TRUTH)).max()

    for same in (direction, direction + np.pi, -direction):
        assert residuals(same) < 1e-9
    for other in (None, np.nan, direction + np.pi / 4, direction + np.pi / 2):
        assert residuals(other) > 1e-3


def test_the_density_of_many_points_is_that_of_each_alone():
    """The direction is the press' own, whatever number of points is asked about."""
    surrogate, direction_rad = random_surrogate(), np.array([0.7])
    row = surrogate.rows(TRUTH[None], direction_rad)[0]
    posterior = PressPosterior(row, surrogate, NOISE, direction_rad=direction_rad)
    points = TRUTH + np.random.default_rng(3).uniform(-0.1, 0.1, (5, len(TRUTH)))
    each = [posterior.log_density(point[None])[0] for point in points]
    np.testing.assert_allclose(posterior.log_density(points), each, rtol=1e-5)


def test_single_precision_moves_a_density_by_far_less_than_a_press_tells(ramp_model):
    surrogate, direction_rad = ramp_model.answers.surrogate, np.array([0.7])
    row = surrogate.rows(TRUTH[None], direction_rad)[0]
    posterior = PressPosterior(row, surrogate, ramp_model.answers.noise, direction_rad=direction_rad)
    points = TRUTH + np.random.default_rng(3).uniform(-0.05, 0.05, (400, len(TRUTH)))
    exactly = np.log1p(points[:, -1]) - 0.5 * np.sum(posterior.residuals(points) ** 2, axis=1)
    likely = exactly > exactly.max() - 20
    assert posterior.residuals(points.astype(np.float32)).dtype == np.float32
    assert likely.sum() > 50
    np.testing.assert_allclose(posterior.log_density(points)[likely], exactly[likely], atol=0.02)
