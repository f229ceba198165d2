"""Levenberg-Marquardt against problems whose steps and minima are known on paper."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network.levenberg_marquardt import minimise


class Problem:
    """Half the sum of squares of residuals with a given Jacobian."""

    def __init__(self, residuals: Callable[[Array], Array], jacobian: Callable[[Array], Array]) -> None:
        self.residuals, self.jacobian = residuals, jacobian

    def value(self, x: Array) -> float:
        return 0.5 * float(self.residuals(x) @ self.residuals(x))

    def linearise(self, x: Array) -> tuple[Array, Array]:
        return self.residuals(x), self.jacobian(x)


def linear(matrix: Array, right: Array) -> Problem:
    return Problem(lambda x: matrix @ x - right, lambda x: matrix)


ROSENBROCK = Problem(
    lambda x: np.array([10 * (x[1] - x[0] ** 2), 1 - x[0]]), lambda x: np.array([[-20 * x[0], 10.0], [-1.0, 0.0]])
)
"""(100 (y-x^2)^2 + (1-x)^2)/2: the only minimum is 0 at (1, 1), at the end of a bent valley."""
ROOT_OF_TWO = Problem(lambda x: x**2 - 2, lambda x: np.array([[2 * x[0]]]))
IDENTITY = linear(np.eye(1), np.zeros(1))


def test_a_linear_problem_is_solved_in_one_undamped_step() -> None:
    """The line through (0, 1), (1, 2), (2, 4) in least squares: intercept 5/6, slope 3/2."""
    problem = linear(np.array([[1.0, 0.0], [1.0, 1.0], [1.0, 2.0]]), np.array([1.0, 2.0, 4.0]))
    found = minimise(problem, np.zeros(2), damping=0.0, gradient_tolerance=1e-12)
    assert (found.status, found.iterations) == ("converged", 1)
    assert found.x == pytest.approx([5 / 6, 3 / 2], rel=1e-12)


def test_steps_are_damped_by_mu_and_mu_falls_tenfold_with_success() -> None:
    """r = x, J = 1 from x = 1: the steps x/(1 + mu) with mu = 1, then 0.1 leave 1/2, then 1/2 * 0.1/1.1 = 1/22."""
    tried: list[float] = []
    minimise(IDENTITY, np.ones(1), damping=1.0, max_iterations=2, stop=lambda x: tried.append(x[0]) or "")
    assert tried == pytest.approx([1 / 2, 1 / 22], rel=1e-12)


def test_near_a_solution_without_residual_the_error_is_squared_at_every_step() -> None:
    """Undamped steps on x^2 - 2 are Newton's: from 3/2 to 17/12 and 577/408, with errors e' = e^2 / 2x exactly."""
    tried = [1.5]
    minimise(ROOT_OF_TWO, np.array([1.5]), damping=0.0, max_iterations=3, stop=lambda x: tried.append(x[0]) or "")
    assert tried[1:3] == pytest.approx([17 / 12, 577 / 408], rel=1e-14)
    error = np.array(tried) - np.sqrt(2)
    assert error[1:] == pytest.approx(error[:-1] ** 2 / (2 * np.array(tried[:-1])), rel=1e-3, abs=1e-15)


def test_the_usual_damping_costs_that_rate_little() -> None:
    """From 3/2, mu = 1e-3, 1e-4, ... multiplies what a step leaves by at most 1 + mu/e: a few steps suffice."""
    found = minimise(ROOT_OF_TWO, np.array([1.5]), gradient_tolerance=1e-14)
    assert found.iterations <= 5
    assert found.x == pytest.approx(np.sqrt(2), rel=1e-15)


def test_rosenbrocks_valley_is_followed_to_its_end() -> None:
    found = minimise(ROSENBROCK, np.array([-1.2, 1.0]), gradient_tolerance=1e-10)
    assert found.status == "converged"
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-9)


def test_the_value_never_rises() -> None:
    values: list[float] = []
    minimise(ROSENBROCK, np.array([-1.2, 1.0]), stop=lambda x: values.append(ROSENBROCK.value(x)) or "")
    assert len(values) > 5
    assert np.all(np.diff(values) < 0)


def test_parameters_that_only_their_sum_determines_do_not_stop_it() -> None:
    """r = x + y - 2: J'J is singular, so that an undamped step does not exist."""
    found = minimise(linear(np.ones((1, 2)), np.array([2.0])), np.array([3.0, -4.0]), damping=0.0)
    assert found.status == "converged"
    assert found.x.sum() == pytest.approx(2.0, abs=1e-5)


def test_a_step_out_of_the_domain_is_taken_back() -> None:
    """r = ln x, zero at 1: the Gauss-Newton step from 5 is -5 ln 5 = -8 and leaves the domain x > 0."""
    problem = Problem(lambda x: np.log(x) if x[0] > 0 else np.array([np.nan]), lambda x: np.array([[1 / x[0]]]))
    found = minimise(problem, np.array([5.0]), gradient_tolerance=1e-9)
    assert found.x == pytest.approx(1.0, abs=1e-8)


def test_a_minimum_that_rounding_hides_ends_the_search() -> None:
    """r = x^2 + 1 is least at 0 with slope 2x; at 1e-9 its value rounds to 1/2, so that nothing is lower."""
    problem = Problem(lambda x: x**2 + 1, lambda x: np.array([[2 * x[0]]]))
    found = minimise(problem, np.array([1e-9]), gradient_tolerance=0.0)
    assert (found.status, found.reason) == ("stopped", "no step lowers the value")
    assert found.x == 1e-9


def test_the_allowance_of_iterations_is_kept() -> None:
    found = minimise(ROSENBROCK, np.array([-1.2, 1.0]), max_iterations=3)
    assert (found.status, found.iterations) == ("max_iterations", 3)
    assert "3 iterations" in found.reason


def test_the_caller_can_stop_and_its_reason_is_kept() -> None:
    found = minimise(ROSENBROCK, np.array([-1.2, 1.0]), stop=lambda x: "far enough")
    assert (found.status, found.reason) == ("stopped", "far enough")


def test_a_start_at_the_minimum_needs_no_iteration_and_stays_untouched() -> None:
    start = np.ones(2)
    found = minimise(ROSENBROCK, start)
    assert found.iterations == 0
    assert found.x is not start


def test_a_start_outside_the_domain_is_refused() -> None:
    with pytest.raises(InvalidQuantity, match="objective at x0 is nan, but must be finite"):
        minimise(Problem(lambda x: x * np.nan, lambda x: np.eye(2)), np.ones(2))
