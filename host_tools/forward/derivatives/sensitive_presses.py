"""A press to its face and how that changes with the scene: a ramp on the axis, or one force beside the inclusion.

Faces with and without the inclusion are solved on one mesh: what the mesh alone makes of a change of size or depth is
then the same in both, and drops out of their difference. Finite strain follows one load path with true sliding; small
strain scales one solve.

A press beside the inclusion is solved in three dimensions and small strain. It goes in proportion to the force, so one
solve serves any; finite strain has no three-dimensional model here. The meshes are coarse: both orders show by how much
that matters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, Literal

from device.measurement.quantities import InvalidQuantity
from host_tools.forward.derivatives.equilibrium import LinearEquilibrium, SlidingEquilibrium
from host_tools.forward.derivatives.mesh_velocity import inclusion_of, mesh_velocities
from host_tools.forward.derivatives.sensitivity import FaceSensitivity, face_sensitivity
from host_tools.forward.derivatives.sliding_parts import SlidingParts
from host_tools.forward.face_state import Rays
from host_tools.forward.finite_strain.equilibrium_path import EquilibriumPath
from host_tools.forward.finite_strain.newton import EnergyNewton, NewtonStatus
from host_tools.forward.finite_strain.sliding import SlidingContact
from host_tools.forward.materials import Elasticity, Parts, baseline, only, with_inclusion
from host_tools.forward.plan import BLUNT, STANDARD, ModelPlan, model_plan
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.tiers import Meshed, build
from host_tools.scenes.scene import Press, Scene

RampStrain = Literal["small", "finite"]
ORDER = 3
ORDERS = (ORDER, ORDER + 1)
"""Orders of the elements: what differs between them is theirs, not the inclusion's."""
NEAR_RATIO = 0.02
"""A force met so closely is near enough; the rest is taken along the derivative by the force."""


@dataclass(frozen=True)
class InclusionSensitivity:
    """The same force on one mesh, with the inclusion and without it, along the rays of both faces."""

    force_n: float
    rays: Rays
    pressed: FaceSensitivity
    baseline: FaceSensitivity


Ramps = dict[int, tuple[InclusionSensitivity, ...]]
"""By the order of the elements, both faces at every force."""
Faces = dict[int, FaceSensitivity]
"""By the order of the elements, one face at one force."""


def sensitive_ramp(scene: Scene, forces_n: Sequence[float], *, strain: RampStrain = "finite") -> Ramps:
    """Return both faces and their derivatives at ascending forces (N), by elements of two orders on one mesh.

    Raise `InvalidQuantity` for a scene without an inclusion, off the axis, with layered tissue or too near to
    incompressibility, and `PressFailed` for a force that cannot be reached.
    """
    # any modulus but the tissue's own, so that the inclusion is meshed: one ramp without it serves every modulus
    stiffer = replace(inclusion_of(scene), youngs_modulus_kpa=2 * scene.tissue.youngs_modulus_kpa)
    inclusion_free = _baseline_ramp(replace(scene, inclusion=stiffer), tuple(forces_n), strain)
    inclusion_materials = with_inclusion(scene)
    parts = {
        "youngs_modulus_kpa": only(inclusion_materials, "inclusion"),
        "tissue_modulus_kpa": only(inclusion_materials, "tissue"),
    }
    ramp = _Ramp(scene, _plan(scene, forces_n, strain), inclusion_materials, parts)
    pressed = ramp.at(forces_n, [without[ORDER].face.indentation_mm for without in inclusion_free])
    rays, loads = ramp.meshed.rays, list(zip(forces_n, pressed, inclusion_free, strict=True))
    return {
        order: tuple(
            InclusionSensitivity(force, rays, inclusion[order], without[order]) for force, inclusion, without in loads
        )
        for order in ORDERS
    }


def _plan(scene: Scene, forces_n: Sequence[float], strain: RampStrain) -> ModelPlan:
    plan = model_plan(scene.with_press(Press(force_n=max(forces_n))), strain=strain)
    if plan.symmetry != "axisymmetric" or plan.contact == "unilateral" or plan.formulation == "mixed":
        reasons = "; ".join(plan.reasons[choice] for choice in ("symmetry", "contact", "formulation"))
        raise InvalidQuantity("scene", reasons, "round about the axis, flat-faced and compressible", "simplify it")
    grading = (BLUNT if strain == "finite" else STANDARD).grading
    return replace(plan, grading=grading, order=ORDER)


@lru_cache(maxsize=2)
def _baseline_ramp(scene: Scene, forces_n: tuple[float, ...], strain: RampStrain) -> tuple[Faces, ...]:
    baseline_materials = baseline(scene)
    parts = {"tissue_modulus_kpa": only(baseline_materials, "tissue", "inclusion")}
    return _Ramp(scene, _plan(scene, forces_n, strain), baseline_materials, parts).at(forces_n, None)


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
    if descent.status is not NewtonStatus.CONVERGED:
        raise path.failed(f"the derivatives at order {finer.order} are asked for", descent.status)
    return newton


GRADING = "coarse"


def sensitive_offset(scene: Scene, offset_mm: float, force_n: float) -> dict[int, InclusionSensitivity]:
    """Return, by the order of the elements, both faces and their derivatives when pressed beside the centre.

    The inclusion is at angle 0; its place there is one of the quantities, `offset_x_mm`, and counts per mm. Raise
    `InvalidQuantity` as `sensitive_ramp` does.
    """
    aside = replace(scene, placement=replace(scene.placement, offset_x_mm=offset_mm))
    plan = replace(model_plan(aside), grading=GRADING)
    meshed = build(aside, plan)
    velocities = mesh_velocities(aside, meshed.mesh)
    inclusion_materials, baseline_materials = with_inclusion(aside), baseline(aside)
    parts = {
        "youngs_modulus_kpa": only(inclusion_materials, "inclusion"),
        "tissue_modulus_kpa": only(inclusion_materials, "tissue"),
    }
    baseline_parts = {"tissue_modulus_kpa": only(baseline_materials, "tissue", "inclusion")}
    found = {}
    for order in ORDERS:
        pressed = _at_force(force_n, meshed, order, inclusion_materials, parts, velocities)
        inclusion_free = _at_force(force_n, meshed, order, baseline_materials, baseline_parts, velocities)
        found[order] = InclusionSensitivity(force_n, meshed.rays, pressed, inclusion_free)
    return found


def _at_force(
    force_n: float, meshed: Meshed, order: int, elasticity: Elasticity, parts: Parts, velocities: dict[str, Any]
) -> FaceSensitivity:
    linear = LinearPress(meshed.mesh, meshed.symmetry, order)
    unit = face_sensitivity(LinearEquilibrium(linear, elasticity, parts, meshed.sampler), velocities)
    return unit.scaled(force_n / unit.face.force_n)
