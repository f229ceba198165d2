"""One scene, four bodies: the whole of it, its half, its quarter, and the meridian plane must give the same face."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import NamedTuple

from device.measurement.quantities import Inclusion
from host_tools.forward.plan import ModelPlan, model_plan
from host_tools.forward.sampling import FaceSector
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.pages.benchmark import Benchmark, Chapter, Table, relative
from host_tools.scenes.scene import Scene

SCENE = Scene(Inclusion(10.0, 6.0, 80.0))
FORCE_BOUND, INCLUSION_BOUND = 0.01, 0.02
"""A coarse 3-D mesh of order 3 is good to a per cent or two; finer ones are not affordable here."""


class TimedFeatures(NamedTuple):
    """A solution and the wall time it took."""

    solution: Solution
    seconds: float


def measurements(
    sectors: tuple[FaceSector, ...] = ("quarter", "half", "full"), order: int = 3
) -> dict[FaceSector, TimedFeatures]:
    """Return the solutions by sector, the axisymmetric one (at the level of the data sets) first."""
    plan = model_plan(SCENE)
    solid = replace(plan, mesh="remeshed", grading="coarse", order=order)
    plans: dict[FaceSector, ModelPlan] = {"axisymmetric": plan}
    plans |= {name: replace(solid, symmetry=name) for name in sectors}
    return {name: _timed(one) for name, one in plans.items()}


def _timed(plan: ModelPlan) -> TimedFeatures:
    began = time.perf_counter()
    return TimedFeatures(solve(SCENE, plan), time.perf_counter() - began)


def _features(solution: Solution) -> dict[str, tuple[float, float]]:
    """Return values and bounds by name."""
    return {
        "force (N)": (solution.force_n, FORCE_BOUND),
        "O1 (mm)": (solution.inclusion_field.max_deformation_mm, INCLUSION_BOUND),
        "O2, central (mm3)": (solution.inclusion_field.central_deformation_mm3, INCLUSION_BOUND),
    }


def benchmarks(found: dict[FaceSector, TimedFeatures]) -> tuple[Benchmark, ...]:
    """Return every solid against the axisymmetric solution."""
    exact = _features(found["axisymmetric"].solution)
    return tuple(
        relative(name, quantity, value, exact[quantity][0], bound)
        for name, timed in found.items()
        if name != "axisymmetric"
        for quantity, (value, bound) in _features(timed.solution).items()
    )


def chapter(short: bool) -> Chapter:
    """Return the chapter: only the quarter when short."""
    found = measurements(("quarter",)) if short else measurements()
    rows = [(name, str(timed.solution.elements), f"{timed.seconds:.2f}") for name, timed in found.items()]
    return Chapter(
        "Quarter = half = full = axisymmetric",
        "The default inclusion pressed by 1 mm, on 3-D meshes of the coarse level at order 3 (curved elements, one "
        "layer of prisms at both rims), against the axisymmetric solution of the data sets.",
        "The same continuum; Hughes, The Finite Element Method (1987), section 2.12.",
        benchmarks(found),
        (Table("What each costs (wall time, both presses)", ("body", "elements", "seconds"), tuple(rows)),),
    )
