"""What a way of sliding must offer to be pressed: unknowns, their energy, and how the tissue is relabelled meanwhile.

Probe and tissue share the mesh of the face and its normal displacement, so the face can neither open nor penetrate.
"""

from __future__ import annotations

from typing import Any, Protocol, Self

from ngsolve import GridFunction

RADIAL, AXIAL = 0, 1
"""Components of the unknowns: u_r (of the probe) and u_z (of both bodies); the third one makes the face slide."""


def push_of_back(space: Any) -> Any:
    """Return the grid function of a space of unknowns in which the back of the probe has moved down by 1 mm."""
    push = GridFunction(space)
    push.components[AXIAL].Set(-1.0, definedon=space.mesh.Boundaries("back"))
    return push


class ClosedContact(Protocol):
    """Probe and tissue of one mesh, in closed frictionless contact."""

    mesh: Any
    order: int
    u: Any
    """Grid function of the three unknowns in mm: u_r, u_z, and the one of sliding."""
    free: Any
    """Bit array of the dofs to be solved for."""
    energy: Any
    """Stored energy of both bodies (uJ) as a bilinear form."""
    fast_energy: Any
    """The same, as fast as it can be; for the mesh as it was when the contact was made."""
    probe_energy: Any
    """Stored energy of the probe alone; its gradient on the face is the contact force."""
    push: Any
    """How the held unknowns move for each mm of indentation, as a grid function."""

    @property
    def memory(self) -> tuple[Any, ...]:
        """The vectors that make up the state: writing them back restores it."""

    def hold(self, indentation_mm: float) -> None:
        """Set the held unknowns to those of an indentation, where the state of other materials was taken over."""

    def relabel(self) -> bool:
        """Choose the tissue's labels afresh, which changes no physics; return whether they are still in order."""

    def slip_mm(self) -> Any:
        """Return, on the face, the radius of the tissue's material point minus that of the probe's (grid function)."""

    def at_order(self, order: int) -> Self:
        """Return the same contact, undeformed, in spaces of another order."""

    def copy_from(self, other: Self) -> None:
        """Take over the state of a contact of the same or a lower order, exactly."""
