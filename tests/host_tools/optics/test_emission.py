"""Directions of light: their distributions have the means that are known on paper."""

import math

import numpy as np
import pytest
from numba import njit

from host_tools.optics.emission import about, isotropic, lambertian_cosine, led_cosine, sideways

DRAWS = 50_000


@njit
def many(count):
    np.random.seed(3)  # noqa: NPY002 - numba's own generator
    found = np.zeros((count, 6))
    for i in range(count):
        found[i, 0] = lambertian_cosine()
        found[i, 1], found[i, 2] = led_cosine(1.0, False, 1.41)
        found[i, 3], _ = led_cosine(9.0, True, 1.41)
        x, y = sideways(1.5)
        found[i, 4] = math.hypot(x, y)
        found[i, 5] = isotropic()[2]
    return found


@pytest.fixture(scope="module")
def draws():
    return many(DRAWS)


def test_the_mean_cosine_of_lambertian_light_is_two_thirds(draws):
    assert draws[:, 0].mean() == pytest.approx(2 / 3, abs=0.005)


def test_light_from_air_stays_within_the_critical_angle_of_the_wall(draws):
    assert draws[:, 1].min() > math.cos(math.asin(1 / 1.41))


def test_a_window_reflects_the_known_share_of_diffuse_light(draws):
    # Diffuse reflectance from the rarer side: Duntley, J. Opt. Soc. Am. 32, 61 (1942).
    n = 1.41
    log = (n**2 * (n**2 - 1) ** 2 / (n**2 + 1) ** 3) * math.log((n - 1) / (n + 1))
    rational = 2 * n**3 * (n**2 + 2 * n - 1) / ((n**2 + 1) * (n**4 - 1))
    far = 8 * n**4 * (n**4 + 1) / ((n**2 + 1) * (n**4 - 1) ** 2) * math.log(n)
    known = 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2) + log - rational + far
    assert 1 - draws[:, 2].mean() == pytest.approx(known, abs=0.003)


def test_a_lens_narrows_an_led(draws):
    assert draws[:, 3].mean() == pytest.approx(10 / 11, abs=0.003)


def test_skin_spreads_light_by_its_mean_distance(draws):
    assert draws[:, 4].mean() == pytest.approx(1.5, abs=0.02)


def test_haze_has_no_preferred_direction(draws):
    assert draws[:, 5].mean() == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("normal", [(0.0, 0.0, 1.0), (0.0, 0.0, -1.0), (0.6, 0.0, -0.8), (-1.0, 0.0, 0.0)])
def test_a_direction_keeps_its_angle_to_any_normal(normal):
    direction = about(0.3, *normal)
    assert np.dot(direction, normal) == pytest.approx(0.3)
    assert np.linalg.norm(direction) == pytest.approx(1.0)
