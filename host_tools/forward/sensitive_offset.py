"""A press beside the lump to its face and how that changes with the scene, in three dimensions and small strain.

In proportion to the force, so one solve serves any; finite strain has no three-dimensional model here. The meshes are
coarse: both orders show by how much that matters.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from host_tools.forward.equilibrium import LinearEquilibrium
from host_tools.forward.linear_press import LinearPress
from host_tools.forward.materials import Elasticity, Parts, baseline, only, with_inclusion
from host_tools.forward.mesh_velocity import mesh_velocities
from host_tools.forward.plan import model_plan
from host_tools.forward.sensitive_ramp import ORDERS, LumpSensitivity
from host_tools.forward.sensitivity import FaceSensitivity, face_sensitivity
from host_tools.forward.tiers import Meshed, build
from host_tools.scene import Scene

GRADING = "coarse"


def sensitive_offset(scene: Scene, offset_mm: float, force_n: float) -> dict[int, LumpSensitivity]:
    """Return, by the order of the elements, both faces and their derivatives when pressed beside the lump's centre.

    The lump is at angle 0; its place there is one of the quantities, `offset_x_mm`, and counts per mm. Raise
    `InvalidQuantity` as `sensitive_ramp` does.
    """
    aside = replace(scene, placement=replace(scene.placement, offset_x_mm=offset_mm))
    plan = replace(model_plan(aside), grading=GRADING)
    meshed = build(aside, plan)
    velocities = mesh_velocities(aside, meshed.mesh)
    with_lump, without_lump = with_inclusion(aside), baseline(aside)
    parts = {"youngs_modulus_kpa": only(with_lump, "inclusion"), "tissue_modulus_kpa": only(with_lump, "tissue")}
    bare_parts = {"tissue_modulus_kpa": only(without_lump, "tissue", "inclusion")}
    found = {}
    for order in ORDERS:
        pressed = _at_force(force_n, meshed, order, with_lump, parts, velocities)
        bare = _at_force(force_n, meshed, order, without_lump, bare_parts, velocities)
        found[order] = LumpSensitivity(force_n, meshed.rays, pressed, bare)
    return found


def _at_force(
    force_n: float, meshed: Meshed, order: int, elasticity: Elasticity, parts: Parts, velocities: dict[str, Any]
) -> FaceSensitivity:
    linear = LinearPress(meshed.mesh, meshed.symmetry, order)
    unit = face_sensitivity(LinearEquilibrium(linear, elasticity, parts, meshed.sampler), velocities)
    return unit.scaled(force_n / unit.face.force_n)
