"""Presses of a scan share inclusion, tissue and reference press; their joint posterior, with answers known on paper."""

from itertools import pairwise

import numpy as np
import pytest
from small_surrogate import COLUMNS, EXACT, REACH_MM, LinearRows, random_scan_surrogate, white_noise

from device.measurement.parameters import HIGH, PARAMETERS
from device.measurement.ramp_modes.fit import PressPosterior, best_fits, whitening
from device.measurement.ramp_modes.noise import FURTHER, ErrorLevels, PressNoise, as_one_row
from device.measurement.ramp_modes.posterior import CELLS, sample_press
from device.measurement.ramp_modes.radial_profile import RESPONSE
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET

STD = 0.02
SHARED = np.array([0.2, -0.3, 0.1, 0.1, -0.2, 0.3, 0.0, -0.1])
PLACES = np.array([-0.6, 0.3, -0.1])
"""Coordinates of the offsets: -1 on the axis, 1 at the reach."""


@pytest.fixture(scope="module")
def linear() -> LinearRows:
    slopes = np.random.default_rng(5).normal(0.0, 0.15, (len(PARAMETERS), COLUMNS))
    slopes[MODULUS] = 0.0
    slopes[OFFSET] /= REACH_MM / HIGH[OFFSET]
    return LinearRows(slopes)


def rows_at(surrogate, places: np.ndarray = PLACES, direction_rad: np.ndarray | None = None) -> np.ndarray:
    """Return the rows [N, P] without noise of presses at places, in directions [N]."""
    each = np.column_stack([np.tile(SHARED, (len(places), 1)), REACH_MM / HIGH[OFFSET] * (places + 1) - 1])
    return surrogate.rows(each, direction_rad)


@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_truth_explains_a_scan_without_noise_wholly(linear, count):
    posterior = PressPosterior(rows_at(linear)[:count], linear, white_noise(STD), REACH_MM)
    truth = np.concatenate([SHARED, PLACES[:count]])
    assert posterior.dimensions == len(truth)
    np.testing.assert_allclose(posterior.residuals(truth), 0.0, atol=1e-9)


DIRECTIONS = np.array([0.5, -1.3, 2.2])


def with_one_reference(rows: np.ndarray) -> np.ndarray:
    """Return the rows of a scan: its random surrogates know of an offset in the reference, too."""
    rows[1:, RESPONSE] = rows[0, RESPONSE]
    return rows


def test_each_press_of_a_scan_is_explained_in_its_own_direction():
    """Without noise nothing is left with the directions in which the presses were made, and only with these."""
    surrogate, truth = random_scan_surrogate(), np.concatenate([SHARED, PLACES])
    rows = with_one_reference(rows_at(surrogate, direction_rad=DIRECTIONS))

    def left(direction_rad):
        posterior = PressPosterior(rows, surrogate, white_noise(STD), REACH_MM, direction_rad)
        return np.abs(posterior.residuals(truth)).max()

    assert left(DIRECTIONS) < 1e-9
    assert left(-DIRECTIONS + np.pi) < 1e-9  # mirrored, and from the other side
    swapped, one_unknown, one_turned = DIRECTIONS[[1, 0, 2]], DIRECTIONS.copy(), DIRECTIONS.copy()
    one_unknown[2], one_turned[1] = np.nan, DIRECTIONS[1] + np.pi / 2
    for other in (None, swapped, one_unknown, one_turned):
        assert left(other) > 1e-2


