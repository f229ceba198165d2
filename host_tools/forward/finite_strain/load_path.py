"""A mesh, its materials and a list of indentations or forces to the loaded face at each of them, in finite strain.

The steps between the loads are chosen by `equilibrium_path.py`; a load that cannot be reached is an exception that
says how far the press got, never a number. As a `PressModel`, one load path runs through all presses, with true
sliding.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from itertools import pairwise
from math import inf
from typing import Any

from device.measurement.quantities import InvalidQuantity
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.finite_strain.closed_contact import ClosedContact
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath, State
from host_tools.forward.finite_strain.loaded_face import LoadedFace, face_state, reaction_n
from host_tools.forward.finite_strain.newton import EnergyNewton, NewtonStatus
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import Elasticity
from host_tools.forward.press_model import Loaded
from host_tools.forward.sampling import FaceSampler
from host_tools.scenes.scene import Press

REFINING_ITERATIONS = 1
"""One correction finds the change of the inclusion field from order 3 to 4 to 15 % up to 2 mm, half of it at 3 mm."""


def press_along(
    mesh: Any,
    elasticity: Elasticity,
    indentations_mm: Sequence[float],
    *,
    order: int,
    rays: Rays,
    estimate_error: bool = False,
    edge_force: bool = False,
) -> tuple[LoadedFace, ...]:
    """Return the face at every one of ascending indentations (mm), with its refined copy if errors are wanted.

    `edge_force` asks for the other reading of the rim (`sliding.py`), which only comparisons
    need. Raises `InvalidQuantity` for indentations that do not ascend from above 0, `PathEnded` for one out of reach,
    and `ErrorUnknown` for one whose refined copy is.
    """
    _require_ascending("indentations_mm", indentations_mm)
    press = _Press(SlidingContact(mesh, elasticity, order, edge_force=edge_force), rays, estimate_error)
    return tuple(press.face_after(press.path.press_to, load) for load in indentations_mm)


def press_to_forces(
    mesh: Any,
    elasticity: Elasticity,
    forces_n: Sequence[float],
    *,
    order: int,
    rays: Rays,
    estimate_error: bool = False,
    arrivals: dict[float, State] | None = None,
) -> tuple[LoadedFace, ...]:
    """Return the face at every one of ascending forces (N), met to 1e-8; otherwise as `press_along`.

    `arrivals` are states of other materials on the same mesh, near which these are sought, and take in these.
    """
    _require_ascending("forces_n", forces_n)
    press = _Press(SlidingContact(mesh, elasticity, order), rays, estimate_error, arrivals)
    faces = tuple(press.face_after(press.path.push_to, load) for load in forces_n)
    if arrivals is not None:
        arrivals.update(press.path.arrivals)
    return faces


def _require_ascending(quantity: str, loads: Sequence[float]) -> None:
    if not loads or not all(0 <= a < b < inf for a, b in pairwise((0.0, *loads))):
        raise InvalidQuantity(
            quantity, list(loads), "ascending, finite and above 0", "sort the loads, drop repeated ones"
        )


class _Press:
    """Drives one path from load to load and reads the face at each."""

    def __init__(
        self,
        contact: ClosedContact,
        rays: Rays,
        estimate_error: bool,
        arrivals: Mapping[float, State] | None = None,
    ) -> None:
        self.path = EquilibriumPath(contact, arrivals)
        self.sampler = FaceSampler(contact.mesh, rays, "axisymmetric")
        self.finer = contact.at_order(contact.order + 1) if estimate_error else None

    def face_after(self, move: Callable[[float], None], load: float) -> LoadedFace:
        contact, began, iterations = self.path.contact, time.perf_counter(), self.path.newton_iterations
        move(load)
        face = face_state(contact, self.path.indentation_mm, self.sampler)
        refined = self._refined()
        return LoadedFace(
            face=face,
            slip_mm=self.sampler(contact.slip_mm()),
            base_force_n=-reaction_n(contact, "base"),
            energy_uj=float(contact.fast_energy.Energy(contact.u.vec)),
            newton_iterations=self.path.newton_iterations - iterations,
            seconds=time.perf_counter() - began,
            refined=refined,
        )

    def _refined(self) -> FaceState | None:
        """Return the face after Newton corrections at the next order, from the present state."""
        if self.finer is None:
            return None
        self.finer.copy_from(self.path.contact)
        descent = EnergyNewton(self.finer.fast_energy, self.finer.u, self.finer.free).descend(REFINING_ITERATIONS)
        if descent.status in (NewtonStatus.FOLDED, NewtonStatus.STALLED):
            raise self.path.without_error(self.finer.order, descent.status)
        return face_state(self.finer, self.path.indentation_mm, self.sampler)


class FiniteStrainModel:
    """Neo-Hookean probe and tissue in axisymmetry; every press on the way is kept.

    What was pressed first, usually the tissue without its inclusion, leads whatever is pressed after it.
    """

    def __init__(self, mesh: Any, order: int, rays: Rays) -> None:
        self.mesh, self.order, self.rays = mesh, order, rays
        self._arrivals: dict[float, State] = {}

    def press(self, elasticity: Elasticity, presses: Sequence[Press], *, estimate_error: bool) -> tuple[Loaded, ...]:
        """Return the face at every press; raise `PathEnded` or `ErrorUnknown` as `press_along` does."""
        indentations_mm = [press.indentation_mm for press in presses if press.indentation_mm is not None]
        forces_n = [press.force_n for press in presses if press.force_n is not None]
        mesh, order, rays = self.mesh, self.order, self.rays
        if indentations_mm:
            faces = press_along(
                mesh, elasticity, indentations_mm, order=order, rays=rays, estimate_error=estimate_error
            )
        else:
            faces = press_to_forces(
                mesh,
                elasticity,
                forces_n,
                order=order,
                rays=rays,
                estimate_error=estimate_error,
                arrivals=self._arrivals,
            )
        return tuple(Loaded(face.face, face.refined) for face in faces)
