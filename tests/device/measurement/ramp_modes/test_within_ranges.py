"""Samples of a Gaussian that ranges cut off: against the density they are said to have, and against it on paper."""

import numpy as np
import pytest

from device.measurement.ramp_modes.within_ranges import SCALE, draw_within, log_density_within

COUNT = 100_000
CORRELATED = np.array([[0.2, 0.15, 0.1], [0.15, 0.3, -0.1], [0.1, -0.1, 0.4]])


def alike(middle, factor, count=COUNT):
    """The same Gaussian for so many samples."""
    middle = np.asarray(middle, np.float64)
    return np.tile(middle, (count, 1)), np.broadcast_to(factor, (count, *np.shape(factor)))


@pytest.mark.parametrize("middle", [[0.0, 0.0, 0.0], [0.5, -0.8, 0.2], [1.6, -0.3, -1.2]])
def test_samples_have_the_density_they_are_said_to_have(middle):
    """Its integral over the ranges is 1, and its moments are those of samples."""
    factor, rng = np.linalg.cholesky(CORRELATED), np.random.default_rng(1)
    samples = draw_within(*alike(middle, factor), rng)
    assert np.abs(samples).max() <= 1
    even = rng.uniform(-1, 1, samples.shape)
    density = 8 * np.exp(log_density_within(even, *alike(middle, np.linalg.inv(factor))))
    error = density.std() / np.sqrt(COUNT)
    assert density.mean() == pytest.approx(1.0, abs=5 * error)
    np.testing.assert_allclose(density @ even / COUNT, samples.mean(axis=0), atol=6 * error)
    np.testing.assert_allclose((even * density[:, None]).T @ even / COUNT, samples.T @ samples / COUNT, atol=6 * error)


def test_far_inside_the_ranges_a_sample_is_logistic_about_its_middle():
    factor = np.linalg.cholesky(1e-3 * CORRELATED)
    samples = draw_within(*alike([0.1, -0.2, 0.0], factor), np.random.default_rng(1))
    wider = np.pi / np.sqrt(3) * SCALE
    np.testing.assert_allclose(samples.mean(axis=0), [0.1, -0.2, 0.0], atol=5e-4)
    np.testing.assert_allclose(np.cov(samples.T), 1e-3 * wider**2 * CORRELATED, rtol=0.05)


@pytest.mark.parametrize(("middle", "spread"), [(5.0, 0.1), (30.0, 0.03), (-400.0, 0.01), (1e5, 0.1)])
def test_far_outside_a_sample_lies_at_the_nearer_end_as_an_exponential_does(middle, spread):
    samples, scale = draw_within(*alike([middle], [[spread]]), np.random.default_rng(1))[:, 0], SCALE * spread
    assert np.mean(1 - np.sign(middle) * samples) == pytest.approx(scale, rel=0.02)
    from_end = np.array([0.0, 3.0, 20.0]) * scale
    log = log_density_within((np.sign(middle) * (1 - from_end))[:, None], *alike([middle], [[1 / spread]], 3))
    np.testing.assert_allclose(log, -from_end / scale - np.log(scale), atol=1e-6)
