"""A scene to its solution: surface deformation w, contact pressure p, force, O1-O3, and the error of each.

The baseline is the *same mesh* with the inclusion made of tissue: separate meshes would put 50 % error on the smallest
inclusions.
"""

from __future__ import annotations

import os

# A 2-D solve gains nothing from threads and a sweep loses by them; a 3-D one gains a little on an idle machine, but
# NGSolve's threads wait by spinning, and on a busy one it then takes ten times as long.
os.environ.setdefault("NGS_NUM_THREADS", "1")

from collections.abc import Sequence
from dataclasses import replace

from ngsolve import SetNumThreads, ngsglobals

from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import ModelPlan, aligned, model_plan
from host_tools.forward.solution import Solution
from host_tools.forward.stated_error import stated_error
from host_tools.forward.tiers import build
from host_tools.scenes.scene import Press, Scene

ngsglobals.msg_level = 0
SetNumThreads(1)


def solve(scene: Scene, plan: ModelPlan | None = None, *, estimate_error: bool = False) -> Solution:
    """Solve a scene by a plan; without one, at the level that all data sets share."""
    return solve_ramp(scene, [scene.press], plan, estimate_error=estimate_error)[0]


def solve_ramp(
    scene: Scene, presses: Sequence[Press], plan: ModelPlan | None = None, *, estimate_error: bool = False
) -> tuple[Solution, ...]:
    """Solve a scene at several presses, all by indentation or all by force, ascending; `scene.press` is not used.

    In small strain one solve serves all; in finite strain one load path does. Raise `PressFailed` when a press is
    beyond what the model can reach.
    """
    plan = plan or model_plan(scene.with_press(presses[-1]))
    turned, angle_rad = aligned(scene)
    meshed = build(turned, plan)
    inclusion_free = meshed.model.press(baseline(turned), presses, estimate_error=estimate_error)
    pressed = inclusion_free
    if turned.has_inclusion:
        pressed = meshed.model.press(with_inclusion(turned), presses, estimate_error=estimate_error)
    rays = replace(meshed.rays, angle_rad=meshed.rays.angle_rad + angle_rad)
    return tuple(
        Solution(
            rays,
            one.state,
            without.state,
            plan,
            meshed.elements,
            stated_error(plan, meshed.rays, one, without),
            scene.with_press(press),
        )
        for press, one, without in zip(presses, pressed, inclusion_free, strict=True)
    )
