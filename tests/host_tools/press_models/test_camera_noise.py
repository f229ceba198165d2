"""Covariances from few recordings, shrunk: variances stay, correlations are those of the paper formula."""

import numpy as np
import pytest

from device.measurement.parameters import NOMINAL
from device.measurement.ramp_modes.noise import light_ratio
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models import camera_noise as module
from host_tools.press_models.camera_noise import camera_noise, shrinkage, shrunk_covariance
from host_tools.press_models.press_samples import exact_presses
from host_tools.press_models.recorded_presses import RecordedPresses


def test_mean_squares_stay_and_correlations_shrink():
    """Two columns of correlation 0.6: their mean product is that times less than 1, their mean squares are as drawn."""
    errors = np.random.default_rng(3).multivariate_normal([0, 0], [[4.0, 1.2], [1.2, 1.0]], 50)
    sample, found = errors.T @ errors / 50, shrunk_covariance(errors)
    np.testing.assert_allclose(np.diag(found), np.diag(sample))
    assert 0.7 < found[0, 1] / sample[0, 1] < 1.0


def test_correlations_that_are_chance_vanish_and_those_that_are_not_stay():
    """Independent columns shrink nearly all the way; a common error of many recordings hardly."""
    rng = np.random.default_rng(4)
    chance = rng.standard_normal((40, 30))
    common = rng.standard_normal((4000, 1)) + 0.1 * rng.standard_normal((4000, 30))
    assert intensity(chance) > 0.8
    assert intensity(common) < 0.01


def intensity(errors: np.ndarray) -> float:
    standard = errors / np.sqrt(np.mean(errors**2, axis=0))
    return shrinkage(standard, standard.T @ standard / len(errors))


def test_a_common_error_counts_as_noise_and_is_not_taken_out_as_a_mean():
    np.testing.assert_allclose(np.diag(shrunk_covariance(np.full((7, 2), 0.3))), 0.09)


def test_fewer_recordings_than_columns_still_leave_a_covariance_that_can_be_inverted():
    errors = np.random.default_rng(1).normal(0, 1, (20, 80))
    assert np.linalg.matrix_rank(errors.T @ errors) == 20
    assert np.linalg.eigvalsh(shrunk_covariance(errors)).min() > 0.1


def test_the_covariances_are_those_of_what_is_recorded_about_the_exact_values(tables, monkeypatch):
    """Recordings that are the exact rows and second harmonics plus known errors, as large as the light, give back the
    errors' covariance; those of second harmonics along and across the offset count as twice as many."""
    aside = (NOMINAL | {"offset_mm": 1.5}).values()
    drawn = np.array([[12.0, 6.0, 60.0, *aside], [9.0, 5.0, 120.0, *aside]])
    exact, along = exact_presses(tables, drawn)
    rng, forces = np.random.default_rng(2), len(PROFILE_FORCES_N)
    errors = rng.normal(0, 1e-3, exact.shape)
    of_second = rng.normal(0, 1e-3, (2, 2, forces, RINGS - 2))
    light = 1 + exact[:, : forces * RINGS].reshape(2, 1, forces, RINGS)[..., 1:-1]
    second = light * of_second
    second[:, 0] += along.reshape(2, forces, RINGS - 2)
    asked = {}

    def record(tables, parameters, mode, *, seed, jobs):
        asked.update(mode=mode, seed=seed, jobs=jobs)
        return RecordedPresses(parameters, exact + light_ratio(exact) * errors, second)

    monkeypatch.setattr(module, "draw_parameters", lambda count, rng: drawn[:count])
    monkeypatch.setattr(module, "record_presses", record)
    found = camera_noise(tables, "precise", 2, seed=9, jobs=1)
    assert asked == {"mode": "precise", "seed": 9, "jobs": 1}
    np.testing.assert_allclose(found.rows, shrunk_covariance(errors), atol=1e-12)
    assert np.diag(found.rows) == pytest.approx(np.mean(errors**2, axis=0))
    np.testing.assert_allclose(found.second_harmonics, shrunk_covariance(of_second.reshape(4, -1)), atol=1e-12)
    assert np.diag(found.second_harmonics) == pytest.approx(np.mean(of_second**2, axis=(0, 1)).ravel())
