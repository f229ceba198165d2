"""How far a second harmonic is from a round inclusion's: rows whose contrast is known on paper."""

import numpy as np
import pytest
from small_surrogate import COLUMNS, EXACT, white_noise

from device.measurement.ramp_modes.ellipticity import (
    SECOND_COLUMNS,
    elongation_deviations,
    second_covariance,
    stretched,
)
from device.measurement.ramp_modes.noise import LOADS, ErrorLevels, PressNoise, smooth_ring_errors
from device.measurement.ramp_modes.radial_profile import SECOND
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RINGS, ring_weights

STD = 1e-3
PEAKS = np.array([0.5, 0.4, 0.3, 0.2])
CONTRAST = PEAKS[:, None] * np.exp(-(RING_RADII_MM**2) / (2 * 3.0**2))
"""Gaussian spots of 3 mm, one of each load."""
LIGHT = (1 + CONTRAST)[:, 1:-1].ravel()
NOISE = white_noise(STD)
OF_ROUND = np.random.default_rng(2).normal(0.0, 0.2, SECOND_COLUMNS)
"""Second harmonics [Q] of a round inclusion: that of the fit may be any."""


def round_row() -> np.ndarray:
    """Return the row [P] of a best fit, of `CONTRAST` and `OF_ROUND`."""
    row = np.zeros(COLUMNS)
    row[:CONTRAST_COLUMNS], row[SECOND] = CONTRAST.ravel(), OF_ROUND
    return row


ROUND = round_row()


def read(along: np.ndarray, across: np.ndarray | float = 0.0) -> np.ndarray:
    """Return second harmonics as a profile holds them, [2, K, J - 2], of [Q] along and across."""
    return np.stack([along, np.broadcast_to(across, along.shape)]).reshape(2, LOADS, RINGS - 2)


def test_a_parabola_is_stretched_by_twice_what_it_falls():
    """f = p - q r^2 has r df/dr = -2 q r^2, and central differences are exact on it."""
    q = np.array([0.001, 0.002, 0.003, 0.004])[:, None]
    found = stretched(0.3 - q * RING_RADII_MM**2).reshape(LOADS, RINGS - 2)
    np.testing.assert_allclose(found, -2 * q * RING_RADII_MM[1:-1] ** 2, rtol=1e-12)


@pytest.mark.parametrize("sigma_mm", [4.0, 6.0])
def test_a_gaussian_is_stretched_by_its_own_slope(sigma_mm):
    """r df/dr = -r^2 / s^2 f. A central difference adds h^2 / 6 f''' to it, to first order, and
    f''' = (3 - r^2 / s^2) / s^2 times -df/dr: at most h^2 / 2 s^2 of it where r^2 < 6 s^2, as at all these rings."""
    gaussian = 0.3 * np.exp(-(RING_RADII_MM**2) / (2 * sigma_mm**2))
    exact = (-(RING_RADII_MM**2) / sigma_mm**2 * gaussian)[1:-1]
    found = stretched(np.tile(gaussian, (LOADS, 1))).reshape(LOADS, RINGS - 2)
    bound = RING_MM**2 / (2 * sigma_mm**2)
    np.testing.assert_allclose(found, np.tile(exact, (LOADS, 1)), rtol=bound)


def test_a_flat_contrast_has_nothing_to_stretch():
    np.testing.assert_allclose(stretched(np.full((LOADS, RINGS), 0.3)), 0.0, atol=1e-14)


@pytest.mark.parametrize("longer", [-0.02, 0.01, 0.02])
def test_an_elliptical_spot_read_on_rings_has_the_second_harmonic_that_is_searched_for(longer):
    """Half axes s (1 + e) and s (1 - e): f(r (1 - e cos 2 angle)) = f - e r df/dr cos(2 angle), to first order in e.

    Rings 0.9 mm wide blur the spot of 4 mm by some h^2 / 2 s^2, 3 %; the next order is e r^2 / s^2 at most 0.1.
    """
    scale, shape = PixelScale(0.08, 0.08), (264, 264)
    x, y = scale.coordinates_mm(shape)
    image = 0.3 * np.exp(-((x / (1 + longer)) ** 2 + (y / (1 - longer)) ** 2) / (2 * 4.0**2))
    rings = ring_weights(shape, scale).means(image.astype(np.float32), np.ones(shape, bool))
    searched = -longer * stretched(np.tile(rings.mean, (LOADS, 1))).reshape(LOADS, RINGS - 2)[0]
    np.testing.assert_allclose(rings.cosine[1, 1:-1], searched, atol=0.05 * np.abs(searched).max())


