"""Measured accuracy and cost of every level of mesh and order.

The tables are measured against the finest tier by `host_tools verify --tables`, which writes `accuracy_table.json`
beside this file. A scene between two rows of a table is promised the worse of both.
"""

from __future__ import annotations

import json
from functools import lru_cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from host_tools.forward.sampling import FaceSector
from host_tools.scenes.scene import Scene

TABLE = "accuracy_table.json"
NO_INCLUSION_FEATURES = ("force_n", "indentation_mm")


class Level(NamedTuple):
    """Element order and the name of the element sizes it goes with."""

    grading: str
    order: int


class LevelAccuracy(NamedTuple):
    """A chosen level, what the tables promise of it, and why it was chosen."""

    level: Level
    predicted_error: dict[str, float]
    seconds: float | None
    reason: str


@lru_cache(maxsize=1)
def accuracy_table() -> dict[str, Any]:
    """Return the measured tables; an empty one before the first measurement."""
    path = files("host_tools.forward").joinpath(TABLE)
    table: dict[str, Any] = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
    return table


def cheapest_level(
    scene: Scene, symmetry: FaceSector, strain: str, tolerance: float | None, pinned: Level
) -> LevelAccuracy:
    """Return the fastest level whose measured error is within the tolerance, or `pinned` when none is asked for."""
    rows = _rows(scene, symmetry, strain)
    if tolerance is None:
        row = next((row for row in rows if row.level == pinned), LevelAccuracy(pinned, {}, None, ""))
        return row._replace(reason="the level that all data sets share, so that features are smooth")
    if not rows:
        return LevelAccuracy(pinned, {}, None, "no measured table for this kind of scene: the shared level")
    good = [row for row in rows if max(row.predicted_error.values()) <= tolerance]
    if not good:
        best = min(rows, key=lambda row: max(row.predicted_error.values()))
        worst = 100 * max(best.predicted_error.values())
        return best._replace(reason=f"no level holds {100 * tolerance:g} %: the best one is good to {worst:.2g} %")
    cheapest = min(good, key=lambda row: row.seconds or 0.0)
    worst = 100 * max(cheapest.predicted_error.values())
    return cheapest._replace(reason=f"the fastest level that holds {100 * tolerance:g} % (measured: {worst:.2g} %)")


def prescribed(scene: Scene) -> str:
    """Return whether the indentation or the force is prescribed: inclusion fields err differently under each."""
    return "force_n" if scene.press.indentation_mm is None else "indentation_mm"


def _rows(scene: Scene, symmetry: FaceSector, strain: str) -> list[LevelAccuracy]:
    """Return what the tables promise of each level for a scene."""
    kind = "finite" if strain == "finite" else "axisymmetric" if symmetry == "axisymmetric" else "solid"
    table = accuracy_table().get(kind)
    if table is None:
        return []
    found = []
    for entry in table["levels"]:
        seconds = entry["seconds"]
        if isinstance(seconds, dict):
            if symmetry not in seconds:
                continue  # too large for this part of the body
            seconds = seconds[symmetry]
        cells = entry["error"][prescribed(scene)]
        errors = {name: _worst_near(scene, table, np.array(values)) for name, values in cells.items()}
        if not scene.has_inclusion:
            errors = {name: error for name, error in errors.items() if name in NO_INCLUSION_FEATURES}
        found.append(LevelAccuracy(Level(entry["grading"], entry["order"]), errors, seconds, ""))
    return found


def _worst_near(scene: Scene, table: dict[str, Any], cells: Any) -> float:
    """Return the largest of the table's cells (size x depth) on the corners around a scene."""
    if scene.inclusion is None:
        return float(cells.max())
    rows = _bracket(table["size_mm"], scene.inclusion.size_mm)
    columns = _bracket(table["depth_mm"], scene.inclusion.depth_mm)
    return float(cells[np.ix_(rows, columns)].max())


def _bracket(nodes: list[float], value: float) -> list[int]:
    """Return the indices of the nodes on both sides of a value; the end node beyond an end."""
    right = int(np.clip(np.searchsorted(nodes, value), 0, len(nodes) - 1))
    return [right] if nodes[right] == value or right == 0 else [right - 1, right]
