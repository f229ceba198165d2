"""The same scene in another program, side by side in one run: CalculiX with a real contact pair against ours.

Small strain, and finite strain (neo-Hookean) with true sliding, where both readings of the rim stand beside it.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from math import nan
from typing import Any, NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from host_tools.forward.finite_strain.load_path import press_along
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import ModelPlan, model_plan
from host_tools.forward.solve import solve_ramp
from host_tools.forward.tiers import build
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_most, relative
from host_tools.scenes.scene import Press, Scene
from host_tools.verification.cross_check.calculix import CalculixFailed, ccx_available, ccx_version, solve_with_calculix
from host_tools.verification.cross_check.calculix_deck import Process

SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
INDENTATIONS_MM, RADII_MM = (1.0, 2.0, 3.0), (0.0, 3.0, 6.0, 9.0)
FINE, COARSE = 2.0, 1.5
"""Refinements of CalculiX's mesh; finite strain takes a hundred times as long, so it gets the coarse one."""
PROCESS = Process()
"""How CalculiX gets there: the defaults of its own module."""
SMALL_BOUND, FORCE_BOUND, INCLUSION_BOUND = 0.01, 0.01, 0.03


class ProgramRamp(NamedTuple):
    """One program's answer: force (N) [indentation], w and inclusion field (mm) [indentation, radius], time (s)."""

    force_n: Array
    w_mm: Array
    inclusion_mm: Array
    seconds: float


def ours(plan: ModelPlan) -> ProgramRamp:
    """Solve by the forward model."""
    began = time.perf_counter()
    solutions = solve_ramp(SCENE, [Press(indentation_mm=value) for value in INDENTATIONS_MM], plan)
    seconds = time.perf_counter() - began
    w_mm = np.array([np.interp(RADII_MM, s.r_mm, s.w_mm) for s in solutions])
    baseline_mm = np.array([np.interp(RADII_MM, s.r_mm, s.w_baseline_mm) for s in solutions])
    return ProgramRamp(np.array([s.force_n for s in solutions]), w_mm, w_mm - baseline_mm, seconds)


def with_edge_force(plan: ModelPlan) -> ProgramRamp:
    """Solve by the forward model, but with the slip of the rim an unknown, too."""
    began, meshed = time.perf_counter(), build(SCENE, plan)
    pressed, inclusion_free = (
        press_along(meshed.mesh, materials, INDENTATIONS_MM, order=plan.order, rays=meshed.rays, edge_force=True)
        for materials in (with_inclusion(SCENE), baseline(SCENE))
    )
    seconds, r_mm = time.perf_counter() - began, meshed.rays.r_mm[0]
    w_mm, baseline_mm = (
        np.array([np.interp(RADII_MM, r_mm, loaded.face.w_mm[0]) for loaded in ramp])
        for ramp in (pressed, inclusion_free)
    )
    return ProgramRamp(np.array([loaded.face.force_n for loaded in pressed]), w_mm, w_mm - baseline_mm, seconds)


def calculix(refinement: float, *, finite_strain: bool) -> ProgramRamp:
    """Solve by CalculiX, with the inclusion and with the inclusion filled with tissue."""
    pressed, inclusion_free = (
        solve_with_calculix(
            SCENE,
            INDENTATIONS_MM,
            finite_strain=finite_strain,
            homogeneous=homogeneous,
            refinement=refinement,
            process=PROCESS,
        )
        for homogeneous in (False, True)
    )
    w_mm, baseline_mm = (
        np.array([[s.w_at_mm(r) for r in RADII_MM] for s in states]) for states in (pressed, inclusion_free)
    )
    seconds = pressed[0].seconds + inclusion_free[0].seconds
    return ProgramRamp(np.array([s.force_n for s in pressed]), w_mm, w_mm - baseline_mm, seconds)


SMALL, SMALL_BLUNT = "small strain, ours", "small strain, ours, mesh of finite strain"
CALCULIX_SMALL, CALCULIX_COARSE = "small strain, CalculiX", "small strain, CalculiX, coarse"
SLIDING = "finite strain, ours, sliding"
EDGE = "finite strain, ours, sliding, with the force of the edge"
CALCULIX_SLIDING = "finite strain, CalculiX, sliding, coarse"
RUNS: dict[str, Callable[[], ProgramRamp]] = {
    SMALL: lambda: ours(model_plan(SCENE)),
    SMALL_BLUNT: lambda: ours(replace(model_plan(SCENE), grading=model_plan(SCENE, strain="finite").grading)),
    CALCULIX_SMALL: lambda: calculix(FINE, finite_strain=False),
    CALCULIX_COARSE: lambda: calculix(COARSE, finite_strain=False),
    SLIDING: lambda: ours(model_plan(SCENE, strain="finite")),
    EDGE: lambda: with_edge_force(model_plan(SCENE, strain="finite")),
    CALCULIX_SLIDING: lambda: calculix(COARSE, finite_strain=True),
}
ProgramsFound = dict[str, ProgramRamp]