def test_a_spot_with_exactly_the_second_harmonic_of_a_round_inclusion_is_round():
    assert np.abs(OF_ROUND).max() > 10 * STD
    assert elongation_deviations(read(OF_ROUND), ROUND, NOISE) == 0.0


@pytest.mark.parametrize("direction", [0.0, np.pi / 2, 0.4, -2.0])
@pytest.mark.parametrize("stretch", [0.02, -0.05])
def test_a_stretched_spot_is_as_many_deviations_away_whatever_the_direction(stretch, direction):
    """White noise as large as the light: p^T C^-1 p is the sum of (p / light)^2 over the variance."""
    pattern = stretched(CONTRAST)
    along, across = stretch * np.cos(direction) * pattern, stretch * np.sin(direction) * pattern
    found = elongation_deviations(read(OF_ROUND + along, across), ROUND, NOISE)
    assert found == pytest.approx(abs(stretch) * np.linalg.norm(pattern / LIGHT) / STD, rel=1e-9)


def test_half_the_noise_tells_twice_as_many_deviations():
    oblong = read(OF_ROUND + 0.02 * stretched(CONTRAST))
    whole, half = (elongation_deviations(oblong, ROUND, white_noise(std)) for std in (STD, STD / 2))
    assert half == pytest.approx(2 * whole, rel=1e-9)


def test_the_covariance_is_that_of_repeated_recordings_as_large_as_the_light():
    found = second_covariance(ROUND, NOISE)
    np.testing.assert_allclose(found, np.diag(LIGHT**2) * STD**2, rtol=1e-9)


def test_smooth_errors_add_to_the_covariance():
    """The flat field's is one of all loads, the model's is each one's own."""
    levels = ErrorLevels()
    flat, model = (part[1:-1, 1:-1] for part in smooth_ring_errors(levels, harmonic=2))
    errors = np.kron(np.ones((LOADS, LOADS)), flat) + np.kron(np.eye(LOADS), model)
    found = second_covariance(ROUND, white_noise(STD, levels))
    np.testing.assert_allclose(found, np.outer(LIGHT, LIGHT) * (errors + STD**2 * np.eye(SECOND_COLUMNS)), rtol=1e-9)


def test_only_the_second_harmonics_noise_counts():
    oblong = read(OF_ROUND + 0.02 * stretched(CONTRAST))
    camera = STD**2 * np.eye(COLUMNS)
    camera[: SECOND.start, : SECOND.start] *= 100
    louder = PressNoise(camera, EXACT)
    found, expected = (elongation_deviations(oblong, ROUND, noise) for noise in (louder, NOISE))
    assert found == pytest.approx(expected, rel=1e-12)


def test_what_is_no_stretch_counts_nothing():
    """A second harmonic at right angles to the pattern, over the variance, however large."""
    pattern = stretched(CONTRAST) / LIGHT
    other = np.random.default_rng(4).normal(size=SECOND_COLUMNS)
    other -= pattern * (pattern @ other) / (pattern @ pattern)
    found = elongation_deviations(read(OF_ROUND + LIGHT * other, LIGHT * other), ROUND, NOISE)
    assert found == pytest.approx(0.0, abs=1e-9 * np.linalg.norm(other) / STD)


def test_the_harmonics_that_are_asked_about_stay_as_they_are():
    asked = read(OF_ROUND + 0.01)
    before = asked.copy()
    elongation_deviations(asked, ROUND, NOISE)
    np.testing.assert_array_equal(asked, before)


def test_deviations_of_round_inclusions_are_rayleighs():
    """Camera noise, a flat field common to all loads and an error of each load, all as large as the light.

    Half of them lie below sqrt(2 ln 2), one in twenty above sqrt(2 ln 20); counts of 4000 within three standard errors.
    """
    count, rng, levels = 4000, np.random.default_rng(5), ErrorLevels()
    flat, model = (part[1:-1, 1:-1] for part in smooth_ring_errors(levels, harmonic=2))
    none, parts = np.zeros(RINGS - 2), (count, 2)
    common = rng.multivariate_normal(none, flat, (*parts, 1), method="cholesky")
    own = rng.multivariate_normal(none, model, (*parts, LOADS), method="cholesky")
    errors = (1 + CONTRAST)[:, 1:-1] * (common + own + rng.normal(0, STD, (*parts, LOADS, RINGS - 2)))
    round_one, noise = read(OF_ROUND), white_noise(STD, levels)
    found = np.array([elongation_deviations(round_one + one, ROUND, noise) for one in errors])
    for share in (0.5, 0.05):
        error = np.sqrt(share * (1 - share) / count)
        assert np.mean(found > np.sqrt(-2 * np.log(share))) == pytest.approx(share, abs=3 * error)
