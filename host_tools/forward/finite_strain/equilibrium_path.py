"""A contact in equilibrium to the same contact in equilibrium at another indentation or force.

One step: predict with the tangent, relabel, correct by Newton, relabel and correct once more. The last pair makes the
state forget the steps that led to it: the slip is then spread from its own values. A step that fails is taken back
and halved.

A force is met by Newton's method in all unknowns and the indentation together, from a step of the tangent or from what
other materials had at this force; the labels are then spread until they change nothing, so neither shows.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import copysign, inf, isfinite, nan
from typing import Any, NamedTuple

import numpy as np
from ngsolve import InnerProduct

from host_tools.forward.face_state import MN_PER_N
from host_tools.forward.finite_strain.closed_contact import ClosedContact, push_of_back
from host_tools.forward.finite_strain.loaded_face import reaction_n
from host_tools.forward.finite_strain.newton import (
    CHORD_RATIO,
    MAX_ITERATIONS,
    TOLERANCE_RATIO,
    EnergyNewton,
    NewtonStatus,
)
from host_tools.forward.press_model import PressFailed

LONGEST_STEP_MM, SHORTEST_STEP_MM = 1.0, 1 / 128
FORCE_TOLERANCE_RATIO = 1e-8
ROUGH_RATIO = 1e-8
"""As `TOLERANCE_RATIO`, of an equilibrium whose slip only spreads the labels of the next: displacements to 1e-4."""
MAX_FORCE_STEPS = 100
SETTLED_RATIO, MAX_RELABELLINGS = 1e-12, 40
"""Once new labels leave less than this share of the energy to gain, the next ones are the last."""


class State(NamedTuple):
    """Where a path stood: the indentation, and the vectors of the contact's memory."""

    indentation_mm: float
    vectors: tuple[Any, ...]


class PathEnded(PressFailed):
    """A load that cannot be reached; says how far the press got (`reached_mm`, `reached_n`) and what to do."""

    said = "{asked}, but the press could be followed only to {mm:.4g} mm and {n:.4g} N ({why}): press less."

    def __init__(self, asked: str, reached_mm: float, reached_n: float, why: str) -> None:
        self.asked, self.reached_mm, self.reached_n, self.why = asked, reached_mm, reached_n, why
        super().__init__(self.said.format(asked=asked, mm=reached_mm, n=reached_n, why=why))

    def __reduce__(self) -> tuple[type[PathEnded], tuple[str, float, float, str]]:
        """Carry the error to another process: an exception alone forgets what it was made of."""
        return type(self), (self.asked, self.reached_mm, self.reached_n, self.why)


class ErrorUnknown(PathEnded):
    """A load that was reached, where a correction at the next order does not converge: what it errs is not known."""

    has_solution = True
    said = "{asked} at {mm:.4g} mm and {n:.4g} N ({why}): press less."


