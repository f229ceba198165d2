"""Forward models against their error on six scenes from easy to hard, and CalculiX beside them at equal true error.

Every level that a command can choose solves the scene with its inclusion and without it, from the geometry on: those
of a climb state their error, which is part of their time, and beside them stand the same without it, as CalculiX has
none to state, and the one level of data sets. Error is the worst of force and O1-O3 against a finer model of the same
scene; where finite strain matters, that one has it, and CalculiX, too. It gets axisymmetric elements as ours are, CAX8R
of eight nodes and reduced integration, a contact pair, and a family of meshes graded towards its rims. Beside it stands
the first mesh with elements integrated in full, CAX8, which take longer and err more.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from device.measurement.quantities import Inclusion
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.face_state import FaceState, Rays
from host_tools.forward.ladder import FINITE_RUNGS, climb, solved_at
from host_tools.forward.plan import BLUNT, DEFAULT_TOLERANCE, GRADED, STANDARD, Level, StrainModel, model_plan
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
from host_tools.verification.effectivity import FEATURES
from host_tools.verification.truths import true_numbers

MODULUS_KPA = 80.0
AXISYMMETRIC, SOLID = (tuple(Level(GRADED, order) for order in orders) for orders in ((3, 4, 5, 6), (3, 4, 5)))
BESIDE_FINITE = (Level(GRADED, 4),)
FINITE = FINITE_RUNGS[:4]
TRUE_AXISYMMETRIC, TRUE_SOLID, TRUE_FINITE = (Level(GRADED, 8),), (Level(GRADED, 6),), FINITE_RUNGS[4:]
STATING, WITHOUT, DATA_SETS = "with a stated error", "without one, as CalculiX", "as in data sets"
CALCULIX, FULL = "CalculiX CAX8R", "CalculiX CAX8"
CALCULIX_SIZES = {
    "rim 0.3": Sizes(bulk_mm=8.0, face_mm=2.0, rim_mm=0.3, growth=0.8, per_quarter_circle=4.0),
    "rim 0.1": Sizes(bulk_mm=6.0, face_mm=1.5, rim_mm=0.1, growth=0.6, per_quarter_circle=5.0),
    "rim 0.05": Sizes(bulk_mm=5.0, face_mm=1.0, rim_mm=0.05, growth=0.5, per_quarter_circle=6.0),
    "rim 0.02": Sizes(bulk_mm=4.0, face_mm=0.8, rim_mm=0.02, growth=0.4, per_quarter_circle=8.0),
}
"""From coarse to fine; even refinement spends more elements for the same error."""
FINITE_SIZES = 2
"""So many of them, the coarse ones, are solved in finite strain: on the third its contact no longer converges."""
EQUAL_ERRORS = (0.02, 0.01, 0.005)
LEAST_ERROR = 1e-5
"""Errors below that of the truth itself are shown as this."""


@dataclass(frozen=True)
class ForwardCase:
    """One scene, the levels that compete by their strain, and those of its truth; `in_calculix`: CalculiX is asked."""

    title: str
    scene: Scene
    levels: tuple[tuple[StrainModel, Level], ...]
    truths: tuple[Level, ...]
    in_calculix: bool = False

    @property
    def strain(self) -> StrainModel:
        """The strain of the truth and of what is chosen: finite where any level has it."""
        return "finite" if any(strain == "finite" for strain, _ in self.levels) else "small"


def cases() -> tuple[ForwardCase, ...]:
    """Return the six scenes, from easy to hard."""
    spheres = ((15.0, 4.0), (10.0, 6.0), (2.0, 4.0))
    ellipsoid, aside = Placement(width_ratio_x=1.5), Placement(offset_x_mm=6.0)
    return (
        *(_centred(Inclusion(d, h, MODULUS_KPA)) for d, h in spheres),
        _deep_press(),
        _in_space("ellipsoid 15 x 10 x 10 mm", ellipsoid),
        _in_space("10 mm, 6 mm deep, 6 mm off the axis", aside),
    )


def _centred(inclusion: Inclusion) -> ForwardCase:
    title = f"{inclusion.size_mm:g} mm, {inclusion.depth_mm:g} mm deep"
    levels = _of_strain("small", (*AXISYMMETRIC, STANDARD))
    return ForwardCase(title, Scene(inclusion), levels, TRUE_AXISYMMETRIC, in_calculix=True)


def _deep_press() -> ForwardCase:
    scene = Scene(Inclusion(10.0, 6.0, MODULUS_KPA), Press(indentation_mm=1.5))
    levels = _of_strain("small", BESIDE_FINITE) + _of_strain("finite", (*FINITE, BLUNT))
    return ForwardCase("10 mm, 6 mm deep, pressed 1.5 mm", scene, levels, TRUE_FINITE, in_calculix=True)


def _in_space(title: str, placement: Placement) -> ForwardCase:
    scene = Scene(Inclusion(10.0, 6.0, MODULUS_KPA), placement=placement)
    return ForwardCase(title, scene, _of_strain("small", (*SOLID, STANDARD)), TRUE_SOLID)


def _of_strain(strain: StrainModel, levels: Sequence[Level]) -> tuple[tuple[StrainModel, Level], ...]:
    return tuple((strain, level) for level in levels)


SHORT = (replace(cases()[0], levels=cases()[0].levels[:2], in_calculix=False),)
"""One scene, two levels: to try the chain."""


def measured(case: ForwardCase, repeats: int = REPEATS) -> tuple[Panel, Benchmark]:
    """Return time and error of every level of a case, and whether what `simulate` answers holds what it states."""
    climbed = climb(case.scene, [case.scene.press], tolerance=DEFAULT_TOLERANCE, strain=case.strain)
    taken = climbed.solutions[0].plan
    _, truth = true_numbers(case.scene, case.truths, case.strain)
    points = []
    for strain, level in case.levels:
        for family, solved in _ways(case.scene, strain, level):
            found = list[Solution]()
            takes = cost(lambda solved=solved, found=found: found.append(solved()), repeats)  # type: ignore[misc]
            same = family != WITHOUT and (strain, *level) == (taken.strain, taken.grading, taken.order)
            points.append(
                Choice(
                    f"{level.grading} {level.order}",
                    family,
                    takes.yardsticks,
                    _error(_numbers(found[-1]), truth),
                    chosen=same,
                )
            )
    if case.in_calculix and ccx_available():
        points += calculix_choices(case, truth)
    error = _error(_numbers(climbed.solutions[0]), truth)
    benchmark = at_most(case.title, "error of what simulate answers", error, max(DEFAULT_TOLERANCE, climbed.reached))
    return Panel(case.title, "worst error of force, O1-O3 (ratio)", tuple(points)), benchmark


def _ways(scene: Scene, strain: StrainModel, level: Level) -> list[tuple[str, Callable[[], Solution]]]:
    """Return how a level is solved, by family: as in a climb and as the same without an error, or as in data sets."""
    plan = model_plan(scene, strain=strain)
    if level in (STANDARD, BLUNT):
        return [(DATA_SETS, lambda: solve(scene, plan))]
    alone = replace(plan, grading=level.grading, order=level.order, mesh="remeshed")
    return [(STATING, lambda: solved_at(scene, level, strain=strain)), (WITHOUT, lambda: solve(scene, alone))]


def _numbers(solution: Solution) -> dict[str, float]:
    return numbers(solution.rays, solution.pressed, solution.baseline)


def _error(found: dict[str, float], truth: dict[str, float]) -> float:
    return max(LEAST_ERROR, *(abs(found[name] / truth[name] - 1) for name in FEATURES["indentation_mm"]))


def calculix_choices(case: ForwardCase, truth: dict[str, float]) -> list[Choice]:
    """Return CalculiX's points, and one of elements integrated in full."""
    sizes = list(CALCULIX_SIZES)[: FINITE_SIZES if case.strain == "finite" else None]
    return [*(_of_ccx(case, one, truth) for one in sizes), _of_ccx(case, sizes[0], truth, in_full=True)]


