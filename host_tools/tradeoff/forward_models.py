"""Forward models against their error on six scenes from easy to hard, and CalculiX beside them at equal true error.

Every model solves the scene with its inclusion and without it, from the geometry on. Its error is the worst of force
and O1-O3 against a finer model of the same scene; where finite strain matters, that one has it. CalculiX gets
axisymmetric elements as ours are, CAX8R (eight nodes, reduced integration: a third cheaper than CAX8 at less error), a
contact pair, and a family of meshes graded towards its rims.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from device.measurement.quantities import Inclusion
from host_tools.forward.accuracy import Level
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.plan import DEFAULT_TOLERANCE, ModelPlan, model_plan
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Benchmark, Chapter, Table, at_most
from host_tools.scenes.scene import Placement, Press, Scene
from host_tools.tradeoff.fronts import Panel, front_figure, front_table
from host_tools.tradeoff.pareto import Choice, needless_everywhere
from host_tools.tradeoff.yardstick import REPEATS, cost, subprocess_s
from host_tools.verification.cross_check.calculix import (
    CalculixSolution,
    ccx_available,
    ccx_version,
    solve_with_calculix,
)
from host_tools.verification.cross_check.calculix_deck import Process
from host_tools.verification.cross_check.section import Sizes
from host_tools.verification.level_tables import FEATURES, finest_plan

MODULUS_KPA = 80.0
AXISYMMETRIC = tuple(Level(grading, order) for grading in ("coarse", "standard", "fine") for order in (2, 3, 4))
BESIDE_FINITE = Level("coarse", 2), Level("standard", 3)
FINITE = Level("blunt", 2), Level("blunt", 3), Level("blunt_fine", 3)
SOLID = Level("coarse", 2), Level("coarse", 3), Level("standard", 2), Level("standard", 3)
SMALL_STRAIN, FINITE_STRAIN, IN_SPACE = "small strain", "finite strain", "small strain in 3-D"
CALCULIX = "CalculiX CAX8R"
CALCULIX_SIZES = {
    "rim 0.3": Sizes(bulk_mm=8.0, face_mm=2.0, rim_mm=0.3, growth=0.8, per_quarter_circle=4.0),
    "rim 0.1": Sizes(bulk_mm=6.0, face_mm=1.5, rim_mm=0.1, growth=0.6, per_quarter_circle=5.0),
    "rim 0.05": Sizes(bulk_mm=5.0, face_mm=1.0, rim_mm=0.05, growth=0.5, per_quarter_circle=6.0),
    "rim 0.02": Sizes(bulk_mm=4.0, face_mm=0.8, rim_mm=0.02, growth=0.4, per_quarter_circle=8.0),
}
"""From coarse to fine; even refinement spends more elements for the same error."""
EQUAL_ERRORS = (0.02, 0.01, 0.005)
LEAST_ERROR = 1e-5
"""Errors below that of the truth itself are shown as this."""


@dataclass(frozen=True)
class ForwardCase:
    """One scene with its truth's plan and the plans that compete; `in_calculix` where CalculiX is asked, too."""

    title: str
    scene: Scene
    truth: ModelPlan
    plans: tuple[tuple[str, ModelPlan], ...]
    in_calculix: bool = False


def cases() -> tuple[ForwardCase, ...]:
    """Return the six scenes, from easy to hard."""
    spheres = ((15.0, 4.0), (10.0, 6.0), (5.0, 12.0), (2.0, 4.0))
    return (*(_small(Inclusion(d, h, MODULUS_KPA)) for d, h in spheres), _deep_press(), _ellipsoid())


def _small(inclusion: Inclusion) -> ForwardCase:
    scene = Scene(inclusion)
    title = f"{inclusion.size_mm:g} mm, {inclusion.depth_mm:g} mm deep"
    return ForwardCase(title, scene, finest_plan(scene), _plans(scene, SMALL_STRAIN, AXISYMMETRIC), in_calculix=True)


def _deep_press() -> ForwardCase:
    scene = Scene(Inclusion(10.0, 6.0, MODULUS_KPA), Press(indentation_mm=2.5))
    finite = model_plan(scene, strain="finite")
    truth = replace(finite, grading="blunt_fine", order=4)
    plans = _plans(scene, SMALL_STRAIN, BESIDE_FINITE) + _plans(scene, FINITE_STRAIN, FINITE)
    return ForwardCase("10 mm, 6 mm deep, pressed 2.5 mm", scene, truth, plans)


def _ellipsoid() -> ForwardCase:
    shape = Placement(width_ratio_x=1.5)
    scene = Scene(Inclusion(10.0, 6.0, MODULUS_KPA), placement=shape)
    truth = replace(model_plan(scene), grading="fine", order=3)
    return ForwardCase("ellipsoid 15 x 10 x 10 mm", scene, truth, _plans(scene, IN_SPACE, SOLID))


def _plans(scene: Scene, family: str, levels: Sequence[Level]) -> tuple[tuple[str, ModelPlan], ...]:
    plan = model_plan(scene, strain="finite" if family == FINITE_STRAIN else "small")
    return tuple((family, replace(plan, grading=level.grading, order=level.order)) for level in levels)


SHORT = (replace(cases()[0], plans=cases()[0].plans[:2], in_calculix=False),)
"""One scene, two levels: to try the chain."""


