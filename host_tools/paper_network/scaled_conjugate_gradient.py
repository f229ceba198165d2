"""Turns an objective and its gradient into a local minimum by scaled conjugate gradients (SCG).

There is no line search: the step length comes from one extra gradient (the curvature along the direction) and a
Levenberg-Marquardt term lambda that keeps that curvature positive. The step names (1-9) and symbols are those of
M. F. Moller, "A scaled conjugate gradient algorithm for fast supervised learning", Neural Networks 6:525-533, 1993.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import InvalidQuantity

Vector = NDArray[np.float64]
Objective = Callable[[Vector], tuple[float, Vector]]
"""x [N] -> value and gradient [N]."""

Stop = Callable[[Vector], str]
"""Sees x after every accepted step; a non-empty answer ends the search and is its reason."""

SearchStatus = Literal["converged", "max_iterations", "stopped"]

SIGMA = 1e-5
"""Length of the step that measures the curvature (step 1: 0 < sigma <= 1e-4)."""

FIRST_LAMBDA = 1e-7
"""First scale of the Levenberg-Marquardt term (step 1: 0 < lambda_1 <= 1e-6)."""

ROUNDING = 1e-10
"""Relative falls below this are mostly rounding, so they are integrated from the gradients by the trapezoidal rule,
exact for a quadratic (not in the paper; the idea of Hager & Zhang, SIAM J. Optim. 16(1):170-192, 2005)."""


@dataclass(frozen=True)
class Minimum:
    """Where the search ended, and why.

    `converged`: gradient norm within the tolerance; `max_iterations`: the allowance is used up; `stopped`: the
    caller's `stop` said so, or steps became shorter than float64 resolves. `iterations` counts rejected steps too.
    """

    x: Vector
    value: float
    iterations: int
    status: SearchStatus
    reason: str


class _State:
    """The quantities that Moller's steps hand to each other: w, p, r, lambda and the curvature delta."""

    def __init__(self, objective: Objective, x0: Vector) -> None:
        self.objective = objective
        self.w = np.array(x0, dtype=np.float64)
        self.value, gradient = objective(self.w)
        if not (np.isfinite(self.value) and np.all(np.isfinite(gradient))):
            raise InvalidQuantity("objective at x0", self.value, "finite, like its gradient", "start elsewhere")
        self.r: Vector = -gradient
        self.p: Vector = self.r.copy()
        self.scale, self.scale_in_curvature = FIRST_LAMBDA, 0.0  # lambda and lambda-bar
        self.curvature = 0.0  # delta
        self.success, self.accepted = True, 0

    def advance(self) -> bool:
        """Try one step along p (steps 2-8); return False when it is too short to change w."""
        p_squared = float(self.p @ self.p)
        if self.success:
            self.curvature = self._measure_curvature(p_squared)
        self._make_curvature_positive(p_squared)
        mu = float(self.p @ self.r)
        alpha = mu / self.curvature  # step 5
        trial = self.w + alpha * self.p
        if np.array_equal(trial, self.w):
            return False
        value, gradient = self.objective(trial)
        fall = self.value - value
        if abs(fall) <= ROUNDING * abs(self.value):
            fall = 0.5 * alpha * float(self.p @ (self.r - gradient))
        comparison = 2.0 * self.curvature * fall / mu**2  # step 6
        if not (np.isfinite(comparison) and np.all(np.isfinite(gradient))):
            comparison = -1.0  # not in the paper: a step out of the domain is a bad step, not the end
        self.success = comparison >= 0.0
        if self.success:
            self._accept(trial, value, -gradient, mu)
        else:
            self.scale_in_curvature = self.scale
        self._rescale(comparison, p_squared)
        return True

    def _measure_curvature(self, p_squared: float) -> float:
        """Step 2: delta = p.s, with the Hessian-vector product s from a difference of gradients."""
        sigma = SIGMA / np.sqrt(p_squared)
        _, gradient = self.objective(self.w + sigma * self.p)
        return float(self.p @ (gradient + self.r)) / float(sigma)

    def _make_curvature_positive(self, p_squared: float) -> None:
        """Steps 3 and 4: add what lambda lacks, and when that leaves delta <= 0, raise lambda until it is positive."""
        self.curvature += (self.scale - self.scale_in_curvature) * p_squared
        if self.curvature <= 0.0:
            raised = 2.0 * (self.scale - self.curvature / p_squared)
            self.curvature = -self.curvature + self.scale * p_squared
            self.scale = raised
        self.scale_in_curvature = self.scale

    def _accept(self, w: Vector, value: float, r: Vector, mu: float) -> None:
        """Step 7: take the step; conjugate the new direction, or restart along the gradient every N-th time."""
        self.accepted += 1
        beta = float(r @ r - r @ self.r) / mu
        p = r + beta * self.p
        # p.r > 0 is not in the paper: rounding near the minimum can turn p uphill, where every step would be rejected.
        restart = self.accepted % self.w.size == 0 or float(p @ r) <= 0.0
        self.w, self.value, self.r, self.p = w, value, r, r.copy() if restart else p
        self.scale_in_curvature = 0.0

    def _rescale(self, comparison: float, p_squared: float) -> None:
        """Steps 7 and 8: trust the quadratic model more where it forecast the fall well, less where it did not."""
        if comparison >= 0.75:
            self.scale *= 0.25
        elif comparison < 0.25:
            self.scale += self.curvature * (1.0 - comparison) / p_squared


def minimise(
    objective: Objective,
    x0: Vector,
    *,
    max_iterations: int = 1000,
    gradient_tolerance: float = 1e-6,
    stop: Stop | None = None,
) -> Minimum:
    """Return a local minimum of `objective`, searched from `x0` [N] (left untouched).

    Each iteration costs at most two evaluations. Beyond rounding, the value never rises from one accepted step to the
    next. Ends when the Euclidean norm of the gradient is at most `gradient_tolerance`, when `stop` gives a reason, or
    after `max_iterations`. Raises `InvalidQuantity` when value or gradient at `x0` is not finite.
    """
    state = _State(objective, x0)
    for iteration in range(max_iterations):
        if np.linalg.norm(state.r) <= gradient_tolerance:  # step 9
            return _minimum(state, iteration, "converged", f"gradient norm is at most {gradient_tolerance:g}")
        if not state.advance():
            return _minimum(state, iteration, "stopped", "steps are shorter than float64 resolves")
        reason = stop(state.w) if stop and state.success else ""
        if reason:
            return _minimum(state, iteration + 1, "stopped", reason)
    return _minimum(state, max_iterations, "max_iterations", f"{max_iterations} iterations are used up")


def _minimum(state: _State, iterations: int, status: SearchStatus, reason: str) -> Minimum:
    return Minimum(state.w, state.value, iterations, status, reason)
