"""Measures what the plan promises: error and time of every level.

Truth is order 8 on the mesh of a climb, whose layers around the rims no slab takes away. Solid levels are scored on
centred inclusions, where the axisymmetric truth is free. Writes `host_tools/forward/accuracy_table.json`
(`host_tools verify --tables`).
"""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
from joblib import Parallel, delayed

from device.files.durable import write_durably
from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.forward import accuracy
from host_tools.forward.accuracy import Level
from host_tools.forward.error_estimates.stated_error import numbers
from host_tools.forward.plan import BLUNT, GRADED, ModelPlan, model_plan
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve
from host_tools.scenes.scene import Placement, Press, Scene

SCHEMA = "tsis.accuracy/1"
SIZES_MM, DEPTHS_MM = (0.5, 2.0, 5.0, 10.0, 15.0, 20.0), (1.0, 4.0, 8.0, 12.0, 16.0)
FEW_SIZES_MM, FEW_DEPTHS_MM = (5.0, 10.0, 15.0), (4.0, 8.0, 12.0)
"""Where every axisymmetric level is scored, and where the dear ones are."""
MODULUS_KPA = 80.0
TRUE_ORDER = 8
AXISYMMETRIC_LEVELS = tuple(Level(grading, order) for grading in ("coarse", "standard", "fine") for order in (2, 3, 4))
SOLID_LEVELS = (Level("coarse", 2), Level("coarse", 3), Level("standard", 2), Level("standard", 3), Level("fine", 3))
FEATURES = {
    "indentation_mm": (
        "force_n",
        "max_deformation_mm",
        "total_deformation_mm3",
        "central_deformation_mm3",
        "deformation_area_mm2",
    ),
    "force_n": ("indentation_mm", "max_deformation_mm", "central_deformation_mm3", "deformation_area_mm2"),
}
"""What is scored under a prescribed indentation and under a prescribed force: there the total all but cancels."""

LevelErrors = dict[str, dict[str, float]]
"""Relative error by what was prescribed and by feature."""
Scored = tuple[LevelErrors, float]
"""Errors, and the seconds it took."""


def finest_plan(scene: Scene) -> ModelPlan:
    """Return the plan of the finest small-strain tier, the truth of every table."""
    return replace(model_plan(scene), mesh="remeshed", grading=GRADED, order=TRUE_ORDER)


def relative_errors(found: Solution, truth: Solution) -> LevelErrors:
    """Return the relative errors of two solutions of one scene, compared at equal indentation and at equal force."""
    errors: LevelErrors = {}
    for prescribed, features in FEATURES.items():
        one, other = (_features(solution, per=prescribed) for solution in (found, truth))
        errors[prescribed] = {name: _relative(one[name], other[name]) for name in features}
    return errors


def _features(solution: Solution, *, per: str) -> dict[str, float]:
    """Return force, indentation and O1-O3 of the inclusion when both presses are scaled to one unit of either."""
    pressed, baseline = (state.scaled(1 / getattr(state, per)) for state in (solution.pressed, solution.baseline))
    return numbers(solution.rays, pressed, baseline)


def _relative(found: float, truth: float) -> float:
    return abs(found / truth - 1) if truth else 0.0


def measure_tables(out: Path, *, jobs: int = -1, on_step: Callable[[str], None] = lambda what: None) -> dict[str, Any]:
    """Measure every table (about a quarter of an hour on two cores), write them to `out`, and return them."""
    table: dict[str, Any] = {"schema": SCHEMA, "command": "host_tools verify --tables"}
    for name, measure in (
        ("axisymmetric", _axisymmetric),
        ("finite", _finite),
        ("solid", _solid),
    ):
        on_step(name)
        table[name] = measure(jobs)
        write_durably(out, (json.dumps(table) + "\n").encode())
    accuracy.accuracy_table.cache_clear()
    return table


def _scenes(sizes_mm: tuple[float, ...], depths_mm: tuple[float, ...]) -> Iterator[Scene | None]:
    """Yield the scenes of a grid, row by row; None where the inclusion does not fit into the slab."""
    for size_mm, depth_mm in product(sizes_mm, depths_mm):
        try:
            yield Scene(Inclusion(size_mm, depth_mm, MODULUS_KPA))
        except InvalidQuantity:
            yield None


def _axisymmetric(jobs: int) -> dict[str, Any]:
    rows = Parallel(n_jobs=jobs)(
        delayed(_score_levels)(scene, AXISYMMETRIC_LEVELS) for scene in _scenes(SIZES_MM, DEPTHS_MM)
    )
    return _as_table(SIZES_MM, DEPTHS_MM, AXISYMMETRIC_LEVELS, rows)