def _of_ccx(case: ForwardCase, name: str, truth: dict[str, float], *, in_full: bool = False) -> Choice:
    """Return one point: the time of CalculiX's own two runs, without our mesh and the deck's text."""
    rays, found = Rays.over(case.scene.waveguide), list[FaceState]()
    indentation_mm = case.scene.press.indentation_mm
    assert indentation_mm is not None  # the cases prescribe it

    def press() -> None:
        solved = (
            solve_with_calculix(
                case.scene,
                [indentation_mm],
                finite_strain=case.strain == "finite",
                homogeneous=homogeneous,
                sizes=CALCULIX_SIZES[name],
                sector="axisymmetric",
                process=Process(reduced_integration=not in_full),
            )
            for homogeneous in (False, True)
        )
        found[:] = [_face(one, rays) for (one,) in solved]

    takes = cost(press, 1, subprocess_s)
    family, shown = (FULL, f"{name}, in full") if in_full else (CALCULIX, name)
    return Choice(shown, family, takes.yardsticks, _error(numbers(rays, *found), truth))


def _face(found: CalculixSolution, rays: Rays) -> FaceState:
    """Return the face on our rays; the deck asks for no pressure, which O1-O3 do not need."""
    r_mm = np.clip(rays.r_mm[0], found.r_mm[0], found.r_mm[-1])
    w_mm = np.array([found.w_at_mm(float(r)) for r in r_mm])
    total_mm3 = float(np.trapezoid(2 * np.pi * r_mm * w_mm, r_mm))
    return FaceState(found.indentation_mm, w_mm[None], 0 * w_mm[None], total_mm3, found.force_n, found.force_n)


