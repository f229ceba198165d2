"""Many small nonlinear least-squares problems at once, each parameter within its bounds.

Levenberg-Marquardt's damping is one number a problem; a step that would leave the bounds ends on them, and the other
parameters are solved for again. One call evaluates all problems that have not ended: that is what makes it fast.
Sources: Marquardt, J. SIAM 11 (1963), damping scaled by the diagonal; Kanzow, Yamashita & Fukushima, J. Comput. Appl.
Math. 172 (2004), projection onto bounds; Nocedal & Wright, Numerical Optimization (2006), 16.7, active sets.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array

Residuals = Callable[[Array, NDArray[np.intp]], tuple[Array, Array]]
"""Residuals [m, P] and their derivatives [m, P, k] at points [m, k], one of each of the problems numbered [m]."""
DAMPING, LARGEST_DAMPING = 1e-3, 1e8
EASED, RAISED = 0.1, 8.0
"""By what a step that lowers the cost multiplies the damping, and by what one that does not."""


@dataclass(frozen=True, eq=False)
class _Problems:
    """Those that have not ended: numbers [m], points [m, k], residuals, derivatives, cost and damping."""

    number: NDArray[np.intp]
    at: Array
    residual: Array
    jacobian: Array
    cost: Array
    damping: Array

    def only(self, kept: NDArray[np.bool_]) -> _Problems:
        return _Problems(*(getattr(self, field.name)[kept] for field in fields(self)))


def least_squares(residuals: Residuals, start: Array, low: float, high: float, tolerance: float, steps: int) -> Array:
    """Return the points [n, k] from `low` to `high` where n sums of squares are least, begun at points [n, k].

    A problem ends when a step lowers its cost by no more than `tolerance` of it or, where the step raises it, was not
    foretold to lower it by more; when none can; or after `steps`.
    """
    found = np.clip(start, low, high)
    problems = _evaluated(residuals, np.arange(len(found)), found, np.full(len(found), DAMPING))
    for _ in range(steps):
        if not len(problems.number):
            break
        at = _next(problems, low, high)
        least = tolerance * problems.cost
        is_worth_it = np.abs(_foretold(problems, at)) > least
        tried = _evaluated(residuals, problems.number, at, problems.damping)
        problems, ended = _better(problems, tried, least, is_worth_it)
        found[problems.number] = problems.at
        problems = problems.only(~ended)
    return found


def _evaluated(residuals: Residuals, number: NDArray[np.intp], at: Array, damping: Array) -> _Problems:
    residual, jacobian = residuals(at, number)
    return _Problems(number, at, residual, jacobian, np.sum(residual**2, axis=1), damping)


def _foretold(problems: _Problems, at: Array) -> Array:
    """Return by how much the cost [m] would fall at points [m, k], were residuals linear.

    It may rise where bounds hold a step, which a shorter one then mends.
    """
    step = (at - problems.at)[:, :, None]
    linear = problems.residual + (problems.jacobian @ step)[:, :, 0]
    return np.asarray(problems.cost - np.sum(linear**2, axis=1))


def _better(
    before: _Problems, tried: _Problems, least: Array, is_worth_it: NDArray[np.bool_]
) -> tuple[_Problems, NDArray[np.bool_]]:
    """Return of each problem the better one of both, and which of them have ended; a gain below `least` [m] is none."""
    lower = tried.cost <= before.cost
    ended = np.where(lower, before.cost - tried.cost <= least, ~is_worth_it | (before.damping > LARGEST_DAMPING))
    parts = {
        name: np.where(lower.reshape(-1, *[1] * (part.ndim - 1)), part, getattr(before, name))
        for name, part in vars(tried).items()
    }
    return replace(_Problems(**parts), damping=before.damping * np.where(lower, EASED, RAISED)), ended


def _next(problems: _Problems, low: float, high: float) -> Array:
    """Return the next points [m, k]: by damped Gauss-Newton steps, what would leave the bounds held on them."""
    transposed, at = problems.jacobian.transpose(0, 2, 1), problems.at
    normal, gradient = transposed @ problems.jacobian, (transposed @ problems.residual[:, :, None])[:, :, 0]
    np.einsum("nii->ni", normal)[:] *= 1 + problems.damping[:, None]
    held = ((at <= low) & (gradient > 0)) | ((at >= high) & (gradient < 0))
    step = np.zeros_like(at)
    for _ in range(at.shape[1]):
        step = _solved(normal, gradient, step, held)
        beyond = ~held & ((at + step < low) | (at + step > high))
        if not beyond.any():
            break
        step, held = np.clip(step, low - at, high - at), held | beyond
    return np.clip(at + step, low, high)


def _solved(normal: Array, gradient: Array, step: Array, held: NDArray[np.bool_]) -> Array:
    """Return the steps [m, k] that solve the normal equations in what is free; what is held keeps its step."""
    free, kept = ~held, np.where(held, step, 0.0)
    matrix = normal * (free[:, :, None] & free[:, None, :])
    np.einsum("nii->ni", matrix)[held] = 1.0
    right = np.where(free, -gradient - np.einsum("nij,nj->ni", normal, kept), kept)
    return np.asarray(np.linalg.solve(matrix, right[:, :, None])[:, :, 0])
