"""Fields known on paper, sampled on the rays of round and square faces, against the same fields at other points."""

import numpy as np
import pytest

from host_tools.forward.face_points import FacePoints
from host_tools.forward.face_state import Rays
from host_tools.scenes.scene import Waveguide

RNG = np.random.default_rng(5)
X_MM, Y_MM = RNG.uniform(-11.0, 11.0, (2, 400))
ROUND, SQUARE = Waveguide(), Waveguide(face="square")


def bump(x_mm, y_mm):
    """A smooth bump 6 mm beside the axis, as wide as the deformation over an inclusion 6 mm deep."""
    return np.exp(-((x_mm - 6.0) ** 2 + y_mm**2) / 50.0)


@pytest.mark.parametrize("first_angle", [0.0, 1.234])
def test_a_bump_beside_the_axis_stays_where_it_is(first_angle):
    """However the rays are turned: a spline of 48 samples misses its 12th harmonic by some 1e-4."""
    rays = Rays.over(ROUND, 48)
    rays = Rays(rays.angle_rad + first_angle, rays.r_mm)
    points = FacePoints(rays, X_MM, Y_MM)
    inside = np.hypot(X_MM, Y_MM) <= 11.0
    assert (points.is_inside == inside).all()
    np.testing.assert_allclose(points(bump(*rays.xy_mm))[inside], bump(X_MM, Y_MM)[inside], atol=5e-4)


def test_a_plane_over_a_square_face_stays_a_plane():
    """A linear field is straight along the rays and along the sides; half a degree of a side is 0.1 mm long."""
    rays = Rays.over(SQUARE, 48)
    points = FacePoints(rays, X_MM, Y_MM)
    x_mm, y_mm = rays.xy_mm
    assert points.is_inside.all()
    np.testing.assert_allclose(points(x_mm - 2 * y_mm), X_MM - 2 * Y_MM, atol=1e-3)


def test_a_square_face_reaches_into_its_corners_and_no_further():
    points = FacePoints(Rays.over(SQUARE, 48), np.array([10.99, 11.01, 7.0]), np.array([10.99, 3.0, -11.1]))
    assert points.is_inside.tolist() == [True, False, False]


def test_one_ray_is_a_radial_profile_that_keeps_the_rims_value_beyond():
    rays = Rays.over(ROUND)
    points = FacePoints(rays, np.array([[0.0, 3.0, 20.0]]), np.array([[0.0], [4.0]]))
    np.testing.assert_allclose(points(rays.r_mm), [[0.0, 3.0, 11.0], [4.0, 5.0, 11.0]], atol=1e-12)
    assert points.is_inside.tolist() == [[True, True, False], [True, True, False]]
