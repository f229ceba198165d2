"""Covariances from few recordings, shrunk: variances stay, chance goes, and what is alike in all columns is kept."""

import numpy as np
import pytest

from device.measurement.parameters import HIGH, NOMINAL
from device.measurement.ramp_modes.noise import light_ratio
from device.measurement.ramp_modes.radial_profile import SeenPresses
from device.measurement.ramp_modes.surrogate import OFFSET
from host_tools.press_models import camera_noise as module
from host_tools.press_models.camera_noise import camera_noise, recorded_errors, shrinkage, shrunk_covariance
from host_tools.press_models.press_samples import profile_rows
from host_tools.press_models.recorded_presses import RecordedPresses, direction_of_press_rad
from host_tools.press_models.seeds import press_seed


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
    return shrinkage(errors / np.sqrt(np.mean(errors**2, axis=0)))


def test_what_columns_tell_beside_a_strong_common_error_is_kept():
    """Columns that share an error of 1 and have 0.03 of their own: the least variance is that of their own."""
    rng = np.random.default_rng(5)
    errors = rng.standard_normal((600, 1)) + 0.03 * rng.standard_normal((600, 40))
    least = np.linalg.eigvalsh(shrunk_covariance(errors))[:39]
    assert np.median(least) == pytest.approx(0.03**2, rel=0.3)


def test_a_common_error_counts_as_noise_and_is_not_taken_out_as_a_mean():
    np.testing.assert_allclose(np.diag(shrunk_covariance(np.full((7, 2), 0.3))), 0.09)


def test_fewer_recordings_than_columns_still_leave_a_covariance_that_can_be_inverted():
    errors = np.random.default_rng(1).normal(0, 1, (20, 80))
    assert np.linalg.matrix_rank(errors.T @ errors) == 20
    assert np.linalg.eigvalsh(shrunk_covariance(errors)).min() > 0.1


def test_errors_are_those_of_what_is_recorded_about_the_exact_rows(tables, monkeypatch):
    """Recordings that are the exact rows plus known errors, as large as the light, give back the errors.

    Exact rows are those of the direction in which each recording was pressed: it is told by the seed, as there.
    """
    aside = (NOMINAL | {"offset_mm": 1.5}).values()
    drawn = np.array([[12.0, 6.0, 60.0, *aside], [9.0, 5.0, 120.0, *aside]])
    direction_rad = np.array([direction_of_press_rad(press_seed(9, number)) for number in range(2)])
    exact = profile_rows(tables, drawn, direction_rad)
    assert np.abs(exact - profile_rows(tables, drawn)).max() > 1e-4
    errors = np.random.default_rng(2).normal(0, 1e-3, exact.shape)
    asked = {}

    def record(tables, parameters, mode, *, seed, jobs):
        asked.update(mode=mode, seed=seed, jobs=jobs)
        rows = exact + light_ratio(exact) * errors
        return RecordedPresses(parameters, [SeenPresses(row[None], np.zeros(0), np.zeros(1)) for row in rows])

    monkeypatch.setattr(module, "record_presses", record)
    found = recorded_errors(tables, drawn, seed=9, jobs=1)
    assert asked == {"mode": "standard", "seed": 9, "jobs": 1}
    np.testing.assert_allclose(found, errors, atol=1e-12)


def test_the_covariance_is_that_of_presses_near_and_beside_the_inclusion_together(tables, monkeypatch):
    errors, drawn = np.random.default_rng(2).normal(0, 1e-3, (30, 5)), []

    def errors_of(tables, parameters, *, seed, jobs):
        drawn.append((parameters[:, OFFSET], seed))
        return errors[: len(parameters)] if len(drawn) == 1 else errors[-len(parameters) :]

    monkeypatch.setattr(module, "recorded_errors", errors_of)
    found = camera_noise(tables, 20, 10, seed=9, jobs=1)
    np.testing.assert_allclose(found, shrunk_covariance(errors))
    (near_mm, near_seed), (beside_mm, beside_seed) = drawn
    assert near_mm.max() <= HIGH[OFFSET] <= beside_mm.min()
    assert near_seed != beside_seed
