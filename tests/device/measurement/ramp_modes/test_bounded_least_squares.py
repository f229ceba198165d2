"""Least squares within bounds against linear algebra, active sets known on paper, and SciPy's own solver."""

import numpy as np
import pytest
from scipy.optimize import least_squares as of_scipy

from device.measurement.ramp_modes.bounded_least_squares import least_squares

EXACT = {"tolerance": 1e-14, "steps": 200}


def linear(matrix: np.ndarray, right: np.ndarray):
    def residuals(at, which):
        return at @ matrix.T - right[which], np.broadcast_to(matrix, (len(at), *matrix.shape))

    return residuals


def rosenbrock(at: np.ndarray, which: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rosenbrock 1960, in residuals: 10 (y - x^2) and 1 - x, which are 0 at (1, 1)."""
    x, y = at.T
    jacobian = np.zeros((len(at), 2, 2))
    jacobian[:, 0, 0], jacobian[:, 0, 1], jacobian[:, 1, 0] = -20 * x, 10, -1
    return np.stack([10 * (y - x**2), 1 - x], axis=1), jacobian


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(4)


def test_linear_problems_end_where_linear_algebra_says(rng):
    matrix, right = rng.normal(size=(7, 3)), rng.normal(size=(5, 7))
    found = least_squares(linear(matrix, right), np.zeros((5, 3)), -10, 10, **EXACT)
    np.testing.assert_allclose(found, np.linalg.lstsq(matrix, right.T, rcond=None)[0].T, atol=1e-7)


def test_a_bound_that_holds_one_parameter_moves_the_other_to_its_best_beside_it():
    """Of (x + 2 y - 4)^2 + (x / 2 - y)^2 the least is at (2, 1).

    With x at most 1.3 it is where 2 (4 - x - 2 y) = y - x / 2.
    """
    problem = linear(np.array([[1.0, 2.0], [0.5, -1.0]]), np.array([[4.0, 0.0]]))
    np.testing.assert_allclose(least_squares(problem, np.zeros((1, 2)), -9, 9, **EXACT), [[2.0, 1.0]], atol=1e-7)
    held = least_squares(problem, np.zeros((1, 2)), -1.3, 1.3, **EXACT)
    np.testing.assert_allclose(held, [[1.3, (2 * (4 - 1.3) + 1.3 / 2) / 5]], atol=1e-7)


def test_a_curved_valley_is_followed_from_everywhere(rng):
    found = least_squares(rosenbrock, rng.uniform(-2, 2, (40, 2)), -2, 2, **EXACT)
    np.testing.assert_allclose(found, 1.0, atol=1e-6)


@pytest.mark.parametrize("high", [0.7, 0.3])
def test_within_bounds_it_ends_where_scipy_does(high, rng):
    start = rng.uniform(-1, high, (20, 2))
    found = least_squares(rosenbrock, start, -1, high, **EXACT)
    for at, begun in zip(found, start, strict=True):
        other = of_scipy(
            lambda x: rosenbrock(x[None], np.array([0]))[0][0], begun, bounds=(-1, high), xtol=1e-14, ftol=1e-14
        )
        np.testing.assert_allclose(at, other.x, atol=1e-4)
        assert np.sum(rosenbrock(at[None], np.array([0]))[0] ** 2) <= 2 * other.cost + 1e-12


def test_many_problems_end_where_each_of_them_does_alone(rng):
    """They ask for their own numbers, also when others have ended."""
    start, right = rng.uniform(-1, 1, (6, 2)), rng.normal(size=(6, 2))

    def of(numbers):
        def residuals(at, which):
            value, jacobian = rosenbrock(at, which)
            return value - right[numbers][which], jacobian

        return residuals

    together = least_squares(of(np.arange(6)), start, -1, 1, **EXACT)
    alone = [least_squares(of(np.array([i])), start[i : i + 1], -1, 1, **EXACT)[0] for i in range(6)]
    np.testing.assert_allclose(together, alone, atol=1e-9)


def test_the_cost_never_rises_and_the_steps_are_counted():
    start, cost = np.array([[-1.2, 1.0]]), []
    for steps in range(60):
        found = least_squares(rosenbrock, start, -2, 2, tolerance=0.0, steps=steps)
        cost.append(float(np.sum(rosenbrock(found, np.array([0]))[0] ** 2)))
    assert cost[0] == pytest.approx(24.2)
    assert all(np.diff(cost) <= 0)
    assert cost[-1] < 1e-12


def test_where_no_step_is_foretold_to_gain_none_is_tried_again():
    """At its best a problem ends with the first step that rounding lets raise the cost, without ever smaller ones."""
    calls = []

    def residuals(at, which):
        calls.append(len(at))
        level = np.full_like(at, 1 + 1e-9 * (len(calls) > 1))
        return np.concatenate([level, at], axis=1), np.array([[[0.0], [1.0]]])

    least_squares(residuals, np.full((1, 1), 1e-6), -1, 1, tolerance=1e-6, steps=50)
    assert calls == [1, 1]


def test_a_start_outside_the_bounds_is_brought_inside():
    found = least_squares(rosenbrock, np.array([[5.0, -7.0]]), -2, 2, tolerance=0.0, steps=0)
    np.testing.assert_array_equal(found, [[2.0, -2.0]])