EqualError = tuple[str, float, float, float]
"""Scene, error, and the least costs of ours and of CalculiX that hold it."""


def equal_errors(panels: Sequence[Panel]) -> list[EqualError]:
    """Return title, error, and the least cost that holds it of ours, without a stated error, and of CalculiX."""
    rows = []
    for panel in panels:
        for error in EQUAL_ERRORS:
            theirs = [one.cost for one in panel.choices if one.family == CALCULIX and one.error <= error]
            ours = [one.cost for one in panel.choices if one.family == WITHOUT and one.error <= error]
            if theirs and ours:
                rows.append((panel.title, error, min(ours), min(theirs)))
    return rows


def forward_chapter(asked: Sequence[ForwardCase] | None = None, repeats: int = REPEATS) -> Chapter:
    """Return the fronts of the six or other cases, and whether answers hold what they state."""
    panels, benchmarks = zip(*(measured(case, repeats) for case in asked or cases()), strict=True)
    equal = equal_errors(panels)
    return Chapter(
        "Forward models",
        "Six scenes, each solved with its inclusion and without it, meshing included; CalculiX at equal true error.",
        "host_tools/tradeoff/forward_models.py; truth: host_tools/verification/truths.py",
        benchmarks,
        (front_table("Every model", panels), *([_equal_table(equal)] if equal else [])),
        (front_figure("tradeoff_forward_models.svg", "Time and error of the forward models", panels),),
        facts={
            "needless": needless_everywhere([_stating_none(panel) for panel in panels]),
            "calculix_over_ours": [round(theirs / ours, 1) for *_, ours, theirs in equal],
            "calculix": ccx_version() if equal else "",
            "tolerance": DEFAULT_TOLERANCE,
        },
    )


def _stating_none(panel: Panel) -> list[Choice]:
    """Return the choices on equal terms: a stated error takes time, and nobody but a climb has one."""
    return [one for one in panel.choices if one.family != STATING]


def _equal_table(equal: Sequence[EqualError]) -> Table:
    header = ("scene", "error at most", "ours (yardsticks)", f"{CALCULIX} (yardsticks)", "CalculiX over ours")
    rows = (
        (title, f"{100 * error:g} %", f"{ours:.0f}", f"{theirs:.0f}", f"{theirs / ours:.1f}")
        for title, error, ours, theirs in equal
    )
    return Table("CalculiX at equal true error", header, tuple(rows))