def benchmarks(found: ProgramsFound) -> tuple[Benchmark, ...]:
    """Return ours against CalculiX: force, w and inclusion field, in small and in finite strain with true sliding."""
    small, theirs = found[SMALL], found[CALCULIX_SMALL]
    case = f"small strain, {INDENTATIONS_MM[0]:g} mm"
    rows = [
        relative(case, "force (N)", small.force_n[0], theirs.force_n[0], SMALL_BOUND),
        relative(case, "w at r = 0 (mm)", small.w_mm[0, 0], theirs.w_mm[0, 0], SMALL_BOUND),
        relative(
            case, "inclusion field at r = 0 (mm)", small.inclusion_mm[0, 0], theirs.inclusion_mm[0, 0], SMALL_BOUND
        ),
    ]
    mine, theirs = found[SLIDING], found[CALCULIX_SLIDING]
    for i, indentation_mm in enumerate(INDENTATIONS_MM):
        case = f"finite strain, sliding, {indentation_mm:g} mm"
        rows += [
            relative(case, "force (N)", mine.force_n[i], theirs.force_n[i], FORCE_BOUND),
            relative(case, "w at r = 0 (mm)", mine.w_mm[i, 0], theirs.w_mm[i, 0], SMALL_BOUND),
            relative(
                case,
                "inclusion field at r = 0 (mm)",
                mine.inclusion_mm[i, 0],
                theirs.inclusion_mm[i, 0],
                INCLUSION_BOUND,
            ),
        ]
    return tuple(rows)


def _tables(found: ProgramsFound) -> tuple[Table, ...]:
    header = (
        "model",
        "force (N)",
        *(f"w({r:g}) (mm)" for r in RADII_MM),
        *(f"inclusion({r:g}) (mm)" for r in RADII_MM),
    )
    tables = []
    for i, indentation_mm in enumerate(INDENTATIONS_MM):
        rows = tuple(
            (name, f"{ramp.force_n[i]:.5f}", *(f"{v:.5f}" for v in (*ramp.w_mm[i], *ramp.inclusion_mm[i])))
            for name, ramp in found.items()
        )
        tables.append(Table(f"Pressed by {indentation_mm:g} mm; the face at radii of 0 to 9 mm", header, rows))
    return (*tables, _times(found))


def _times(found: ProgramsFound) -> Table:
    rows = []
    for name, ramp in found.items():
        theirs = found[CALCULIX_SLIDING if name.startswith("finite") else CALCULIX_SMALL]
        rows.append((name, f"{ramp.seconds:.2f}", f"{theirs.seconds / ramp.seconds:.1f}"))
    caption = "Wall time of all loads, with the inclusion and without it, meshing included"
    return Table(caption, ("model", "seconds", "CalculiX over it"), tuple(rows))


def _figure(found: ProgramsFound) -> Figure:
    def draw(figure: Any) -> None:
        axes = figure.subplots()
        for name, ramp in found.items():
            line = "s--" if "CalculiX" in name else "o-"
            axes.plot(INDENTATIONS_MM, 1e3 * ramp.inclusion_mm[:, 0] / INDENTATIONS_MM, line, label=name)
        axes.set_xlabel("indentation (mm)")
        axes.set_ylabel("inclusion field in the middle\nover indentation (µm/mm)")
        axes.grid(alpha=0.3)
        axes.legend(fontsize="small")

    return Figure("verification_sliding.svg", "What finite strain and sliding do to the inclusion field", draw)


TITLE = "Another program: CalculiX"
CLAIM = (
    "A revolved sector of C3D20 and C3D15 elements, probe and tissue apart, with a surface-to-surface contact pair "
    "(penalty), against our shared face."
)
SOURCE = "Dhondt, CalculiX CrunchiX User's Manual, version 2.20: another code, another mesh, another contact law."


def chapter(short: bool) -> Chapter:
    """Return the chapter; it is skipped when short, since it takes minutes, and where CalculiX is not installed."""
    if short or not ccx_available():
        why = "left out of a short run" if short else "the program ccx is not installed"
        return Chapter(TITLE, CLAIM, SOURCE, skipped=f"{why}; `host_tools verify --only calculix` measures it")
    facts = {"version": ccx_version(), "increment_mm": PROCESS.increment_mm, "repairings": PROCESS.repairings}
    try:
        found = {name: run() for name, run in RUNS.items()}
    except CalculixFailed as failed:
        return Chapter(TITLE, CLAIM, SOURCE, (at_most("CalculiX", str(failed), nan, 0.0),), facts=facts)
    return Chapter(TITLE, CLAIM, SOURCE, benchmarks(found), _tables(found), (_figure(found),), facts=facts)
