"""What a form does to a state: the forces it makes, and how they change when the mesh below the state is moved."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from host_tools.forward.derivatives.mesh_velocity import moved

StateVector = Any
"""An NGSolve vector over all unknowns of a press."""
STEP = 1e-4
"""Of a logarithm, in differences of the forces along a mesh velocity."""


def applied(form: Any, state: StateVector) -> StateVector:
    """Return a form's forces at a state, as a new vector."""
    forces = state.CreateVector()
    form.Apply(state, forces)
    return forces


def product(matrix: Any, motion: StateVector) -> StateVector:
    """Return a matrix times a vector, as a new vector."""
    forces = motion.CreateVector()
    forces.data = matrix * motion
    return forces


def along(velocity: Any, mesh: Any, forces: Callable[[], StateVector]) -> StateVector:
    """Return the derivative of forces at a fixed state along a mesh velocity."""
    with moved(mesh, velocity, STEP):
        change = forces()
    with moved(mesh, velocity, -STEP):
        change -= forces()
    change *= 0.5 / STEP
    return change
