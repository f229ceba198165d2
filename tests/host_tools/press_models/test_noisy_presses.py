"""Noise that is drawn is distributed as the noise model that the fit believes in."""

from dataclasses import replace

import numpy as np
import pytest
from small_surrogate import COLUMNS, EXACT, LinearRows, random_surrogate, white_noise

from device.measurement.parameters import HIGH, PARAMETERS, denormalise
from device.measurement.ramp_modes.noise import FURTHER, ErrorLevels, PressNoise, as_one_row
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST, RESPONSE, network_rows
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS, OFFSET, RESPONSE_COLUMNS
from device.measurement.recording.ring_means import RINGS
from host_tools.press_models import noisy_presses
from host_tools.press_models.noisy_presses import NetworkPresses, NoiseSampler, random_press_set, random_scan

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
    gain = white_noise(1e-6, replace(EXACT, gain_ratio=0.01))
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
    rows = surrogate.rows(press_set.normalised.astype(np.float64), press_set.direction_rad)
    np.testing.assert_allclose(press_set.rows, rows, atol=1e-5 * np.abs(rows).max())
    assert len(np.unique(press_set.direction_rad)) == 20
    assert press_set.rows.dtype == press_set.normalised.dtype == np.float32
    assert (denormalise(press_set.normalised.astype(np.float64))[:, 0] > 2.0 - 1e-5).all()


def test_directions_of_a_press_set_are_even_over_the_circle_and_of_its_seed():
    """A mean cosine or sine of n even angles strays by sqrt(1 / 2 n)."""
    flat = LinearRows(np.zeros((len(PARAMETERS), COLUMNS)))
    first, again, other = (random_press_set(flat, NOISE, 2000, seed).direction_rad for seed in (4, 4, 5))
    np.testing.assert_array_equal(first, again)
    assert (first != other).all()
    assert 0 <= first.min() < 0.1
    assert 2 * np.pi - 0.1 < first.max() <= 2 * np.pi
    for order in (1, 2, 4):
        assert abs(np.exp(1j * order * first).mean()) < 5 * np.sqrt(0.5 / len(first))


@pytest.fixture(scope="module")
def press_set():
    return random_press_set(random_surrogate(), NOISE, 20, seed=4)


def test_networks_see_the_rows_that_they_read_with_the_same_noise(press_set):
    read, index = NetworkPresses(press_set), np.array([3, 0, 11])
    np.testing.assert_array_equal(read.normalised, press_set.normalised)
    np.testing.assert_array_equal(read.rows, network_rows(press_set.rows))
    found, rows = (one.noisy(index, np.random.default_rng(8)) for one in (read, press_set))
    np.testing.assert_array_equal(found, network_rows(rows))
    assert found.dtype == np.float32


def test_the_typical_noise_of_what_networks_read_is_that_of_the_mean_over_the_forces():
    """White noise of s in every column: first harmonics are means of four, whose variance is a quarter."""
    presses = random_press_set(LinearRows(np.zeros((len(PARAMETERS), COLUMNS))), white_noise(0.1), 5, seed=1)
    covariance = NetworkPresses(presses).typical_noise()
    names = CONTRAST_COLUMNS + RESPONSE_COLUMNS
    expected = np.concatenate([np.full(names, 0.01), np.full(RINGS - 1, 0.0025)])
    np.testing.assert_allclose(covariance, np.diag(expected), atol=1e-12)


SCAN_MM = np.array([0.5, 4.0, 6.5])
MIDDLE = np.zeros(len(PARAMETERS))


@pytest.fixture(scope="module")
def small_slopes() -> LinearRows:
    return LinearRows(np.random.default_rng(7).normal(0, 0.02, (len(PARAMETERS), COLUMNS)))


def exact_scan(surrogate) -> np.ndarray:
    """Return the rows [N, P] without noise, whose reference is the first press' one."""
    each = np.tile(MIDDLE, (len(SCAN_MM), 1))
    each[:, OFFSET] = 2 * SCAN_MM / HIGH[OFFSET] - 1
    rows = surrogate.rows(each)
    rows[1:, RESPONSE] = rows[0, RESPONSE]
    return rows


