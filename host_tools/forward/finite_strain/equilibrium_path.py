"""A contact in equilibrium to the same contact in equilibrium at another indentation or force.

One step: predict with the tangent, relabel, correct by Newton, relabel and correct once more. The last pair makes the
state forget the steps that led to it: the slip is then spread from its own values. A step that fails is taken back
and halved.
"""

from __future__ import annotations

from math import copysign
from typing import Any

from ngsolve import InnerProduct

from host_tools.forward.face_state import MN_PER_N
from host_tools.forward.finite_strain.closed_contact import ClosedContact, push_of_back
from host_tools.forward.finite_strain.loaded_face import reaction_n
from host_tools.forward.finite_strain.newton import EnergyNewton, NewtonStatus
from host_tools.forward.press_model import PressFailed

LONGEST_STEP_MM, SHORTEST_STEP_MM = 1.0, 1 / 128
FORCE_TOLERANCE_RATIO = 1e-8
MAX_FORCE_STEPS = 100


class PathEnded(PressFailed):
    """A load that cannot be reached; says how far the press got (`reached_mm`, `reached_n`) and what to do."""

    def __init__(self, asked: str, reached_mm: float, reached_n: float, why: str) -> None:
        self.reached_mm, self.reached_n = reached_mm, reached_n
        super().__init__(
            f"{asked}, but the press could be followed only to {reached_mm:.4g} mm and {reached_n:.4g} N ({why}): "
            "press less, or make the elements at the rims larger."
        )


class EquilibriumPath:
    """Follows one contact, from the undeformed state on; it always stands in equilibrium at `indentation_mm`."""

    def __init__(self, contact: ClosedContact) -> None:
        self.contact = contact
        self.newton = EnergyNewton(contact.energy, contact.u, contact.free)
        self.indentation_mm, self.newton_iterations = 0.0, 0
        self._step_mm, self._ended = LONGEST_STEP_MM, NewtonStatus.CONVERGED
        self._back = push_of_back(contact.u.space).vec

    @property
    def force_n(self) -> float:
        """The force on the back."""
        return reaction_n(self.contact, "back")

    def press_to(self, indentation_mm: float) -> None:
        """Move the back to an indentation; raise `PathEnded`, standing at the last one reached, if it cannot be."""
        while (rest_mm := indentation_mm - self.indentation_mm) != 0:
            step_mm = copysign(min(abs(rest_mm), self._step_mm), rest_mm)
            if self._advance(step_mm):
                self.indentation_mm = indentation_mm if step_mm == rest_mm else self.indentation_mm + step_mm
                self._step_mm = min(2 * self._step_mm, LONGEST_STEP_MM)
            elif abs(step_mm) > SHORTEST_STEP_MM:
                self._step_mm = abs(step_mm) / 2
            else:
                raise self.failed(f"indentation_mm is {indentation_mm:g}", self._ended)

    def push_to(self, force_n: float) -> None:
        """Move the back until it carries a force, by Newton's method on force over indentation."""
        asked = f"force_n is {force_n:g}"
        for _ in range(MAX_FORCE_STEPS):
            rest_n = force_n - self.force_n
            if abs(rest_n) <= FORCE_TOLERANCE_RATIO * force_n:
                return
            stiffness = self._motion()[1]
            if stiffness <= 0:
                raise self.failed(asked, self._ended)
            step_mm = max(-LONGEST_STEP_MM, min(rest_n / stiffness, LONGEST_STEP_MM))
            try:
                self.press_to(self.indentation_mm + step_mm)
            except PathEnded as failure:
                if failure.reached_n < force_n:  # else the force was passed on the way and is sought from above
                    raise self.failed(asked, self._ended) from failure
        raise self.failed(asked, self._ended)

    def failed(self, asked: str, status: NewtonStatus) -> PathEnded:
        """Return the exception that says what was asked for, where the path stands and how Newton's method ended."""
        return PathEnded(asked, self.indentation_mm, self.force_n, f"Newton's method: {status}")

    def _motion(self) -> tuple[Any, float]:
        """Return how all unknowns move per mm of the back, and the stiffness in N/mm."""
        tangent, push = self.newton.energy.mat, self.contact.push.vec
        rate, force = push.CreateVector(), push.CreateVector()
        force.data = tangent * push
        rate.data = push - self.newton.direction(force)
        force.data = tangent * rate
        return rate, float(InnerProduct(force, self._back)) / MN_PER_N

    def _advance(self, step_mm: float) -> bool:
        """Try one step; return whether it arrived, else stand where it began."""
        start = [vector.Copy() for vector in self.contact.memory]
        self.contact.u.vec.data += step_mm * self._motion()[0]
        if self._correct() and self._correct():
            return True
        for vector, before in zip(self.contact.memory, start, strict=True):
            vector.data = before
        self.newton.assemble()
        return False

    def _correct(self) -> bool:
        """Relabel and find the equilibrium; return whether it was found."""
        if not self.contact.relabel():
            self._ended = NewtonStatus.FOLDED
            return False
        descent = self.newton.descend()
        self.newton_iterations += descent.iterations
        self._ended = descent.status
        return descent.status is NewtonStatus.CONVERGED
