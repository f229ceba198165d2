"""Presses on small inclusions, whose fits in far cells of the modulus take many steps: told no surer than they are."""

import numpy as np
import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS
from device.measurement.ramp_modes import posterior
from device.measurement.ramp_modes.surrogate import MODULUS, OFFSET
from host_tools.press_models.noisy_presses import random_scan

PRESSES = {
    146: (-0.29, 0.421, 0.938, 0.777, 0.436, -0.913, 0.049, -0.023, -0.386),
    998: (-0.633, -0.347, 0.849, 0.578, -0.048, 0.395, -0.71, -0.323, 0.678),
    562: (-0.43, 0.886, 0.06, 0.375, -0.428, 0.02, -0.563, -0.563, 0.786),
}
"""Parameters by `normalise`, with a seed of their noise: the modulus was once told with a third to half its spread."""


@pytest.fixture(scope="module")
def model():
    return read_ramp_model(MODELS / "standard")


@pytest.mark.parametrize("number", PRESSES)
def test_the_spread_of_the_modulus_is_that_of_many_more_samples(model, monkeypatch, number):
    at, noise = np.array(PRESSES[number]), np.random.default_rng([11, number])
    rows, direction_rad = random_scan(model.answers.surrogate, model.answers.noise, at, at[[OFFSET]] + 1, noise)
    told = model.answer(rows, direction_rad).fit
    monkeypatch.setattr(posterior, "SAMPLES", 8000)
    monkeypatch.setattr(posterior, "ENOUGH_EFFECTIVE", 3000.0)
    monkeypatch.setattr(posterior, "SPOT_SAMPLES", 1000)
    many = model.answer(rows, direction_rad).fit
    assert many.effective_samples > 5 * told.effective_samples
    assert told.spread[MODULUS] == pytest.approx(many.spread[MODULUS], rel=0.1)
    assert told.mean[MODULUS] == pytest.approx(many.mean[MODULUS], abs=0.15 * many.spread[MODULUS])
