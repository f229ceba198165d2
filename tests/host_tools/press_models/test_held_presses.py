"""Held presses from ramps: the cubic through the profile's forces, and noise that is as the model of it says."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, random_surrogate, white_noise

from device.measurement.quick_mode.profile import QUICK_FORCES_N
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models.noisy_presses import random_press_set
from host_tools.press_models.quick_training import QuickPressSet, quick_press_set, quick_rows

DRAWS = 40_000


def test_a_contrast_that_is_a_cubic_of_the_force_is_read_exactly():
    cubic = np.polynomial.Polynomial([0.1, -0.4, 2.0, 1.5])
    row = np.zeros(COLUMNS)
    row[:CONTRAST_COLUMNS] = np.repeat(cubic(PROFILE_FORCES_N), RINGS)
    force_n = np.array([0.46, 0.5, 0.55])
    found = quick_rows(np.tile(row, (3, 1)), force_n)
    np.testing.assert_allclose(found[:, :RINGS], np.repeat(cubic(force_n), RINGS).reshape(3, RINGS), rtol=1e-12)
    np.testing.assert_array_equal(found[:, RINGS], force_n)


def test_every_press_is_held_within_the_forces():
    press_set = quick_press_set(random_press_set(random_surrogate(), white_noise(1e-3), 500, 1), np.eye(RINGS), seed=2)
    assert press_set.rows[:, RINGS].min() >= np.float32(QUICK_FORCES_N[0])
    assert press_set.rows[:, RINGS].max() <= np.float32(QUICK_FORCES_N[1])
    assert np.ptp(press_set.rows[:, RINGS]) > 0.9 * np.ptp(QUICK_FORCES_N)


@pytest.mark.parametrize("levels", [ErrorLevels(), ErrorLevels(gain_ratio=0.0), ErrorLevels(model_ratio=0.0)])
def test_the_noise_of_a_row_without_an_inclusion_is_the_typical_one(levels):
    row = np.append(np.zeros(RINGS), 0.5).astype(np.float32)
    press_set = QuickPressSet(np.zeros((1, 9), np.float32), row[None], 1e-6 * np.eye(RINGS), levels)
    drawn = press_set.noisy(np.zeros(DRAWS, int), np.random.default_rng(3)).astype(float) - row
    expected = press_set.typical_noise()[:RINGS, :RINGS]
    std = np.sqrt(np.diag(expected))
    strayed = (np.cov(drawn[:, :RINGS].T) - expected) / np.outer(std, std)
    assert np.abs(strayed).max() < 6 * np.sqrt(2 / DRAWS)
    assert drawn[:, RINGS].std() == pytest.approx(levels.zero_n, rel=0.03)


def test_a_cell_that_reads_too_much_makes_the_contrast_smaller():
    zero_only = ErrorLevels(gain_ratio=0.0, zero_n=0.01, flat_field_ratio=0.0, model_ratio=0.0)
    row = np.append(np.full(RINGS, 0.2), 0.5).astype(np.float32)
    press_set = QuickPressSet(np.zeros((1, 9), np.float32), row[None], 1e-12 * np.eye(RINGS), zero_only)
    drawn = press_set.noisy(np.zeros(2000, int), np.random.default_rng(4)).astype(float) - row
    assert np.corrcoef(drawn[:, 0], drawn[:, RINGS])[0, 1] < -0.99
