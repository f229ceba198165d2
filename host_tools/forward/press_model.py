"""What every tier offers: materials and presses in, the face at each press out.

What can go wrong while a scene is solved, as opposed to a scene that cannot exist.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from host_tools.forward.face_state import FaceState
from host_tools.forward.materials import Elasticity
from host_tools.scenes.scene import Press


class PressFailed(RuntimeError):  # noqa: N818 - reads as what it says
    """A press that no solution was found for; says how far it got and what to do."""


class Loaded(NamedTuple):
    """The face at one press, and by another order on the same mesh when an error estimate was asked for."""

    state: FaceState
    other: FaceState | None


class PressModel(Protocol):
    """A meshed scene that can be pressed, with any materials.

    The other order is the next higher one in axisymmetry, and the next lower one where that would take minutes.
    """

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press: all by indentation or all by force, ascending."""
        ...
