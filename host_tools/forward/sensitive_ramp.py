"""A scene and a list of forces to the face at each, with and without the lump, and how both change with the scene.

Both are solved on one mesh: what the mesh alone makes of a change of size or depth is then the same in both, and drops
out of their difference. Finite strain follows one load path with true sliding; small strain scales one solve.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal

from device.measurement.quantities import InvalidQuantity
from host_tools.forward.equilibrium import LinearEquilibrium, SlidingEquilibrium
from host_tools.forward.equilibrium_path import EquilibriumPath
from host_tools.forward.face_state import Rays
from host_tools.forward.linear_press import LinearPress
from host_tools.forward.materials import Elasticity, Parts, baseline, only, with_inclusion
from host_tools.forward.mesh_velocity import lump_of, mesh_velocities
from host_tools.forward.newton import EnergyNewton, Status
from host_tools.forward.plan import BLUNT, STANDARD, ModelPlan, model_plan
from host_tools.forward.sensitivity import FaceSensitivity, face_sensitivity
from host_tools.forward.sliding import SlidingContact
from host_tools.forward.sliding_parts import SlidingParts
from host_tools.forward.tiers import build
from host_tools.scene import Press, Scene

Strain = Literal["small", "finite"]
ORDER = 3
ORDERS = (ORDER, ORDER + 1)
"""Orders of the elements: what differs between them is theirs, not the lump's."""
NEAR_RATIO = 0.02
"""A force met so closely is near enough; the rest is taken along the derivative by the force."""


@dataclass(frozen=True)
class LumpSensitivity:
    """The same force on one mesh, with the lump and without it, along the rays of both faces."""

    force_n: float
    rays: Rays
    pressed: FaceSensitivity
    bare: FaceSensitivity


Ramps = dict[int, tuple[LumpSensitivity, ...]]
"""By the order of the elements, both faces at every force."""
Faces = dict[int, FaceSensitivity]
"""By the order of the elements, one face at one force."""


def sensitive_ramp(scene: Scene, forces_n: Sequence[float], *, strain: Strain = "finite") -> Ramps:
    """Return both faces and their derivatives at ascending forces (N), by elements of two orders on one mesh.

    Raise `InvalidQuantity` for a scene without a lump, off the axis, with layered tissue or too near to
    incompressibility, and `PressFailed` for a force that cannot be reached.
    """
    # any modulus but the tissue's own, so that the lump is meshed: one ramp without it serves every modulus
    stiffer = replace(lump_of(scene), youngs_modulus_kpa=2 * scene.tissue.youngs_modulus_kpa)
    bare = _bare_ramp(replace(scene, inclusion=stiffer), tuple(forces_n), strain)
    with_lump = with_inclusion(scene)
    parts = {"youngs_modulus_kpa": only(with_lump, "inclusion"), "tissue_modulus_kpa": only(with_lump, "tissue")}
    ramp = _Ramp(scene, _plan(scene, forces_n, strain), with_lump, parts)
    pressed = ramp.at(forces_n, [without[ORDER].face.indentation_mm for without in bare])
    rays, loads = ramp.meshed.rays, list(zip(forces_n, pressed, bare, strict=True))
    return {
        order: tuple(LumpSensitivity(force, rays, lump[order], without[order]) for force, lump, without in loads)
        for order in ORDERS
    }


def _plan(scene: Scene, forces_n: Sequence[float], strain: Strain) -> ModelPlan:
    plan = model_plan(scene.with_press(Press(force_n=max(forces_n))), strain=strain)
    if plan.symmetry != "axisymmetric" or plan.contact == "unilateral" or plan.formulation == "mixed":
        reasons = "; ".join(plan.reasons[choice] for choice in ("symmetry", "contact", "formulation"))
        raise InvalidQuantity("scene", reasons, "round about the axis, flat-faced and compressible", "simplify it")
    grading = (BLUNT if strain == "finite" else STANDARD).grading
    return replace(plan, grading=grading, order=ORDER)


@lru_cache(maxsize=2)
def _bare_ramp(scene: Scene, forces_n: tuple[float, ...], strain: Strain) -> tuple[Faces, ...]:
    without_lump = baseline(scene)
    parts = {"tissue_modulus_kpa": only(without_lump, "tissue", "inclusion")}
    return _Ramp(scene, _plan(scene, forces_n, strain), without_lump, parts).at(forces_n, None)


class _Ramp:
    """One scene made of some materials, to be pressed with ascending forces."""

    def __init__(self, scene: Scene, plan: ModelPlan, elasticity: Elasticity, parts: Parts) -> None:
        self.plan, self.elasticity, self.parts = plan, elasticity, parts
        self.meshed = build(scene, plan)
        self.velocities = mesh_velocities(scene, self.meshed.mesh)

    def at(self, forces_n: Sequence[float], near_mm: Sequence[float] | None) -> tuple[Faces, ...]:
        """Return the face at every force; `near_mm` are indentations that nearly make them, if any are known."""
        if self.plan.strain == "finite":
            return tuple(self._finite(forces_n, near_mm))
        units = {order: self._unit(order) for order in ORDERS}
        return tuple(
            {order: unit.scaled(force_n / unit.face.force_n) for order, unit in units.items()} for force_n in forces_n
        )

    def _unit(self, order: int) -> FaceSensitivity:
        linear = LinearPress(self.meshed.mesh, self.meshed.symmetry, order)
        press = LinearEquilibrium(linear, self.elasticity, self.parts, self.meshed.sampler)
        return face_sensitivity(press, self.velocities)

    def _finite(self, forces_n: Sequence[float], near_mm: Sequence[float] | None) -> Iterator[Faces]:
        contacts = {order: SlidingContact(self.meshed.mesh, self.elasticity, order) for order in ORDERS}
        parts = {order: SlidingParts(contact, self.parts, self.velocities) for order, contact in contacts.items()}
        path = EquilibriumPath(contacts[ORDER])
        for i, force_n in enumerate(forces_n):
            if near_mm is None:
                path.push_to(force_n)
            else:
                _press_near(path, force_n, near_mm[i])
            newtons = {ORDER: path.newton, ORDER + 1: _refined(path, contacts)}
            faces = {}
            for order, newton in newtons.items():
                press = SlidingEquilibrium(
                    contacts[order], newton, path.indentation_mm, parts[order], self.meshed.sampler
                )
                faces[order] = face_sensitivity(press, self.velocities).at_force(force_n)
            yield faces


def _press_near(path: EquilibriumPath, force_n: float, near_mm: float) -> None:
    """Press to within `NEAR_RATIO` of a force: meeting it takes twice as long, and the rest is all but linear."""
    path.press_to(near_mm)
    while abs(path.force_n / force_n - 1) > NEAR_RATIO:
        path.press_to(path.indentation_mm * force_n / path.force_n)


def _refined(path: EquilibriumPath, contacts: Mapping[int, SlidingContact]) -> EnergyNewton:
    """Bring the contact of the next order into equilibrium where the path stands; return its Newton's method."""
    finer = contacts[ORDER + 1]
    finer.copy_from(contacts[ORDER])
    newton = EnergyNewton(finer.energy, finer.u, finer.free)
    descent = newton.descend()
    if descent.status is not Status.CONVERGED:
        raise path.failed(f"the derivatives at order {finer.order} are asked for", descent.status)
    return newton
