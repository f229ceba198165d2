"""Interpolation between Chebyshev points is exact for polynomials and converges geometrically for what is smooth."""

import numpy as np
import pytest

from device.simulation.physics.chebyshev import (
    interpolated,
    interpolation_weights,
    points_inside,
    points_with_ends,
    slope_weights,
)


@pytest.mark.parametrize("points", [points_with_ends(2.0, 5.0, 6), points_inside(2.0, 5.0, 6)])
def test_a_polynomial_of_the_degree_is_exact(points):
    def quintic(x):
        return 3 - x + 0.5 * x**5

    for x in (2.1, 3.3, 4.9, points[2]):
        assert interpolation_weights(points, x) @ quintic(points) == pytest.approx(quintic(x), rel=1e-12)


@pytest.mark.parametrize("points", [points_with_ends(2.0, 5.0, 6), points_inside(2.0, 5.0, 6)])
def test_the_slope_of_a_polynomial_is_its_derivative(points):
    """Of 3 - x + x^5 / 2, at the ends and at a point as well."""
    for x in (2.0, 3.3, 5.0, points[2]):
        assert slope_weights(points, x) @ (3 - points + 0.5 * points**5) == pytest.approx(2.5 * x**4 - 1, rel=1e-7)


def test_a_polynomial_in_two_variables_is_exact_and_the_other_axes_stay():
    """(1 + x) (2 - y^2) times [1, 3] before and [1, 2, 5] after the two axes."""
    x, y = points_with_ends(0.0, 4.0, 2), points_inside(-1.0, 1.0, 3)
    fields = np.multiply.outer(np.multiply.outer([1.0, 3.0], np.outer(1 + x, 2 - y**2)), [1.0, 2.0, 5.0])
    found = interpolated(fields, [x, y], [1.5, 0.3])
    np.testing.assert_allclose(found, 2.5 * 1.91 * np.outer([1.0, 3.0], [1.0, 2.0, 5.0]), rtol=1e-12)


def test_ends_are_points_of_the_second_kind_only():
    assert points_with_ends(1.0, 3.0, 5)[[0, -1]].tolist() == [1.0, 3.0]
    inside = points_inside(1.0, 3.0, 5)
    assert 1.0 < inside[0] < inside[-1] < 3.0


@pytest.mark.parametrize("kind", [points_with_ends, points_inside])
def test_every_further_point_divides_the_error_of_a_smooth_function(kind):
    """1/(1 + x^2) on [-1, 1]: poles at +-i, so the error falls by 1 + sqrt 2 a point (Trefethen, theorem 8.2)."""
    at = np.linspace(-1, 1, 101)
    errors = []
    for n in (8, 16, 24):
        points = kind(-1.0, 1.0, n)
        found = np.array([interpolation_weights(points, x) @ (1 / (1 + points**2)) for x in at])
        errors.append(np.abs(found - 1 / (1 + at**2)).max())
    rates = (np.array(errors[:-1]) / errors[1:]) ** (1 / 8)
    assert rates == pytest.approx(1 + np.sqrt(2), rel=0.1)