def test_many_points_are_asked_about_as_each_alone():
    """Whatever their number, every press keeps its own direction."""
    surrogate, rng = random_scan_surrogate(), np.random.default_rng(8)
    rows = with_one_reference(rows_at(surrogate, direction_rad=DIRECTIONS))
    posterior = PressPosterior(rows, surrogate, white_noise(STD), REACH_MM, DIRECTIONS)
    points = np.concatenate([SHARED, PLACES]) + rng.uniform(-0.05, 0.05, (4, OFFSET + len(PLACES)))
    residuals, jacobians = posterior.residuals_and_jacobian(points)
    np.testing.assert_allclose(posterior.residuals(points), residuals, rtol=1e-12, atol=1e-12)
    for point, residual, jacobian in zip(points, residuals, jacobians, strict=True):
        alone = posterior.residuals_and_jacobian(point[None])
        np.testing.assert_allclose(residual, alone[0][0], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(jacobian, alone[1][0], rtol=1e-9, atol=1e-9)


def test_a_press_more_leaves_what_whitens_those_before_as_it_is():
    """To the last bit: a scan's answer does not depend on how its presses were put together."""
    noise, rows = white_noise(STD, ErrorLevels()), 0.05 * np.random.default_rng(2).normal(size=(3, COLUMNS))
    ends = np.append(0, COLUMNS + len(FURTHER) * np.arange(3))
    columns = [slice(*pair) for pair in pairwise(ends)]
    covariance = noise.scan_covariance(rows)
    three, two = whitening(covariance, columns), whitening(covariance[: ends[2], : ends[2]], columns[:2])
    np.testing.assert_allclose(three @ covariance @ three.T, np.eye(ends[3]), atol=1e-9)
    np.testing.assert_array_equal(three[: ends[2], : ends[2]], two)
    np.testing.assert_array_equal(three[: ends[2], ends[2] :], 0.0)


@pytest.mark.parametrize("direction_rad", [None, DIRECTIONS], ids=["any", "told"])
def test_with_a_further_press_it_is_the_posterior_of_all_of_them(direction_rad):
    surrogate, noise = random_scan_surrogate(), white_noise(STD, ErrorLevels())
    rows = with_one_reference(rows_at(surrogate, direction_rad=direction_rad))
    before = None if direction_rad is None else direction_rad[:2]
    further = PressPosterior(rows[:2], surrogate, noise, REACH_MM, before).with_further(rows[2])
    of_all = None if direction_rad is None else np.append(before, np.nan)
    expected = PressPosterior(rows, surrogate, noise, REACH_MM, of_all)
    assert (further.presses, further.dimensions) == (3, OFFSET + 3)
    at = np.concatenate([SHARED, PLACES])[None] + 0.05
    for one, other in zip(further.residuals_and_jacobian(at), expected.residuals_and_jacobian(at), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())
    np.testing.assert_allclose(further.log_density(at), expected.log_density(at), rtol=1e-5)


def test_an_unknown_direction_of_one_press_is_the_mean_over_all_of_them_and_leaves_the_others():
    surrogate, truth = random_scan_surrogate(), np.concatenate([SHARED, PLACES])
    directions = np.array([DIRECTIONS[0], np.nan, DIRECTIONS[2]])
    rows = with_one_reference(rows_at(surrogate, direction_rad=DIRECTIONS))
    rows[1, FURTHER] = rows_at(surrogate)[1, FURTHER]
    posterior = PressPosterior(rows, surrogate, white_noise(STD), REACH_MM, directions)
    np.testing.assert_allclose(posterior.residuals(truth), 0.0, atol=1e-9)


@pytest.mark.parametrize("direction_rad", [None, DIRECTIONS], ids=["any", "told"])
def test_the_jacobian_of_a_scan_equals_central_differences(direction_rad):
    surrogate = random_scan_surrogate()
    at, step = np.concatenate([SHARED, PLACES]), 1e-6
    rows = rows_at(surrogate, direction_rad=direction_rad)
    posterior = PressPosterior(rows, surrogate, white_noise(STD), REACH_MM, direction_rad)
    away = step * np.eye(len(at))
    expected = np.array([(posterior.residuals(at + a) - posterior.residuals(at - a)) / (2 * step) for a in away]).T
    found = posterior.residuals_and_jacobian(at[None])[1][0]
    np.testing.assert_allclose(found, expected, atol=1e-6 * np.abs(expected).max())


def test_the_posterior_of_a_linear_scan_is_the_gaussian_of_linear_algebra(linear):
    """White noise that is each column's own: no press shares any of it."""
    told = np.arange(OFFSET + len(PLACES)) != MODULUS
    rows = rows_at(linear) + np.random.default_rng(6).normal(0, STD, (len(PLACES), COLUMNS))
    posterior = PressPosterior(rows, linear, white_noise(STD), REACH_MM)
    fit = sample_press(posterior, np.zeros(posterior.dimensions))
    design = posterior.residuals_and_jacobian(np.zeros((1, posterior.dimensions)))[1][0][:, told]
    covariance = np.linalg.inv(design.T @ design)
    mean = -covariance @ design.T @ posterior.residuals(np.zeros(posterior.dimensions))
    spread = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(fit.spread[told], spread, rtol=0.06)
    shared = np.arange(told.sum()) < OFFSET - 1  # the prior of the others' places leans outwards
    error = np.abs(fit.mean[told] - mean) / spread
    assert error[shared].max() < 5 / np.sqrt(fit.effective_samples)


def test_a_further_press_narrows_what_all_share(linear):
    rows = rows_at(linear) + np.random.default_rng(6).normal(0, STD, (len(PLACES), COLUMNS))
    one, three = (
        sample_press(posterior, np.zeros(posterior.dimensions)).spread[:OFFSET]
        for posterior in (PressPosterior(part, linear, white_noise(STD), REACH_MM) for part in (rows[:1], rows))
    )
    told = np.arange(OFFSET) != MODULUS
    assert (three[told] < 0.85 * one[told]).all()


def test_the_offset_reaches_as_far_as_it_is_allowed(linear):
    row = rows_at(linear, np.array([0.9]))
    for reach_mm, expected in ((REACH_MM, 0.9), (HIGH[OFFSET], 1.0)):
        posterior = PressPosterior(row, linear, white_noise(1e-3), reach_mm)
        free = np.ones(posterior.dimensions, dtype=bool)
        (best,) = best_fits(posterior, np.zeros((1, posterior.dimensions)), free, tolerance=1e-12)
        assert best[OFFSET] == pytest.approx(expected, abs=1e-3)


def test_cells_of_the_modulus_add_up_to_the_posterior(linear):
    fit = sample_press(PressPosterior(rows_at(linear), linear, white_noise(STD), REACH_MM), np.zeros(11))
    cells = fit.by_modulus
    assert cells.share.sum() == pytest.approx(1.0)
    np.testing.assert_allclose(cells.share @ cells.mean, fit.mean, atol=1e-12)
    variance = cells.share @ (cells.spread**2 + (cells.mean - fit.mean) ** 2)
    np.testing.assert_allclose(np.sqrt(variance), fit.spread, rtol=1e-9)
    np.testing.assert_allclose(np.diff(cells.mean[:, MODULUS]), 2 / CELLS, atol=0.05)


def test_a_scans_errors_are_its_presses_own_but_for_what_they_share():
    """Two presses, rows 0: contrasts differ by the camera and by the own parts of both smooth errors alone."""
    drifts = {"gain_ratio": 0.0, "zero_n": 0.0}
    shared = {"flat_field_shared_ratio": 0.6, "model_shared_ratio": 0.25, "reference_ratio": 0.2}
    levels = ErrorLevels(**drifts, **shared)
    noise = white_noise(1e-4, levels)
    covariance = noise.scan_covariance(np.zeros((2, COLUMNS)))
    size = COLUMNS + len(FURTHER)
    assert covariance.shape == (size, size)
    assert np.linalg.eigvalsh(covariance).min() > 0
    np.testing.assert_allclose(covariance[:COLUMNS, :COLUMNS], noise.covariance(np.zeros(COLUMNS)), rtol=1e-12)
    difference = np.zeros((len(FURTHER), size))
    difference[np.arange(len(FURTHER)), FURTHER] = 1
    difference[np.arange(len(FURTHER)), COLUMNS + np.arange(len(FURTHER))] = -1
    left = (difference @ covariance @ difference.T)[0, 0]
    flat, model = (
        white_noise(0.0, ErrorLevels(**drifts, **{without: 0.0})).covariance(np.zeros(COLUMNS))[0, 0]
        for without in ("model_ratio", "flat_field_ratio")
    )
    assert left == pytest.approx(2 * (0.8e-8 + 0.4 * flat + 0.75 * model), rel=1e-9)


def test_what_the_reference_press_makes_of_the_cameras_noise_is_shared():
    """Noise of the reference, common to response and contrasts, and as much of each press."""
    rng = np.random.default_rng(1)
    reference = rng.normal(size=(COLUMNS, 40))
    response = np.setdiff1d(np.arange(COLUMNS), FURTHER)
    of_press = np.zeros((COLUMNS, COLUMNS))
    of_press[np.ix_(FURTHER, FURTHER)] = np.eye(len(FURTHER))
    noise = PressNoise(reference @ reference.T + of_press + 1e-9 * np.eye(COLUMNS), EXACT)
    covariance = noise.scan_covariance(np.zeros((3, COLUMNS)))
    assert np.linalg.eigvalsh(covariance).min() > 0
    second = COLUMNS + np.arange(len(FURTHER))
    np.testing.assert_allclose(covariance[np.ix_(response, second)], noise.camera[np.ix_(response, FURTHER)])
    third = second + len(FURTHER)
    told = noise.camera[np.ix_(FURTHER, response)] @ np.linalg.solve(
        noise.camera[np.ix_(response, response)], noise.camera[np.ix_(response, FURTHER)]
    )
    np.testing.assert_allclose(covariance[np.ix_(second, third)], told, rtol=1e-6)


def test_one_row_of_a_scan_has_one_reference():
    rows = np.arange(3 * COLUMNS, dtype=float).reshape(3, COLUMNS)
    joined = as_one_row(rows)
    np.testing.assert_array_equal(joined[:COLUMNS], rows[0])
    np.testing.assert_array_equal(joined[COLUMNS:], rows[1:, FURTHER].ravel())


@pytest.mark.parametrize("count", [1, 3])
def test_points_that_all_lie_outside_have_no_density_and_are_no_mistake(linear, count):
    posterior = PressPosterior(rows_at(linear)[:count], linear, white_noise(STD), REACH_MM)
    outside = np.full((4, posterior.dimensions), 1.5)
    np.testing.assert_array_equal(posterior.log_density(outside), -np.inf)
    assert posterior.residuals(outside[:0]).shape == (0, COLUMNS + (count - 1) * len(FURTHER))