def measured(case: ForwardCase, repeats: int = REPEATS) -> tuple[Panel, Benchmark]:
    """Return time and error of every plan of a case, and whether the planner's own choice holds what it promises."""
    chosen = model_plan(case.scene, tolerance=DEFAULT_TOLERANCE, strain=case.truth.strain)
    truth = _numbers(solve(case.scene, case.truth))
    points = []
    for family, plan in case.plans:
        found = list[Solution]()
        takes = cost(lambda plan=plan, found=found: found.append(solve(case.scene, plan)), repeats)  # type: ignore[misc]
        same = (plan.strain, plan.grading, plan.order) == (chosen.strain, chosen.grading, chosen.order)
        error = _error(_numbers(found[-1]), truth)
        points.append(Choice(f"{plan.grading} {plan.order}", family, takes.yardsticks, error, chosen=same))
    if case.in_calculix and ccx_available():
        points += [_in_calculix(case.scene, name, sizes, truth) for name, sizes in CALCULIX_SIZES.items()]
    promised = max(DEFAULT_TOLERANCE, *chosen.predicted_error.values())
    error = min(one.error for one in points if one.chosen)
    benchmark = at_most(case.title, "error of the plan's choice", error, promised)
    return Panel(case.title, "worst error of force, O1-O3 (ratio)", tuple(points)), benchmark


def _numbers(solution: Solution) -> dict[str, float]:
    return numbers(solution.rays, solution.pressed, solution.baseline)


def _error(found: dict[str, float], truth: dict[str, float]) -> float:
    return max(LEAST_ERROR, *(abs(found[name] / truth[name] - 1) for name in FEATURES["indentation_mm"]))


def _in_calculix(scene: Scene, name: str, sizes: Sizes, truth: dict[str, float]) -> Choice:
    """Return CalculiX's point: the time of its own two runs, without our mesh and the deck's text."""
    rays, found = Rays.over(scene.waveguide), list[FaceState]()

    def press() -> None:
        found[:] = [_face(_ccx(scene, sizes, homogeneous=homogeneous), rays) for homogeneous in (False, True)]

    takes = cost(press, 1, subprocess_s)
    return Choice(name, CALCULIX, takes.yardsticks, _error(numbers(rays, *found), truth))


def _ccx(scene: Scene, sizes: Sizes, *, homogeneous: bool) -> CalculixSolution:
    assert scene.press.indentation_mm is not None  # the cases prescribe it
    process = Process(reduced_integration=True)
    return solve_with_calculix(
        scene,
        [scene.press.indentation_mm],
        finite_strain=False,
        homogeneous=homogeneous,
        sizes=sizes,
        sector="axisymmetric",
        process=process,
    )[0]


def _face(found: CalculixSolution, rays: Rays) -> FaceState:
    """Return the face on our rays; the deck asks for no pressure, which O1-O3 do not need."""
    r_mm = np.clip(rays.r_mm[0], found.r_mm[0], found.r_mm[-1])
    w_mm = np.array([found.w_at_mm(float(r)) for r in r_mm])
    total_mm3 = float(np.trapezoid(2 * np.pi * r_mm * w_mm, r_mm))
    return FaceState(found.indentation_mm, w_mm[None], 0 * w_mm[None], total_mm3, found.force_n, found.force_n)


EqualError = tuple[str, float, float, float]
"""Scene, error, and the least costs of ours and of CalculiX that hold it."""


def equal_errors(panels: Sequence[Panel]) -> list[EqualError]:
    """Return title, error, and the least cost of ours and of CalculiX that holds it, where both can."""
    rows = []
    for panel in panels:
        for error in EQUAL_ERRORS:
            theirs = [one.cost for one in panel.choices if one.family == CALCULIX and one.error <= error]
            ours = [one.cost for one in panel.choices if one.family != CALCULIX and one.error <= error]
            if theirs and ours:
                rows.append((panel.title, error, min(ours), min(theirs)))
    return rows


def forward_chapter(asked: Sequence[ForwardCase] | None = None, repeats: int = REPEATS) -> Chapter:
    """Return the fronts of the six or other cases, and whether the plan's choices hold what they promise."""
    panels, benchmarks = zip(*(measured(case, repeats) for case in asked or cases()), strict=True)
    equal = equal_errors(panels)
    return Chapter(
        "Forward models",
        "Six scenes, each solved with its inclusion and without it, meshing included; CalculiX at equal true error.",
        "host_tools/tradeoff/forward_models.py; truth: the finest plan of each scene",
        benchmarks,
        (front_table("Every model", panels), *([_equal_table(equal)] if equal else [])),
        (front_figure("tradeoff_forward_models.svg", "Time and error of the forward models", panels),),
        facts={
            "needless": needless_everywhere([panel.choices for panel in panels]),
            "calculix_over_ours": [round(theirs / ours, 1) for *_, ours, theirs in equal],
            "calculix": ccx_version() if equal else "",
            "tolerance": DEFAULT_TOLERANCE,
        },
    )


def _equal_table(equal: Sequence[EqualError]) -> Table:
    header = ("scene", "error at most", "ours (yardsticks)", f"{CALCULIX} (yardsticks)", "CalculiX over ours")
    rows = (
        (title, f"{100 * error:g} %", f"{ours:.0f}", f"{theirs:.0f}", f"{theirs / ours:.1f}")
        for title, error, ours, theirs in equal
    )
    return Table("CalculiX at equal true error", header, tuple(rows))
