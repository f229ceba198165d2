"""Sums of products of Legendre polynomials against numpy's own, and their gradient against differences."""

import numpy as np
import pytest
from numpy.polynomial import Legendre

from device.measurement.ramp_modes.legendre import POINTS_AT_ONCE, LegendreSum, LegendreTerms

DEGREES = np.array([(0, 0, 0), (1, 0, 0), (0, 2, 0), (3, 1, 0), (2, 0, 4), (5, 3, 1)], dtype=np.uint8)


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(1).uniform(-1, 1, (7, 3))


@pytest.fixture
def field() -> LegendreSum:
    return LegendreSum(DEGREES, np.random.default_rng(2).normal(size=(len(DEGREES), 4)))


def test_terms_are_products_of_legendre_polynomials(points):
    expected = [
        [np.prod([Legendre.basis(k)(x) for k, x in zip(row, at, strict=True)]) for row in DEGREES] for at in points
    ]
    np.testing.assert_allclose(LegendreTerms(DEGREES).values(points), expected, rtol=1e-12)


def test_values_are_the_terms_times_the_coefficients(field, points):
    np.testing.assert_allclose(
        field.values(points), LegendreTerms(DEGREES).values(points) @ field.coefficients, rtol=1e-14
    )


def test_the_values_beside_the_gradient_are_the_values(field, points):
    np.testing.assert_allclose(field.values_and_gradient(points)[0], field.values(points), rtol=1e-13)


def test_single_precision_is_the_same_to_a_millionth(field, points):
    single = field.values_and_gradient(points.astype(np.float32))
    for one, double in zip(single, field.values_and_gradient(points), strict=True):
        assert one.dtype == np.float32
        np.testing.assert_allclose(one, double, atol=2e-6 * np.abs(double).max())


def test_points_of_several_passes_come_in_their_order(field):
    many = np.random.default_rng(3).uniform(-1, 1, (2 * POINTS_AT_ONCE + 5, 3))
    np.testing.assert_allclose(field.values(many)[::-1], field.values(many[::-1]), rtol=1e-12)
    assert field.values(many[:0]).shape == (0, 4)


def test_a_term_is_counted_as_often_as_it_stands_there(points):
    twice = LegendreSum(np.array([(1, 0, 2), (1, 0, 2)], np.uint8), np.array([[2.0], [5.0]]))
    once = LegendreSum(np.array([(1, 0, 2)], np.uint8), np.array([[7.0]]))
    np.testing.assert_allclose(twice.values(points), once.values(points), rtol=1e-14)


def test_every_polynomial_is_one_in_the_corner_of_the_cube(field):
    np.testing.assert_allclose(field.values(np.ones((1, 3)))[0], field.coefficients.sum(axis=0), rtol=1e-12)


def test_a_constant_has_no_gradient_and_a_plane_its_slopes(points):
    plane = LegendreSum(np.array([(0, 0, 0), (1, 0, 0), (0, 0, 1)], np.uint8), np.array([[7.0], [2.0], [-3.0]]))
    np.testing.assert_allclose(plane.values(points)[:, 0], 7 + 2 * points[:, 0] - 3 * points[:, 2], rtol=1e-14)
    np.testing.assert_allclose(
        plane.values_and_gradient(points)[1][:, :, 0], np.tile([[2.0], [0.0], [-3.0]], len(points)), atol=1e-14
    )


def test_the_gradient_is_the_limit_of_central_differences(field, points):
    """Their error is of the second order: a step ten times smaller leaves a hundredth."""
    errors = [_error_of_differences(field, points, step) for step in (1e-2, 1e-3)]
    assert errors[1] == pytest.approx(errors[0] / 100, rel=0.01)
    assert errors[1] < 1e-3


def _error_of_differences(field: LegendreSum, points: np.ndarray, step: float) -> float:
    steps = step * np.eye(3)
    differences = [(field.values(points + away) - field.values(points - away)) / (2 * step) for away in steps]
    return float(np.linalg.norm(field.values_and_gradient(points)[1] - differences))
