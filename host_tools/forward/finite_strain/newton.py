"""A start to the minimum of an energy: Newton's method with a line search that only ever accepts finite energies.

The factorised tangent outlives a call: next to a minimum it serves as it is (the chord method), which costs a fifth of
a fresh one; it is renewed whenever a step with it falls short.
Source: Nocedal & Wright, Numerical Optimization (2006), sections 3.1-3.4; Kelley, Iterative Methods (1995), 5.4.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from math import inf, isfinite
from typing import Any

from ngsolve import InnerProduct

TOLERANCE_RATIO = 1e-18
"""Converged when the energy still to gain, over the energy, is below this: displacements to some 1e-9."""
QUADRATIC_RATIO = 1e-6
"""Below this the energy differences drown in rounding, and a full step is safe."""
CHORD_RATIO = 1e-2
"""A tangent is kept while every step with it lowers the energy still to gain at least so much."""
STIFFENING = (0.1, 1.0, 10.0)
"""Shares of the first, positive tangent that are added in turn to one that is not positive."""
MAX_ITERATIONS = 25
MAX_HALVINGS = 10


class NewtonStatus(StrEnum):
    """How a descent ended."""

    CONVERGED = "converged"
    UNFINISHED = "unfinished"
    """The iterations were used up on the way down."""
    STALLED = "stalled"
    """No step, however short, lowers the energy, or the tangent is not positive."""
    FOLDED = "folded"
    """The energy or its gradient is no number: an element is inside out."""


@dataclass(frozen=True)
class Descent:
    """The end of a descent: status, iterations made, and the last energy to gain (in the energy's unit)."""

    status: NewtonStatus
    iterations: int
    decrement: float


class EnergyNewton:
    """Minimises one energy, a bilinear form made of energies, over the free dofs of one grid function.

    The grid function must start where the tangent is positive, as at rest.
    """

    def __init__(self, energy: Any, u: Any, free: Any) -> None:
        self.energy, self.u, self.free = energy, u, free
        self.gradient, self.step, self.start = (u.vec.CreateVector() for _ in range(3))
        energy.AssembleLinearization(u.vec)
        self.inverse = energy.mat.Inverse(free, "sparsecholesky")
        self.first_tangent = energy.mat.AsVector().Copy()

    def assemble(self) -> None:
        """Form and factorise the tangent of the present state."""
        self.energy.AssembleLinearization(self.u.vec)
        self.inverse.Update()

    def direction(self, right_side: Any) -> Any:
        """Return the tangent's answer to a load on the free dofs, as a new vector."""
        answer = self.u.vec.CreateVector()
        answer.data = self.inverse * right_side
        return answer

    def descend(self, max_iterations: int = MAX_ITERATIONS, tolerance_ratio: float = TOLERANCE_RATIO) -> Descent:
        """Move the grid function to the minimum; whatever the status, it is left at the lowest state found."""
        level, decrement = float(self.energy.Energy(self.u.vec)), inf
        if not isfinite(level):
            return Descent(NewtonStatus.FOLDED, 0, decrement)
        for iteration in range(1, max_iterations + 1):
            previous, decrement = decrement, self.newton_step()
            if not 0 <= decrement <= CHORD_RATIO * previous:
                decrement = self._renewed_step()
            if not decrement >= 0:
                return Descent(
                    NewtonStatus.STALLED if isfinite(decrement) else NewtonStatus.FOLDED, iteration, decrement
                )
            lower = self._line_search(level, decrement)
            if lower is None:
                return Descent(NewtonStatus.STALLED, iteration, decrement)
            level = lower
            if decrement <= tolerance_ratio * abs(level):
                return Descent(NewtonStatus.CONVERGED, iteration, decrement)
        return Descent(NewtonStatus.UNFINISHED, max_iterations, decrement)

    def newton_step(self) -> float:
        """Compute the step with the tangent at hand; return its decrement g . K^-1 g, twice the energy to gain."""
        self.energy.Apply(self.u.vec, self.gradient)
        self.step.data = self.inverse * self.gradient
        return float(InnerProduct(self.step, self.gradient))

    def _renewed_step(self) -> float:
        """Compute the step with a fresh tangent; where that is not positive, with enough of the first one added."""
        self.assemble()
        decrement = self.newton_step()
        for share in STIFFENING:
            if decrement >= 0:
                break
            self.energy.mat.AsVector().data += share * self.first_tangent
            self.inverse.Update()
            decrement = self.newton_step()
        return decrement

    def _line_search(self, level: float, decrement: float) -> float | None:
        """Take the longest halved step that lowers the energy; return the new energy, None if there is none."""
        self.start.data = self.u.vec
        if decrement <= QUADRATIC_RATIO * abs(level):
            self.u.vec.data -= self.step
            return level
        for halving in range(MAX_HALVINGS):
            self.u.vec.data = self.start - 0.5**halving * self.step
            lower = float(self.energy.Energy(self.u.vec))
            if isfinite(lower) and lower <= level:
                return lower
        self.u.vec.data = self.start
        return None
