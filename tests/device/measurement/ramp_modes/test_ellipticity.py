"""How far a second harmonic is from a round inclusion's: surrogates of one term, whose contrast is known on paper."""

import numpy as np
import pytest
from small_surrogate import EXACT, INCLUSION_COLUMNS, RESPONSE_COLUMNS

from device.files.bundle_file import read_ellipticity_test
from device.measurement.parameters import HIGH, PARAMETERS, denormalise
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.ellipticity import (
    COEFFICIENTS,
    DEGREES,
    SECOND_COLUMNS,
    EllipticityTest,
    second_factor,
    stretched,
)
from device.measurement.ramp_modes.legendre import LegendreSum
from device.measurement.ramp_modes.noise import LOADS, ErrorLevels, smooth_ring_errors
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET, PressSurrogate, far_field_strength
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RINGS, ring_weights

STD = 1e-3
MODES = ("standard", "precise")
BEST = np.random.default_rng(1).uniform(-0.9, 0.9, len(PARAMETERS))
PEAKS = np.array([0.5, 0.4, 0.3, 0.2])
CONTRAST = PEAKS[:, None] * np.exp(-(RING_RADII_MM**2) / (2 * 3.0**2))
"""Gaussian spots of 3 mm, one of each load."""
LIGHT = (1 + CONTRAST)[:, 1:-1].ravel()
CONSTANT = np.zeros((1, len(PARAMETERS)), np.uint8)


def surrogate_of(contrast: np.ndarray) -> PressSurrogate:
    """Return a surrogate whose contrast [K, J] at `BEST` is the one asked for: a constant over the strength there."""
    size_mm, depth_mm = denormalise(BEST)[:2]
    coefficients = np.zeros((1, INCLUSION_COLUMNS))
    coefficients[0, :CONTRAST_COLUMNS] = contrast.ravel() / far_field_strength(size_mm, depth_mm)
    return PressSurrogate(LegendreSum(CONSTANT, coefficients), LegendreSum(CONSTANT, np.zeros((1, RESPONSE_COLUMNS))))


def spot_of(levels: ErrorLevels = EXACT, std: float = STD) -> EllipticityTest:
    """Return round spots of the same contrast and of random second harmonics; in precise a half of the noise."""
    second = LegendreSum(CONSTANT, np.random.default_rng(2).normal(0.0, 0.2, (1, SECOND_COLUMNS)))
    white = np.eye(SECOND_COLUMNS)
    camera = {"standard": std**2 * white, "precise": (std / 2) ** 2 * white}
    return EllipticityTest(surrogate_of(CONTRAST), second, camera, levels)


def read(along: np.ndarray, across: np.ndarray | float = 0.0) -> np.ndarray:
    """Return second harmonics as a profile holds them, [2, K, J - 2], of [Q] along and across."""
    return np.stack([along, np.broadcast_to(across, along.shape)]).reshape(2, LOADS, RINGS - 2)


@pytest.fixture(scope="module")
def spot() -> EllipticityTest:
    return spot_of()


@pytest.fixture(scope="module")
def of_round(spot) -> np.ndarray:
    return spot.second_harmonics(BEST[None])[0]


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


def test_second_harmonics_grow_as_the_strength_of_the_inclusion_and_the_square_of_its_offset():
    """Size over the depth of the middle, cubed: 6 mm, 9 mm deep, have (6 / 12)^3."""
    parameters = np.tile(denormalise(BEST), (4, 1))
    parameters[:, :2] = (6.0, 9.0), (6.0, 9.0), (6.0, 9.0), (12.0, 6.0)
    parameters[:, OFFSET] = HIGH[OFFSET] * np.array([1.0, 0.5, 0.0, 1.0])
    np.testing.assert_allclose(second_factor(parameters), [1 / 8, 1 / 32, 0.0, 1.0], rtol=1e-14)


def test_a_round_inclusions_second_harmonics_are_the_polynomials_times_their_factor(spot):
    normalised = np.tile(BEST, (3, 1))
    normalised[:, OFFSET] = 1.0, 0.0, -1.0
    size_mm, depth_mm = denormalise(BEST)[:2]
    factor = far_field_strength(size_mm, depth_mm) * np.array([1.0, 0.25, 0.0])
    expected = factor[:, None] * spot.second.coefficients
    np.testing.assert_allclose(spot.second_harmonics(normalised), expected, rtol=1e-12)


def test_a_spot_with_exactly_the_second_harmonic_of_a_round_inclusion_is_round(spot, of_round):
    assert np.abs(of_round).max() > 10 * STD
    assert spot.elongation_deviations(read(of_round), BEST, "standard") == 0.0
    np.testing.assert_array_equal(spot.left(read(of_round, of_round), BEST), [np.zeros(SECOND_COLUMNS), of_round])


