"""The minimiser against functions whose minima are known on paper."""

from __future__ import annotations

import numpy as np
import pytest

from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network.scaled_conjugate_gradient import Objective, minimise


def quadratic(hessian: Array, minimum: Array) -> Objective:
    """f = (x-m)'H(x-m)/2, gradient H(x-m): minimum 0 at m when H is positive definite."""

    def objective(x: Array) -> tuple[float, Array]:
        gradient = hessian @ (x - minimum)
        return 0.5 * float((x - minimum) @ gradient), gradient

    return objective


def double_well(x: Array) -> tuple[float, Array]:
    """f = (x^2-1)^2 + y^2: minima 0 at (+-1, 0), a saddle at the origin, where the curvature along x is -4."""
    return float((x[0] ** 2 - 1) ** 2 + x[1] ** 2), np.array([4 * x[0] * (x[0] ** 2 - 1), 2 * x[1]])


def rosenbrock(x: Array) -> tuple[float, Array]:
    """f = 100 (y-x^2)^2 + (1-x)^2: the only minimum is 0 at (1, 1), at the end of a bent valley."""
    valley = x[1] - x[0] ** 2
    return float(100 * valley**2 + (1 - x[0]) ** 2), np.array([-400 * x[0] * valley - 2 * (1 - x[0]), 200 * valley])


@pytest.mark.parametrize("n", [2, 5, 9])
def test_a_convex_quadratic_is_solved_in_about_n_iterations(n: int) -> None:
    """H = tridiagonal(-1, 2, -1), minimum m = (1, 2, ..., n).

    Conjugate gradients end after at most n steps in exact arithmetic; rounding of the measured curvature and the first
    lambda may add a few, so 2n are allowed.
    """
    hessian = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    minimum = np.arange(1.0, n + 1)
    found = minimise(quadratic(hessian, minimum), np.zeros(n), gradient_tolerance=1e-9)
    assert found.status == "converged"
    assert found.iterations <= 2 * n
    assert found.x == pytest.approx(minimum, abs=1e-8)


def test_a_large_value_does_not_hide_the_minimum() -> None:
    """f = x'Hx/2 + 1000 with H = diag(1..5): falls under 1e-13 vanish in the value, but the minimum 0 is still found.

    Judged by the value alone, steps would be lost in rounding at |x| of some sqrt(2e-13) = 4e-7.
    """
    plain = quadratic(np.diag(np.arange(1.0, 6.0)), np.zeros(5))

    def objective(x: Array) -> tuple[float, Array]:
        value, gradient = plain(x)
        return value + 1000.0, gradient

    found = minimise(objective, np.ones(5), gradient_tolerance=1e-9)
    assert found.status == "converged"
    assert found.x == pytest.approx(0.0, abs=1e-9)


def test_a_sphere_is_solved_in_one_step() -> None:
    """H = identity: the first direction -gradient points at the minimum and its curvature gives the exact length."""
    found = minimise(quadratic(np.eye(4), np.full(4, 3.0)), np.zeros(4), gradient_tolerance=1e-5)
    assert found.iterations == 1
    assert found.x == pytest.approx(3.0, abs=1e-5)


def test_rosenbrocks_valley_is_followed_to_its_end() -> None:
    """The minimum is (1, 1) with value 0; the start (-1.2, 1) is the usual one."""
    found = minimise(rosenbrock, np.array([-1.2, 1.0]), gradient_tolerance=1e-9)
    assert found.status == "converged"
    assert found.x == pytest.approx([1.0, 1.0], abs=1e-7)


def test_a_nearly_singular_quadratic_reaches_the_bottom_of_its_valley() -> None:
    """H = diag(1, 1, 1e-9), minimum (1, 2, 3): the third coordinate changes the value by less than 1e-8.

    Only the first two are determined; the value must come within 9e-9/2 (the third left at 0) of the minimum 0.
    """
    hessian = np.diag([1.0, 1.0, 1e-9])
    found = minimise(quadratic(hessian, np.array([1.0, 2.0, 3.0])), np.zeros(3), gradient_tolerance=1e-7)
    assert found.status == "converged"
    assert found.x[:2] == pytest.approx([1.0, 2.0], abs=1e-6)
    assert found.value <= 4.5e-9 * (1 + 1e-6)


def test_negative_curvature_leads_to_a_minimum_not_to_the_saddle() -> None:
    """From (0.1, 0) the curvature along the gradient is 12*0.01-4 < 0, and a Newton step would climb to the origin."""
    found = minimise(double_well, np.array([0.1, 0.0]), gradient_tolerance=1e-9)
    assert np.abs(found.x) == pytest.approx([1.0, 0.0], abs=1e-8)


def test_a_step_out_of_the_domain_is_taken_back() -> None:
    """f = x - ln x has its minimum at 1; from 5 the Newton step -f'/f'' = -0.8*25 = -20 leaves the domain x > 0."""

    def objective(x: Array) -> tuple[float, Array]:
        return (float(x[0] - np.log(x[0])), 1 - 1 / x) if x[0] > 0 else (np.nan, np.array([np.nan]))

    found = minimise(objective, np.array([5.0]), gradient_tolerance=1e-9)
    assert found.x == pytest.approx(1.0, abs=1e-8)


def test_the_value_never_rises() -> None:
    values: list[float] = []

    def record(x: Array) -> str:
        values.append(rosenbrock(x)[0])
        return ""

    minimise(rosenbrock, np.array([-1.2, 1.0]), stop=record, gradient_tolerance=1e-4)
    assert len(values) > 10
    assert np.all(np.diff(values) <= 0)


def test_the_allowance_of_iterations_is_kept() -> None:
    found = minimise(rosenbrock, np.array([-1.2, 1.0]), max_iterations=5)
    assert (found.status, found.iterations) == ("max_iterations", 5)
    assert "5 iterations" in found.reason


def test_the_caller_can_stop_and_its_reason_is_kept() -> None:
    found = minimise(rosenbrock, np.array([-1.2, 1.0]), stop=lambda x: "far enough")
    assert (found.status, found.reason) == ("stopped", "far enough")


def test_a_start_at_the_minimum_needs_no_iteration_and_stays_untouched() -> None:
    start = np.ones(2)
    found = minimise(rosenbrock, start)
    assert found.iterations == 0
    assert found.x is not start


def test_a_start_outside_the_domain_is_refused() -> None:
    with pytest.raises(InvalidQuantity, match="objective at x0 is nan, but must be finite"):
        minimise(lambda x: (float("nan"), x), np.ones(2))
