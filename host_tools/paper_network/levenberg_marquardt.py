"""Turns residuals and their Jacobian into a local minimum by the Levenberg-Marquardt algorithm (LM).

Each step solves (J'J + mu I) p = -J'r: Gauss-Newton where mu is small, a short step downhill where it is large. mu
falls tenfold after a step that lowers the value, however little, and rises tenfold after one that does not; there is
no line search, so where the residuals stay large the two may alternate until the allowance of iterations is used up.
Source: M. T. Hagan & M. B. Menhaj, "Training feedforward networks with the Marquardt algorithm", IEEE Trans. Neural
Networks 5(6):989-993, 1994 (J, r, mu and the factor are theirs); mu's ends are those of MATLAB's trainlm.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from device.measurement.quantities import InvalidQuantity
from host_tools.paper_network.scaled_conjugate_gradient import Minimum, SearchStatus, Stop, Vector

Matrix = NDArray[np.float64]

FIRST_DAMPING = 1e-3
DAMPING_FACTOR = 10.0
LARGEST_DAMPING = 1e10
"""Damped as strongly as this, a step is too short to matter."""


class LeastSquares(Protocol):
    """A problem whose value has the gradient J'r, as half a sum of squares r'r/2 has."""

    def value(self, x: Vector) -> float:
        """Return what is minimised, at x [N]."""

    def linearise(self, x: Vector) -> tuple[Vector, Matrix]:
        """Return the residuals r [m] and their Jacobian J [m, N] at x [N]."""


class _State:
    """The quantities that the steps hand to each other: x, its value, J'J, J'r and the damping mu."""

    def __init__(self, problem: LeastSquares, x0: Vector, damping: float) -> None:
        self.problem, self.damping = problem, damping
        self.success = True
        self._move_to(np.array(x0, dtype=np.float64), problem.value(x0))
        if not (np.isfinite(self.value) and np.all(np.isfinite(self.gradient))):
            raise InvalidQuantity("objective at x0", self.value, "finite, like its gradient", "start elsewhere")

    def _move_to(self, x: Vector, value: float) -> None:
        residuals, jacobian = self.problem.linearise(x)
        self.x, self.value = x, value
        self.gradient, self.normal = jacobian.T @ residuals, jacobian.T @ jacobian

    def advance(self) -> bool:
        """Try one step; return False when it is too short to change x."""
        trial = self.x + self._step()
        if np.array_equal(trial, self.x):
            return False
        value = self.problem.value(trial)
        self.success = value < self.value  # False for NaN too: a step out of the domain is a bad step, not the end
        if self.success:
            self._move_to(trial, value)
            self.damping /= DAMPING_FACTOR
        else:
            self._damp_more()
        return True

    def _step(self) -> Vector:
        while True:
            damped = self.normal + self.damping * np.eye(len(self.x))
            try:
                return np.asarray(-cho_solve(cho_factor(damped), self.gradient))
            except LinAlgError:  # J'J is singular to rounding
                self._damp_more()

    def _damp_more(self) -> None:
        least = FIRST_DAMPING * np.finfo(np.float64).eps  # ten times nothing would be nothing
        self.damping = max(self.damping * DAMPING_FACTOR, least)


def minimise(
    problem: LeastSquares,
    x0: Vector,
    *,
    max_iterations: int = 1000,
    gradient_tolerance: float = 1e-6,
    stop: Stop | None = None,
    damping: float = FIRST_DAMPING,
) -> Minimum:
    """Return a local minimum of `problem`, searched from `x0` [N] (left untouched) with mu = `damping` at first.

    Each iteration costs one value, and one Jacobian if it is accepted; the value falls from one accepted step to the
    next. Ends when the Euclidean norm of the gradient is at most `gradient_tolerance`, when `stop` gives a reason, when
    no step lowers the value, or after `max_iterations`. Raises `InvalidQuantity` when value or gradient at `x0` is not
    finite.
    """
    state = _State(problem, x0, damping)
    for iteration in range(max_iterations):
        if np.linalg.norm(state.gradient) <= gradient_tolerance:
            return _minimum(state, iteration, "converged", f"gradient norm is at most {gradient_tolerance:g}")
        if state.damping > LARGEST_DAMPING or not state.advance():
            return _minimum(state, iteration, "stopped", "no step lowers the value")
        reason = stop(state.x) if stop and state.success else ""
        if reason:
            return _minimum(state, iteration + 1, "stopped", reason)
    return _minimum(state, max_iterations, "max_iterations", f"{max_iterations} iterations are used up")


def _minimum(state: _State, iterations: int, status: SearchStatus, reason: str) -> Minimum:
    return Minimum(state.x, state.value, iterations, status, reason)
