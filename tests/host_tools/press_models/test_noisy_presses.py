"""Noise that is drawn is distributed as the noise model that the precise mode believes in."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, random_surrogate, white_noise

from device.measurement.parameters import denormalise
from device.measurement.ramp_modes.noise import ErrorLevels, PressNoise
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, RESPONSE_COLUMNS
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models import noisy_presses
from host_tools.press_models.noisy_presses import NoiseSampler, random_press_set

CAMERA = np.random.default_rng(1).normal(0, 2e-4, (COLUMNS, COLUMNS))
NOISE = PressNoise(CAMERA @ CAMERA.T + 1e-6 * np.eye(COLUMNS))
DRAWS = 40_000


@pytest.fixture
def row() -> np.ndarray:
    row = np.zeros(COLUMNS)
    row[:CONTRAST_COLUMNS] = 0.3
    row[CONTRAST_COLUMNS : CONTRAST_COLUMNS + RESPONSE_COLUMNS] = np.repeat([-1.2, -0.7, -0.3], RINGS)
    return row


@pytest.mark.parametrize(
    "levels",
    [
        ErrorLevels(),
        ErrorLevels(gain_ratio=0.0, zero_n=0.0),
        ErrorLevels(zero_n=0.0, flat_field_ratio=0.0, model_ratio=0.0),
        ErrorLevels(gain_ratio=0.0, flat_field_ratio=0.0, model_ratio=0.0),
    ],
    ids=["all", "smooth errors", "gain", "zero"],
)
def test_the_noise_has_the_covariance_of_the_noise_model(row, levels):
    """A sample covariance of n draws strays by sqrt((1 + correlation^2) / n) of the standard deviations' product."""
    noise = PressNoise(NOISE.camera, levels)
    drawn = NoiseSampler(noise).add(np.tile(row, (DRAWS, 1)).astype(np.float32), np.random.default_rng(2)) - row
    expected = noise.covariance(row)
    std = np.sqrt(np.diag(expected))
    strayed = (np.cov(drawn.T) - expected) / np.outer(std, std)
    assert np.abs(strayed).max() < 6 * np.sqrt(2 / DRAWS)
    assert np.abs(drawn.mean(axis=0) / std).max() < 5 / np.sqrt(DRAWS)


def test_brighter_rows_are_noisier_as_a_ratio_of_their_light():
    gain = white_noise(1e-6, ErrorLevels(gain_ratio=0.01, zero_n=0.0, flat_field_ratio=0.0, model_ratio=0.0))
    dark, bright = np.zeros((1, COLUMNS), np.float32), np.full((1, COLUMNS), 0.5, np.float32)
    added = [NoiseSampler(gain).add(rows, np.random.default_rng(3)) - rows for rows in (dark, bright)]
    np.testing.assert_allclose(added[1][:, :CONTRAST_COLUMNS], 1.5 * added[0][:, :CONTRAST_COLUMNS], atol=1e-5)


def test_the_same_seed_gives_the_same_rows_and_another_one_others():
    first, again, other = (random_press_set(random_surrogate(), NOISE, 20, seed) for seed in (4, 4, 5))
    np.testing.assert_array_equal(first.rows, again.rows)
    assert (first.rows != other.rows).any(axis=1).all()
    index = np.arange(20)
    once, twice, fresh = (first.noisy(index, np.random.default_rng(seed)) for seed in (6, 6, 7))
    np.testing.assert_array_equal(once, twice)
    assert (once != fresh).any(axis=1).all()


def test_a_press_set_is_the_surrogates_rows_also_across_blocks(monkeypatch):
    monkeypatch.setattr(noisy_presses, "BLOCK", 7)
    surrogate = random_surrogate()
    press_set = random_press_set(surrogate, NOISE, 20, seed=4)
    rows = surrogate.rows(press_set.normalised.astype(np.float64))
    np.testing.assert_allclose(press_set.rows, rows, atol=1e-5 * np.abs(rows).max())
    assert press_set.rows.dtype == press_set.normalised.dtype == np.float32
    assert (denormalise(press_set.normalised.astype(np.float64))[:, 0] > 2.0 - 1e-5).all()
