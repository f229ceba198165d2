"""A plan to the model that carries it out: the mesh, the tier, and the element sizes of each named level."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

from netgen.meshing import NgException

from host_tools.forward.face_state import Rays
from host_tools.forward.materials import baseline
from host_tools.forward.meshes.mesh import Resolution, axisymmetric_mesh
from host_tools.forward.meshes.morph import morphed_mesh
from host_tools.forward.meshes.solid_mesh import COARSE, LAYERED, SolidResolution, solid_mesh
from host_tools.forward.plan import GRADED, ModelPlan
from host_tools.forward.press_model import PressFailed, PressModel
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.linear_model import LinearModel
from host_tools.forward.small_strain.off_axis_inclusion import (
    ROUND_ORDER,
    OffAxisModel,
    RoundBody,
    is_round_but_for_inclusion,
)
from host_tools.forward.symmetry import AXISYMMETRIC, SOLID, Symmetry
from host_tools.scenes.scene import Placement, Scene

AXISYMMETRIC_SIZES = {
    "coarse": Resolution(bulk_mm=4.0, contact_rim_mm=0.1, back_rim_mm=0.1, per_inclusion=10.0),
    "standard": Resolution(),
    GRADED: Resolution(bulk_mm=4.0, contact_rim_mm=0.1, back_rim_mm=0.1, per_inclusion=8.0, grading=0.5, rim_layers=5),
    "sliding_coarse": Resolution(bulk_mm=4.0, contact_rim_mm=0.5, back_rim_mm=0.02, per_inclusion=10.0, grading=0.5),
    "sliding": Resolution(bulk_mm=4.0, contact_rim_mm=0.2, back_rim_mm=0.02, per_inclusion=10.0, grading=0.5),
    "sliding_fine": Resolution(
        bulk_mm=3.0, face_mm=0.8, contact_rim_mm=0.1, back_rim_mm=0.01, per_inclusion=12.0, grading=0.5
    ),
    "blunt": Resolution(bulk_mm=4.0, contact_rim_mm=0.5, back_rim_mm=0.5, per_inclusion=10.0, grading=0.5),
    "blunt_rim": Resolution(bulk_mm=4.0, contact_rim_mm=0.3, back_rim_mm=0.3, per_inclusion=10.0, grading=0.5),
    "blunt_fine": Resolution(bulk_mm=2.0, face_mm=0.5, contact_rim_mm=0.3, back_rim_mm=0.3, grading=0.4),
}
"""Element sizes by the name of the level. Those of finite strain keep the contact's rim coarser than its slip: "blunt"
ones, of data sets, both rims, "sliding" ones of a climb only that, since the bonded rim does not slip."""

SOLID_SIZES = {"coarse": COARSE, "standard": SolidResolution(), GRADED: LAYERED}
SOLID_ANGLES = 48
"""Rays over the face of a 3-D scene: 7.5 degrees apart, a multiple of eight to meet a square's corners."""


class Meshed(NamedTuple):
    """A model ready to be pressed, and what it stands on."""

    model: PressModel
    mesh: Any
    symmetry: Symmetry
    sampler: FaceSampler
    rays: Rays

    @property
    def elements(self) -> int:
        """Number of elements."""
        return int(self.mesh.ne)


def build(scene: Scene, plan: ModelPlan) -> Meshed:
    """Mesh a scene (turned so that its inclusion lies on +x) and return the model of the plan."""
    axisymmetric = plan.symmetry == "axisymmetric"
    symmetry, mesh = (AXISYMMETRIC if axisymmetric else SOLID), _mesh(scene, plan)
    rays = Rays.over(scene.waveguide, 1 if axisymmetric else SOLID_ANGLES)
    sampler = FaceSampler(mesh, rays, plan.symmetry)
    climbs = plan.grading == GRADED or not axisymmetric
    probe, other_order = scene.waveguide, plan.order - 1 if climbs else plan.order + 1
    mixed = plan.formulation == "mixed"
    model: PressModel
    if plan.strain == "finite":
        from host_tools.forward.finite_strain.load_path import FiniteStrainModel

        model = FiniteStrainModel(mesh, plan.order, rays)
    elif plan.contact == "unilateral":
        from host_tools.forward.small_strain.domed_press import DomedModel

        model = DomedModel(
            mesh,
            symmetry,
            sampler,
            order=plan.order,
            other_order=other_order,
            mixed=mixed,
            curvature_per_mm=probe.dome_mm / probe.radius_mm**2,
        )
    elif plan.grading == GRADED and not axisymmetric and not mixed and is_round_but_for_inclusion(scene):
        model = OffAxisModel(mesh, sampler, _without_inclusion(scene), order=plan.order, other_order=other_order)
    else:
        model = LinearModel(mesh, symmetry, sampler, order=plan.order, other_order=other_order, mixed=mixed)
    return Meshed(model, mesh, symmetry, sampler, rays)


def _without_inclusion(scene: Scene) -> RoundBody:
    """Return the body of a scene in axisymmetry, which it has but for the inclusion."""
    plain = replace(scene, inclusion=None, placement=Placement())
    mesh = axisymmetric_mesh(plain, order=ROUND_ORDER, resolution=AXISYMMETRIC_SIZES[GRADED])
    return RoundBody(mesh, baseline(scene), FaceSampler(mesh, Rays.over(scene.waveguide), "axisymmetric"))


def _mesh(scene: Scene, plan: ModelPlan) -> Any:
    try:
        return _generate(scene, plan)
    except NgException as error:
        raise PressFailed(
            f"the scene could not be meshed ({error}): two of its surfaces are all but in touch, move them apart"
        ) from error


def _generate(scene: Scene, plan: ModelPlan) -> Any:
    if plan.symmetry != "axisymmetric":
        return solid_mesh(scene, symmetry=plan.symmetry, order=plan.order, resolution=SOLID_SIZES[plan.grading])
    sizes = AXISYMMETRIC_SIZES[plan.grading]
    if plan.mesh == "morphed" and plan.grading != GRADED:
        return morphed_mesh(scene, order=plan.order, resolution=sizes)
    return axisymmetric_mesh(scene, order=plan.order, resolution=sizes)
