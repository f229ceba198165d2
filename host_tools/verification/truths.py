"""A scene to numbers as good as true: the finest level that can be had, in finite strain without what its mesh errs.

The rim of the contact must stay blunt in finite strain. What that costs is nearly the same in small strain, where a
converged answer is cheap, and is taken off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.ladder import lightened
from host_tools.forward.plan import GRADED, Level, StrainModel, model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Scene

CONVERGED = Level(GRADED, 6)
"""Small strain, by which it is told what a mesh of finite strain errs."""


def true_numbers(scene: Scene, levels: Sequence[Level], strain: StrainModel) -> tuple[Level | None, dict[str, float]]:
    """Return the first of the levels that takes the press, and force, indentation and O1-O3; nothing if none does."""
    plan = model_plan(scene, strain=strain)
    for level in levels:
        try:
            solution = solve(scene, replace(plan, grading=level.grading, order=level.order, mesh="remeshed"))
        except PressFailed:
            continue
        found = numbers(solution.rays, solution.pressed, solution.baseline)
        if strain == "small":
            return level, found
        errs = _small_strain_errors(scene, level)
        return level, {name: value / (1 + errs[name]) for name, value in found.items()}
    return None, {}


def _small_strain_errors(scene: Scene, level: Level) -> dict[str, float]:
    """Return by how much a mesh for finite strain errs in small strain; relative, with its sign."""
    plan = replace(model_plan(scene), mesh="remeshed")
    light = scene.with_press(lightened(scene.press))
    pair = []
    for one in (level, CONVERGED):
        solution = solve(light, replace(plan, grading=one.grading, order=one.order))
        pair.append(numbers(solution.rays, solution.pressed, solution.baseline))
    same_mesh, true = pair
    return {name: same_mesh[name] / value - 1 if value else 0.0 for name, value in true.items()}
