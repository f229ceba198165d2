"""Interfaces: Snell's and Fresnel's laws at angles whose answers are known on paper."""

import math

import numpy as np
import pytest

from device.simulation.physics.lookup_optics import transmission
from host_tools.optics.fresnel import plate_transmission, reflectance, refracted_cosine

BLOCK, GLASS, SKIN, AIR = 1.41, 1.52, 1.38, 1.0


@pytest.mark.parametrize(("n_to", "critical_deg"), [(AIR, 45.17), (SKIN, 78.17), (1.35, 73.23)])
def test_all_light_is_reflected_beyond_the_critical_angle_and_not_before(n_to, critical_deg):
    below, beyond = (math.cos(math.radians(critical_deg + side)) for side in (-0.1, 0.1))
    assert reflectance(beyond, BLOCK, n_to) == 1.0
    assert refracted_cosine(beyond, BLOCK, n_to) == -1.0
    assert reflectance(below, BLOCK, n_to) < 0.9


def test_refraction_follows_snell():
    cosine = refracted_cosine(math.cos(math.radians(30.0)), AIR, 1.5)
    assert math.degrees(math.acos(cosine)) == pytest.approx(math.degrees(math.asin(0.5 / 1.5)))


def test_straight_light_is_reflected_by_the_square_of_the_index_contrast():
    assert reflectance(1.0, AIR, 1.5) == pytest.approx(0.04)
    assert reflectance(1.0, BLOCK, AIR) == pytest.approx((0.41 / 2.41) ** 2)


def test_at_brewsters_angle_only_one_polarisation_is_reflected():
    # tan(angle) = n; the other one has r = cos(2 angle), of which unpolarised light keeps half.
    angle = math.atan(1.5)
    assert reflectance(math.cos(angle), AIR, 1.5) == pytest.approx(0.5 * math.cos(2 * angle) ** 2)


def test_reflectance_is_the_same_both_ways():
    inside = math.cos(0.6)
    outside = refracted_cosine(inside, BLOCK, AIR)
    assert reflectance(inside, BLOCK, AIR) == pytest.approx(reflectance(outside, AIR, BLOCK))


def test_equal_indices_are_no_interface():
    assert reflectance(0.3, BLOCK, BLOCK) == pytest.approx(0.0)
    assert refracted_cosine(0.3, BLOCK, BLOCK) == pytest.approx(0.3)
    assert plate_transmission(0.8, BLOCK, BLOCK, AIR) == pytest.approx(1 - reflectance(0.8, BLOCK, AIR))


def test_a_plate_in_air_passes_what_the_sum_of_all_reflections_leaves():
    # 2 n / (n^2 + 1), the classic result for incoherent light at normal incidence.
    assert plate_transmission(1.0, AIR, 1.5, AIR) == pytest.approx(2 * 1.5 / (1.5**2 + 1))


def test_light_trapped_in_the_block_does_not_leave_through_the_glass():
    assert plate_transmission(math.cos(math.radians(46.0)), BLOCK, GLASS, AIR) == 0.0


def test_the_probe_and_the_tracer_know_the_same_fresnel():
    cosines = np.linspace(0.01, 1.0, 50)
    for n_to in (AIR, SKIN, 1.5):
        traced = [1 - reflectance(c, BLOCK, n_to) for c in cosines]
        np.testing.assert_allclose(transmission(cosines, BLOCK, n_to), traced, atol=1e-12)
