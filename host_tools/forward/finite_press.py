"""Finite strain as a `PressModel`: one load path through all presses, with true sliding or with paired points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from host_tools.forward.face_state import Rays
from host_tools.forward.load_path import ContactName, press_along, press_to_forces
from host_tools.forward.materials import Elasticity
from host_tools.forward.press_model import Loaded
from host_tools.scene import Press


class FiniteStrainModel:
    """Neo-Hookean probe and tissue in axisymmetry; every press on the way is kept."""

    def __init__(self, mesh: Any, order: int, rays: Rays, *, contact: ContactName) -> None:
        self.mesh, self.order, self.rays, self.contact = mesh, order, rays, contact

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press; raise `PressFailed` for one that is out of reach."""
        indentations_mm = [press.indentation_mm for press in presses if press.indentation_mm is not None]
        forces_n = [press.force_n for press in presses if press.force_n is not None]
        along, loads = (press_along, indentations_mm) if indentations_mm else (press_to_forces, forces_n)
        faces = along(
            self.mesh,
            elasticity,
            loads,
            order=self.order,
            contact=self.contact,
            rays=self.rays,
            estimate_error=estimate_error,
        )
        return tuple(Loaded(face.face, face.refined) for face in faces)
