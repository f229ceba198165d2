"""What every tier offers: materials and presses in, the face at each press out.

What can go wrong while a scene is solved, as opposed to a scene that cannot exist.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

from host_tools.forward.face_state import FaceState
from host_tools.forward.materials import Elasticity
from host_tools.scenes.scene import Press

if TYPE_CHECKING:
    from host_tools.forward.small_strain.element_residual import ElementResidual


class PressFailed(RuntimeError):  # noqa: N818 - reads as what it says
    """A press that no solution was found for; says how far it got and what to do."""

    reached_mm = 0.0
    """The indentation that it got to, where a load path was followed."""
    has_solution = False
    """Whether the press itself was found, and only what it errs was not."""


class Loaded(NamedTuple):
    """The face at one press, and by another order on the same mesh when an error estimate was asked for.

    Where the other order is the next lower one of displacements alone in axisymmetry, `residual` tells what each
    element owes to the step between them.
    """

    state: FaceState
    other: FaceState | None
    residual: ElementResidual | None = None


class PressModel(Protocol):
    """A meshed scene that can be pressed, with any materials.

    The other order is the next higher one where many scenes share a level, and the next lower one where a scene climbs
    from order to order, or where a higher one would take minutes.
    """

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press: all by indentation or all by force, ascending."""
        ...