@pytest.mark.long
@pytest.mark.parametrize("levels", [ErrorLevels(flat_field_ratio=0.01, model_ratio=0.01), EXACT], ids=["all", "camera"])
def test_scans_scatter_as_the_scans_covariance_says(small_slopes, levels):
    """To what a sample covariance of n draws strays by; what presses share included."""
    noise, draws, rng = PressNoise(NOISE.camera, levels), 3000, np.random.default_rng(9)
    exact = exact_scan(small_slopes)
    drawn = np.array([
        as_one_row(random_scan(small_slopes, noise, MIDDLE, SCAN_MM, rng)[0]) for _ in range(draws)
    ]) - as_one_row(exact)  # fmt: skip
    expected = noise.scan_covariance(exact)
    std = np.sqrt(np.diag(expected))
    strayed = (np.cov(drawn.T) - expected) / np.outer(std, std)
    assert np.abs(strayed).max() < 6.5 * np.sqrt(2 / draws)
    assert np.sqrt(np.mean(strayed**2)) < 2 / np.sqrt(draws)
    assert np.abs(drawn.mean(axis=0) / std).max() < 5 / np.sqrt(draws)
    between = expected[CONTRAST, COLUMNS : COLUMNS + CONTRAST_COLUMNS] / np.outer(std[CONTRAST], std[CONTRAST])
    assert np.abs(between).max() > (0.3 if levels != EXACT else 0.05)


def test_a_scan_has_one_reference_response(small_slopes):
    rows, _ = random_scan(small_slopes, NOISE, MIDDLE, SCAN_MM, np.random.default_rng(1))
    assert rows.shape == (len(SCAN_MM), COLUMNS)
    np.testing.assert_array_equal(rows[1:, RESPONSE], np.tile(rows[0, RESPONSE], (2, 1)))
    assert (rows[1, FURTHER] != rows[2, FURTHER]).all()


class Counted:
    """Random numbers of one seed for directions and of another for noise, whatever is drawn of the one."""

    def __init__(self) -> None:
        self.uniform, self.standard_normal = np.random.default_rng(3).uniform, np.random.default_rng(2).standard_normal


def test_a_scan_of_one_press_scatters_as_the_press_does(small_slopes):
    """Its noise is the first press' own of any scan: the same numbers drawn through the same factor."""
    one, three = (random_scan(small_slopes, NOISE, MIDDLE, mm, Counted())[0] for mm in (SCAN_MM[:1], SCAN_MM))
    np.testing.assert_allclose(one[0], three[0], atol=1e-12)


def test_each_ramp_of_a_scan_lies_in_a_direction_of_its_own(small_slopes):
    """Directions that are told are those of the rows: next to no noise, and along the rows' first harmonic."""
    along = np.zeros(COLUMNS)
    along[FIRST] = 0.3
    turned, quiet, rng = LinearRows(small_slopes.slopes, along), white_noise(1e-6), np.random.default_rng(5)
    scans = [random_scan(turned, quiet, MIDDLE, np.ones(2), rng) for _ in range(200)]
    rows, direction_rad = (np.array(part) for part in zip(*scans, strict=True))
    added = rows - small_slopes.rows(np.tile(MIDDLE, (2, 1)))
    np.testing.assert_allclose(added[..., FIRST] - 0.3 * np.cos(2 * direction_rad)[..., None], 0.0, atol=1e-4)
    assert len(np.unique(direction_rad)) == direction_rad.size
    for order in (1, 2, 4):
        assert abs(np.exp(1j * order * direction_rad).mean()) < 5 * np.sqrt(0.5 / direction_rad.size)


def test_a_scan_leaves_what_it_is_asked_about_as_it_is(small_slopes):
    at, places = np.full(len(PARAMETERS), 0.1), SCAN_MM.copy()
    random_scan(small_slopes, NOISE, at, places, np.random.default_rng(2))
    np.testing.assert_array_equal(at, 0.1)
    np.testing.assert_array_equal(places, SCAN_MM)
