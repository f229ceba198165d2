"""A scene to its solution: surface deformation w, contact pressure p, force, O1-O3, and the error of each.

The baseline is the *same mesh* with the inclusion made of tissue: separate meshes would put 50 % error on the smallest
inclusions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ngsolve import ngsglobals

from device.measurement.quantities import InvalidQuantity
from host_tools.forward.error_estimates.dual_error import dual_error
from host_tools.forward.error_estimates.stated_error import stated_error
from host_tools.forward.face_state import Rays
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import ModelPlan, aligned, model_plan
from host_tools.forward.press_model import Loaded, PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.soundness import require_sound
from host_tools.forward.tiers import Meshed, build
from host_tools.scenes.scene import Press, Scene

ngsglobals.msg_level = 0


def solve(scene: Scene, plan: ModelPlan | None = None, *, estimate_error: bool = False) -> Solution:
    """Solve a scene by a plan; without one, at the level that all data sets share."""
    return solve_ramp(scene, [scene.press], plan, estimate_error=estimate_error)[0]


def solve_ramp(
    scene: Scene, presses: Sequence[Press], plan: ModelPlan | None = None, *, estimate_error: bool = False
) -> tuple[Solution, ...]:
    """Solve a scene at several presses, all by indentation or all by force, ascending; `scene.press` is not used.

    In small strain one solve serves all; in finite strain one load path does. Raise `PressFailed` when a press is
    beyond what the model can reach, or its solution is none (`soundness.py`).
    """
    return solve_ramps([scene], presses, plan, estimate_error=estimate_error)[0]


def solve_ramps(
    scenes: Sequence[Scene], presses: Sequence[Press], plan: ModelPlan | None = None, *, estimate_error: bool = False
) -> tuple[tuple[Solution, ...], ...]:
    """Solve scenes that differ in nothing but the modulus of the inclusion: on one mesh, beside one baseline.

    Each as `solve_ramp`, whose plan for the first one serves all. Raise `InvalidQuantity` for other differences.
    """
    scene = scenes[0]
    if any(_but_for_modulus(one, scene) != scene for one in scenes):
        raise InvalidQuantity("scenes", len(scenes), "alike but for the inclusion's modulus", "solve them one by one")
    plan = plan or model_plan(scene.with_press(presses[-1]))
    turned, angle_rad = aligned(scene)
    meshed = build(turned, plan)
    inclusion_free = _without_inclusion(meshed, turned, presses, plan, estimate_error)
    rays = replace(meshed.rays, angle_rad=meshed.rays.angle_rad + angle_rad)

    def solutions(one: Scene) -> tuple[Solution, ...]:
        pressed = inclusion_free
        if one.has_inclusion:
            materials = with_inclusion(aligned(one)[0])
            pressed = meshed.model.press(materials, presses, estimate_error=estimate_error)
        return tuple(
            require_sound(
                Solution(
                    rays,
                    found.state,
                    without.state,
                    plan,
                    meshed.elements,
                    _stated(plan, meshed.rays, found, without, press),
                    one.with_press(press),
                )
            )
            for press, found, without in zip(presses, pressed, inclusion_free, strict=True)
        )

    return tuple(solutions(one) for one in scenes)


def _without_inclusion(
    meshed: Meshed, scene: Scene, presses: Sequence[Press], plan: ModelPlan, estimate_error: bool
) -> tuple[Loaded, ...]:
    """Return the baseline at every press; where it gives way, raise the failure that says how far both can go."""
    try:
        return meshed.model.press(baseline(scene), presses, estimate_error=estimate_error)
    except PressFailed:
        if scene.has_inclusion and plan.strain == "small":
            meshed.model.press(with_inclusion(scene), presses, estimate_error=False)
        raise


def _stated(plan: ModelPlan, rays: Rays, found: Loaded, without: Loaded, press: Press) -> dict[str, float]:
    if found.residual and without.residual:
        return dual_error(rays, found, without, order=plan.order, by_force=press.force_n is not None)
    return stated_error(plan, rays, found, without, by_force=press.force_n is not None)


def _but_for_modulus(scene: Scene, other: Scene) -> Scene:
    if scene.inclusion is None or other.inclusion is None:
        return scene
    modulus_kpa = other.inclusion.youngs_modulus_kpa
    return replace(scene, inclusion=replace(scene.inclusion, youngs_modulus_kpa=modulus_kpa))