class EquilibriumPath:
    """Follows one contact, from the undeformed state on; it always stands in equilibrium at `indentation_mm`."""

    def __init__(self, contact: ClosedContact, forerunner: Mapping[float, State] | None = None) -> None:
        """Take a contact at rest; `forerunner` are the arrivals of other materials on the same mesh."""
        self.contact, self.forerunner = contact, forerunner or {}
        self.arrivals: dict[float, State] = {}
        """The states at the forces that were asked for."""
        self.newton = EnergyNewton(contact.fast_energy, contact.u, contact.free)
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
        """Move the back until it carries a force; raise `PathEnded`, standing where it could be followed to."""
        asked = f"force_n is {force_n:g}"
        guess = self._guess(force_n)
        if guess and self._arrive_from(guess, force_n):
            return
        for _ in range(MAX_FORCE_STEPS):
            rest_n = force_n - self.force_n
            if abs(rest_n) <= FORCE_TOLERANCE_RATIO * force_n:
                return
            stiffness = self._motion()[1]
            if stiffness <= 0:
                raise self.failed(asked, self._ended)
            if abs(rest_n / stiffness) <= LONGEST_STEP_MM and self._arrive(rest_n / stiffness, force_n):
                return
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

    def without_error(self, order: int, status: NewtonStatus) -> ErrorUnknown:
        """Return the exception that says where the path stands, and that it is not known what it errs there."""
        asked = f"the press was found, but nothing near it at order {order},"
        return ErrorUnknown(asked, self.indentation_mm, self.force_n, f"Newton's method: {status}")

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
        if self._correct(ROUGH_RATIO) and self._correct():
            return True
        for vector, before in zip(self.contact.memory, start, strict=True):
            vector.data = before
        self.newton.assemble()
        return False

    def _arrive(self, step_mm: float, force_n: float) -> bool:
        """Try one step, about so long, that ends at a force; return whether it did, else stand where it began."""
        start = self._state()
        self.contact.u.vec.data += step_mm * self._motion()[0]
        self.indentation_mm += step_mm
        return self._arrived(self._correct(ROUGH_RATIO) and self._settle(force_n), force_n, start)

    def _arrive_from(self, guess: State, force_n: float) -> bool:
        """Try to reach a force from a state near by; return whether it was, else stand where it began."""
        start = self._state()
        self._stand_at(guess)
        self.contact.hold(self.indentation_mm)
        self.newton.assemble()
        return self._arrived(self._settle(force_n), force_n, start)

    def _arrived(self, is_there: bool, force_n: float, start: State) -> bool:
        """Keep the state that carries a force, or go back to the start."""
        if is_there:
            self.arrivals[force_n] = self._state()
        else:
            self._stand_at(start)
            self.newton.assemble()
        return is_there

    def _guess(self, force_n: float) -> State | None:
        """Return the state to expect at a force: what the forerunner has there, and this path had beside it so far.

        The difference is a polynomial of the force through all arrivals and 0. None where the forerunner was not.
        """
        if not {force_n, *self.arrivals} <= set(self.forerunner):
            return None
        known, ahead = np.array([0.0, *self.arrivals]), self.forerunner[force_n]
        indentation_mm, vectors = ahead.indentation_mm, [one.Copy() for one in ahead.vectors]
        for at_n, mine in self.arrivals.items():
            others, theirs = known[known != at_n], self.forerunner[at_n]
            weight = float(np.prod((force_n - others) / (at_n - others)))
            indentation_mm += weight * (mine.indentation_mm - theirs.indentation_mm)
            for guess, one, other in zip(vectors, mine.vectors, theirs.vectors, strict=True):
                guess.data += weight * one - weight * other
        return State(indentation_mm, tuple(vectors))

    def _state(self) -> State:
        return State(self.indentation_mm, tuple(vector.Copy() for vector in self.contact.memory))

    def _stand_at(self, state: State) -> None:
        for vector, of_state in zip(self.contact.memory, state.vectors, strict=True):
            vector.data = of_state
        self.indentation_mm = state.indentation_mm

    def _settle(self, force_n: float) -> bool:
        """Find equilibrium and indentation at a force; return whether they were found.

        Labels are spread anew until that changes the state no more, so that it forgets how it was reached.
        """
        level = abs(float(self.newton.energy.Energy(self.contact.u.vec)))
        changed = inf
        for _ in range(MAX_RELABELLINGS):
            if not self.contact.relabel():
                return False
            unsettled = changed > SETTLED_RATIO * level
            changed = self._balance(force_n, level * (ROUGH_RATIO if unsettled else TOLERANCE_RATIO))
            if not isfinite(changed):
                return False
            if not unsettled:
                return True
        return False

    def _balance(self, force_n: float, tolerance_uj: float) -> float:
        """Take full Newton steps in all unknowns and the indentation; return the first decrement, NaN if they fail."""
        newton, u, asked, after = self.newton, self.contact.u.vec, force_n * MN_PER_N, self.contact.u.vec.CreateVector()
        motion, first, previous = self._motion(), inf, inf
        for _ in range(MAX_ITERATIONS):
            self.newton_iterations += 1
            decrement = newton.newton_step()
            if not 0 <= decrement <= CHORD_RATIO * previous:
                newton.assemble()
                motion, decrement = self._motion(), newton.newton_step()
            if not 0 <= decrement < previous or motion[1] <= 0:
                return nan
            after.data = newton.gradient - newton.energy.mat * newton.step
            missing = asked - float(InnerProduct(after, self._back))
            shift_mm = missing / (motion[1] * MN_PER_N)
            u.data += shift_mm * motion[0] - newton.step
            self.indentation_mm += shift_mm
            first, previous = (first if isfinite(first) else decrement), decrement
            if decrement <= tolerance_uj and abs(missing) <= FORCE_TOLERANCE_RATIO * asked:
                return first
        return nan

    def _correct(self, tolerance_ratio: float = TOLERANCE_RATIO) -> bool:
        """Relabel and find the equilibrium; return whether it was found."""
        if not self.contact.relabel():
            self._ended = NewtonStatus.FOLDED
            return False
        descent = self.newton.descend(tolerance_ratio=tolerance_ratio)
        self.newton_iterations += descent.iterations
        self._ended = descent.status
        return descent.status is NewtonStatus.CONVERGED