def _score_levels(scene: Scene | None, levels: tuple[Level, ...]) -> list[Scored] | None:
    if scene is None:
        return None
    truth = solve(scene, finest_plan(scene))
    return [_score(scene, replace(model_plan(scene), grading=grading, order=order), truth) for grading, order in levels]


def _score(scene: Scene, plan: ModelPlan, truth: Solution) -> Scored:
    solve(scene, plan)  # a first solve may build the reference mesh
    return _score_once(scene, plan, truth)


def _as_table(
    sizes_mm: tuple[float, ...],
    depths_mm: tuple[float, ...],
    levels: tuple[Level, ...],
    rows: list[list[Scored] | None],
) -> dict[str, Any]:
    """Return the JSON object of a grid of scores; a scene that cannot be is given the worst of the others."""
    table: dict[str, Any] = {"size_mm": sizes_mm, "depth_mm": depths_mm, "levels": []}
    for i, level in enumerate(levels):
        cells = [row[i] if row else None for row in rows]
        error = {
            prescribed: {
                name: _grid([cell[0][prescribed][name] if cell else np.nan for cell in cells], sizes_mm, depths_mm)
                for name in features
            }
            for prescribed, features in FEATURES.items()
        }
        seconds = float(np.median([cell[1] for cell in cells if cell]))
        table["levels"].append({**level._asdict(), "error": error, "seconds": round(seconds, 3)})
    return table


def _grid(values: list[float], sizes_mm: tuple[float, ...], depths_mm: tuple[float, ...]) -> list[list[float]]:
    grid = np.array(values).reshape(len(sizes_mm), len(depths_mm))
    grid[np.isnan(grid)] = np.nanmax(grid)
    return [[float(f"{value:.2e}") for value in row] for row in grid]


def _finite(jobs: int) -> dict[str, Any]:
    """Score finite strain at 2 mm against order 4 on finer rims."""
    rows = Parallel(n_jobs=jobs)(delayed(_score_finite)(scene) for scene in _scenes(FEW_SIZES_MM, FEW_DEPTHS_MM))
    return _as_table(FEW_SIZES_MM, FEW_DEPTHS_MM, (BLUNT,), rows)


def _score_finite(scene: Scene | None) -> list[Scored] | None:
    if scene is None:
        return None
    deep = scene.with_press(Press(indentation_mm=2.0))
    plan = model_plan(deep, strain="finite")
    truth = solve(deep, replace(plan, grading="blunt_fine", order=4))
    return [_score(deep, plan, truth)]


def _solid(jobs: int) -> dict[str, Any]:
    """Score quarters of centred inclusions; 3-D solves take gigabytes, so they run one by one whatever `jobs` says."""
    rows = [_score_solid(scene) for scene in _scenes(FEW_SIZES_MM, FEW_DEPTHS_MM)]
    table = _as_table(FEW_SIZES_MM, FEW_DEPTHS_MM, SOLID_LEVELS, rows)
    for entry in table["levels"]:
        level = Level(entry["grading"], entry["order"])
        places = {"half": Placement(6.0), "full": Placement(6.0, 6.0, 1.0, 1.5)}
        if level.grading == "fine":
            del places["full"]  # eight gigabytes: not offered
        measured = {sector: round(_solid_seconds(level, place), 2) for sector, place in places.items()}
        entry["seconds"] = {"quarter": entry["seconds"], **measured}
    return table


def _score_solid(scene: Scene | None) -> list[Scored] | None:
    if scene is None:
        return None
    truth = solve(scene, finest_plan(scene))
    return [_score_once(scene, _solid_plan(scene, level), truth) for level in SOLID_LEVELS]


def _score_once(scene: Scene, plan: ModelPlan, truth: Solution) -> Scored:
    began = time.perf_counter()
    found = solve(scene, plan)
    return relative_errors(found, truth), time.perf_counter() - began


def _solid_plan(scene: Scene, level: Level) -> ModelPlan:
    return replace(model_plan(scene), symmetry="quarter", mesh="remeshed", grading=level.grading, order=level.order)


def _solid_seconds(level: Level, place: Placement) -> float:
    scene = Scene(Inclusion(10.0, 6.0, MODULUS_KPA), placement=place)
    plan = replace(model_plan(scene), grading=level.grading, order=level.order)
    began = time.perf_counter()
    solve(scene, plan)
    return time.perf_counter() - began
