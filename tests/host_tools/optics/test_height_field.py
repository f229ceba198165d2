"""The deformed face: where a ray meets it, against geometry on paper."""

import math

import numpy as np
import pytest

from host_tools.optics.height_field import NO_HIT, bilinear, distance_to_face, slope
from host_tools.optics.traced import TracedFace

X = np.linspace(-12.0, 12.0, 161)


def field(w):
    x, y = np.meshgrid(X, X)
    return TracedFace(X, X, w(x, y), np.zeros((161, 161))).height_field(10.0)


FLAT = field(lambda x, y: 0 * x)
RAMP = field(lambda x, y: 0.1 * x)
DIMPLE = field(lambda x, y: 1.2 * np.exp(-(x**2 + y**2) / 8))


def test_a_flat_face_is_met_at_its_height():
    assert distance_to_face(FLAT, 0.0, 0.0, 5.0, 0.6, 0.0, 0.8, 100.0) == pytest.approx(5.0 / 0.8)


def test_a_ramp_is_met_where_the_straight_lines_cross():
    # From (-5, 5) at 45 degrees: 5 + s = 10 - 0.1 (-5 + s), s = 5.5 / 1.1 along each axis.
    up = math.sqrt(0.5)
    assert distance_to_face(RAMP, -5.0, 0.0, 5.0, up, 0.0, up, 100.0) == pytest.approx(5.0 / up, abs=1e-5)


def test_the_slope_of_a_ramp_is_its_gradient():
    assert slope(RAMP, 1.234, -3.0) == pytest.approx((0.1, 0.0))


def test_beyond_the_grid_the_face_goes_on_flat():
    assert slope(RAMP, 12.5, 0.0)[0] == 0.0
    assert bilinear(RAMP.w, RAMP, 13.0, 0.0) == pytest.approx(1.2)


@pytest.mark.parametrize("rise", [0.1, 0.2, 0.4, 0.7])
def test_a_ray_ends_on_the_dimple_and_stays_below_it_before(rise):
    dx = math.sqrt(1 - rise * rise)
    t = distance_to_face(DIMPLE, -11.9, 0.3, 8.0, dx, 0.0, rise, 30.0)

    def gap(way):
        return 10.0 - bilinear(DIMPLE.w, DIMPLE, -11.9 + way * dx, 0.3) - (8.0 + way * rise)

    assert gap(t) == pytest.approx(0.0, abs=1e-5)
    assert min(gap(way) for way in np.linspace(0.0, t - 1e-3, 200)) > 0.0


def test_a_level_ray_meets_the_dimple_but_passes_beneath_a_shallower_one():
    assert distance_to_face(DIMPLE, -11.9, 0.0, 9.0, 1.0, 0.0, 0.0, 23.0) < 12.0
    assert distance_to_face(DIMPLE, -11.9, 0.0, 8.7, 1.0, 0.0, 0.0, 23.0) == NO_HIT


def test_a_falling_ray_below_the_dimple_meets_no_face():
    assert distance_to_face(DIMPLE, 0.0, 0.0, 5.0, 0.6, 0.0, -0.8, 100.0) == NO_HIT
