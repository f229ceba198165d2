"""Presses that several inclusions explain, each in a hollow of its own: told from all that count."""

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS
from device.measurement.parameters import EVEN_STD
from device.measurement.ramp_modes import posterior as sampled
from device.measurement.ramp_modes.fit import PressPosterior, best_fit
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET, SIZE
from host_tools.press_models.noisy_presses import random_scan

PRESSES = {
    251: (-0.775, 0.284, 0.358, -0.737, 0.142, -0.94, -0.453, -0.144, 0.942),
    362: (-0.623, 0.972, 0.141, -1.0, 0.597, -0.748, -0.629, 0.945, 0.227),
    667: (-0.85, 0.875, 0.378, -0.749, 0.574, -0.444, -0.189, -0.354, 0.739),
    1569: (0.981, -0.145, -0.177, 0.035, 0.719, 0.135, -0.328, 0.592, 0.992),
    2957: (-0.574, -0.322, 0.585, -0.886, -0.078, 0.83, -0.955, 0.798, 0.227),
}
"""Parameters by `normalise`, with a seed of their noise. One fit ended 11 to 31 in half the squared residuals away."""

WITH_TWO = (0.07, -0.202, -0.898, -0.278, -0.503, -0.668, -0.322, -0.331, 0.788)
"""Parameters of presses of which some have two hollows in one cell of the modulus, by their noise."""


@pytest.fixture(scope="module")
def model():
    return read_ramp_model(MODELS / "standard")


@pytest.mark.parametrize("number", PRESSES)
def test_no_fit_that_is_begun_at_the_truth_explains_a_press_better(model, number):
    at, noise = np.array(PRESSES[number]), np.random.default_rng([12, number])
    rows, direction_rad = random_scan(model.answers.surrogate, model.answers.noise, at, at[[OFFSET]] + 1, noise)
    told = model.answer(rows, direction_rad)
    posterior = PressPosterior(rows, model.answers.surrogate, model.answers.noise, direction_rad=direction_rad)
    of_truth = best_fit(posterior, np.clip(at, -0.95, 0.95))
    both = np.array([told.fit.best, of_truth])
    left = np.sum(posterior.residuals(both) ** 2, axis=1) + np.sum(both**2, axis=1) / EVEN_STD**2
    assert left[0] < left[1] + 0.01
    assert np.abs((told.mean - at[: MODULUS + 1]) / told.spread).max() < 3


@pytest.mark.parametrize("number", [36, 86, 255])
def test_a_press_with_two_hollows_is_told_with_the_spread_of_both(model, monkeypatch, number):
    """Samples of the deeper one alone would say half of it or less, and 400 of them look like enough."""
    at, noise = np.array(WITH_TWO), np.random.default_rng([12, number])
    rows, direction_rad = random_scan(model.answers.surrogate, model.answers.noise, at, at[[OFFSET]] + 1, noise)
    told = model.answer(rows, direction_rad).fit
    monkeypatch.setattr(sampled, "SAMPLES", 8000)
    monkeypatch.setattr(sampled, "ENOUGH_EFFECTIVE", 3000.0)
    monkeypatch.setattr(sampled, "SPOT_SAMPLES", 1000)
    many = model.answer(rows, direction_rad).fit
    assert many.effective_samples > 5 * told.effective_samples
    np.testing.assert_allclose(told.spread[:MODULUS], many.spread[:MODULUS], rtol=0.2)
    np.testing.assert_allclose(told.mean[:MODULUS], many.mean[:MODULUS], atol=0.2 * many.spread[SIZE])