@pytest.mark.parametrize("direction", [0.0, np.pi / 2, 0.4, -2.0])
@pytest.mark.parametrize("stretch", [0.02, -0.05])
def test_a_stretched_spot_is_as_many_deviations_away_whatever_the_direction(spot, of_round, stretch, direction):
    """White noise as large as the light: p^T C^-1 p is the sum of (p / light)^2 over the variance."""
    pattern = stretched(CONTRAST)
    along, across = stretch * np.cos(direction) * pattern, stretch * np.sin(direction) * pattern
    found = spot.elongation_deviations(read(of_round + along, across), BEST, "standard")
    assert found == pytest.approx(abs(stretch) * np.linalg.norm(pattern / LIGHT) / STD, rel=1e-9)


def test_a_quieter_mode_tells_more_deviations(spot, of_round):
    """Half the noise, twice as many."""
    oblong = read(of_round + 0.02 * stretched(CONTRAST))
    standard, precise = (spot.elongation_deviations(oblong, BEST, mode) for mode in MODES)
    assert precise == pytest.approx(2 * standard, rel=1e-9)


def test_the_covariance_is_that_of_repeated_recordings_as_large_as_the_light(spot):
    expected = np.diag(LIGHT**2) * (STD / 2) ** 2
    np.testing.assert_allclose(spot.covariance(BEST, "precise"), expected, rtol=1e-9)


def test_what_is_no_stretch_counts_nothing(spot, of_round):
    """A second harmonic at right angles to the pattern, over the variance, however large."""
    pattern = stretched(CONTRAST) / LIGHT
    other = np.random.default_rng(4).normal(size=SECOND_COLUMNS)
    other -= pattern * (pattern @ other) / (pattern @ pattern)
    found = spot.elongation_deviations(read(of_round + LIGHT * other, LIGHT * other), BEST, "standard")
    assert found == pytest.approx(0.0, abs=1e-9 * np.linalg.norm(other) / STD)


def test_the_harmonics_that_are_asked_about_stay_as_they_are(spot, of_round):
    asked = read(of_round + 0.01)
    before = asked.copy()
    spot.elongation_deviations(asked, BEST, "standard")
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
    noise = (1 + CONTRAST)[:, 1:-1] * (common + own + rng.normal(0, STD, (*parts, LOADS, RINGS - 2)))
    spot = spot_of(levels)
    of_round = read(spot.second_harmonics(BEST[None])[0])
    found = np.array([spot.elongation_deviations(of_round + one, BEST, "standard") for one in noise])
    for share in (0.5, 0.05):
        error = np.sqrt(share * (1 - share) / count)
        assert np.mean(found > np.sqrt(-2 * np.log(share))) == pytest.approx(share, abs=3 * error)


def parts_of(spot: EllipticityTest) -> dict[str, np.ndarray]:
    """Return what a file holds."""
    return {
        DEGREES: spot.second.degrees,
        COEFFICIENTS: spot.second.coefficients.astype(np.float32),
        **{f"camera_{mode}": camera for mode, camera in spot.camera.items()},
    }


def test_what_is_loaded_is_what_was_saved(spot, tmp_path):
    """Polynomials in single precision; error levels are the usual ones."""
    path = tmp_path / "round.npz"
    np.savez(path, **parts_of(spot))
    loaded = read_ellipticity_test(path, spot.surrogate, MODES)
    assert loaded.surrogate is spot.surrogate
    assert loaded.levels == ErrorLevels()
    np.testing.assert_array_equal(loaded.second.degrees, spot.second.degrees)
    np.testing.assert_array_equal(loaded.second.coefficients, spot.second.coefficients.astype(np.float32))
    assert set(loaded.camera) == set(MODES)
    for mode in MODES:
        np.testing.assert_array_equal(loaded.camera[mode], spot.camera[mode])


def test_a_missing_file_is_refused_by_name(spot, tmp_path):
    with pytest.raises(InvalidQuantity, match=r"^second harmonics is .*absent\.npz"):
        read_ellipticity_test(tmp_path / "absent.npz", spot.surrogate, MODES)


@pytest.mark.parametrize("content", [b"", b"no archive", b"PK\x03\x04 cut short"])
def test_a_garbled_file_is_refused_by_name(spot, content, tmp_path):
    path = tmp_path / "garbled.npz"
    path.write_bytes(content)
    with pytest.raises(InvalidQuantity, match=r"^second harmonics is .*garbled\.npz"):
        read_ellipticity_test(path, spot.surrogate, MODES)


@pytest.mark.parametrize("name", [DEGREES, COEFFICIENTS, "camera_standard", "camera_precise"])
def test_a_file_without_one_of_its_parts_or_with_one_of_another_shape_is_refused(spot, name, tmp_path):
    path, parts = tmp_path / "partial.npz", parts_of(spot)
    np.savez(path, **{n: part for n, part in parts.items() if n != name})
    with pytest.raises(InvalidQuantity, match="^second harmonics is"):
        read_ellipticity_test(path, spot.surrogate, MODES)
    np.savez(path, **parts | {name: parts[name][:, :-1]})
    with pytest.raises(InvalidQuantity, match="^shapes of the second harmonics is"):
        read_ellipticity_test(path, spot.surrogate, MODES)
