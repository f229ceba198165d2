"""Solutions of one scene to one xarray data set: every load a row, every name with its unit and its meaning.

A round face has the dimensions `load`, `angle_deg` (in 3-D) and `r_mm`; a square one, whose rays differ in length,
`sample` instead of `r_mm`, with the radius as a coordinate of angle and sample.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from device import __version__
from device.measurement.arrays import Array
from device.measurement.quantities import InvalidQuantity
from host_tools.forward.face_state import Rays

if TYPE_CHECKING:
    from host_tools.forward.solution import Solution

SCHEMA = "tsis.solution/1"
UNITS = {"_mm": "mm", "_mm2": "mm2", "_mm3": "mm3", "_kpa": "kPa", "_n": "N", "_deg": "deg"}
MEANINGS = {
    "inclusion_deformation_mm": "what the inclusion adds to the deformation of the face",
    "deformation_mm": "deformation of the face, relative to its own undeformed shape",
    "baseline_deformation_mm": "deformation under the same press without the inclusion",
    "contact_pressure_kpa": "contact pressure, force per undeformed area; at the very rim it is singular",
    "baseline_contact_pressure_kpa": "contact pressure of the same press without the inclusion",
    "deformed_contact_pressure_kpa": "contact pressure, force per deformed area",
    "indentation_mm": "how far the back of the probe is pressed in",
    "force_n": "force on the probe",
    "contact_force_n": "integral of the contact pressure",
    "r_mm": "distance from the axis of the probe",
    "angle_deg": "direction from the axis of the probe, from +x to +y",
}
OF_SWEEPS = {"w_mm": "deformation_mm", "w_baseline_mm": "baseline_deformation_mm", "p_kpa": "contact_pressure_kpa"}
"""Names in the file of a sweep, and here."""


def unit_of(name: str) -> str:
    """Return the unit that a name ends in, "1" for a ratio; stated errors are relative, whatever they are of."""
    return "1" if name.startswith("stated_error_") else UNITS.get("_" + name.rpartition("_")[2], "1")


def dataset_of(solutions: Sequence[Solution]) -> xr.Dataset:
    """Return solutions of one scene and one plan as a data set, in the order of their loads.

    `attrs` say where it comes from: schema, software, plan and scene, the last two as JSON. Raise `InvalidQuantity`
    for no solutions, or solutions on different faces.
    """
    if not solutions:
        raise InvalidQuantity("solutions", "none", "at least one", "solve a scene first")
    first = solutions[0]
    if any(one.plan != first.plan or one.rays.r_mm.shape != first.rays.r_mm.shape for one in solutions):
        raise InvalidQuantity("solutions", "of different plans", "of one ramp", "solve all loads together")
    dimensions, coordinates = _face(first.rays)
    fields = {name: (dimensions, _rows(first.rays, rows)) for name, rows in _fields(solutions).items()}
    numbers = {name: ("load", np.array(rows)) for name, rows in _numbers(solutions).items()}
    loads = {name: ("load", [getattr(one, name) for one in solutions]) for name in ("indentation_mm", "force_n")}
    dataset = xr.Dataset(fields | numbers, coordinates | loads, _origin(first))
    for name, variable in dataset.variables.items():
        variable.attrs["units"] = unit_of(str(name))
        if name in MEANINGS:
            variable.attrs["long_name"] = MEANINGS[str(name)]
    return dataset


def _face(rays: Rays) -> tuple[tuple[str, ...], dict[str, tuple[tuple[str, ...], Array]]]:
    """Return the dimensions of a field over the face, and the coordinates of its samples."""
    if len(rays.angle_rad) == 1:
        return ("load", "r_mm"), {"r_mm": (("r_mm",), rays.r_mm[0])}
    angle = {"angle_deg": (("angle_deg",), np.rad2deg(rays.angle_rad))}
    if np.ptp(rays.r_mm[:, -1]) < 1e-9 * rays.r_mm[0, -1]:
        return ("load", "angle_deg", "r_mm"), angle | {"r_mm": (("r_mm",), rays.r_mm[0])}
    return ("load", "angle_deg", "sample"), angle | {"r_mm": (("angle_deg", "sample"), rays.r_mm)}


def _rows(rays: Rays, rows: list[Array]) -> Array:
    """Return fields [A, R] of every load as one array; of a single ray without the angle."""
    return np.array(rows)[:, 0] if len(rays.angle_rad) == 1 else np.array(rows)


def _fields(solutions: Sequence[Solution]) -> dict[str, list[Array]]:
    return {
        "inclusion_deformation_mm": [one.pressed.w_mm - one.baseline.w_mm for one in solutions],
        "deformation_mm": [one.pressed.w_mm for one in solutions],
        "baseline_deformation_mm": [one.baseline.w_mm for one in solutions],
        "contact_pressure_kpa": [one.pressed.p_kpa for one in solutions],
        "baseline_contact_pressure_kpa": [one.baseline.p_kpa for one in solutions],
        "deformed_contact_pressure_kpa": [one.pressed.deformed_p_kpa(one.rays) for one in solutions],
    }


def _numbers(solutions: Sequence[Solution]) -> dict[str, list[float]]:
    """Return O1-O3 of the inclusion's field and of the raw one, and the stated error of each number that has one."""
    rows = [
        {"contact_force_n": one.pressed.contact_force_n}
        | asdict(one.inclusion_field)
        | {f"raw_{name}": value for name, value in asdict(one.raw).items()}
        | {f"stated_error_{name}": value for name, value in one.stated_error.items()}
        for one in solutions
    ]
    return {name: [row[name] for row in rows] for name in rows[0]}


def _origin(solution: Solution) -> dict[str, str]:
    plan = solution.plan.as_record() | {"elements": solution.elements}
    scene = asdict(solution.scene)
    del scene["press"]  # that of each load is a coordinate
    return {"schema": SCHEMA, "software": __version__, "plan": json.dumps(plan), "scene": json.dumps(scene)}


def named_as_solutions(swept: xr.Dataset) -> xr.Dataset:
    """Return the data set of a sweep's file in the names of a solution's; the file keeps its own, shorter ones."""
    renamed = swept.rename({name: ours for name, ours in OF_SWEEPS.items() if name in swept})
    if {"deformation_mm", "baseline_deformation_mm"} <= set(renamed):
        renamed["inclusion_deformation_mm"] = renamed["deformation_mm"] - renamed["baseline_deformation_mm"]
        renamed["inclusion_deformation_mm"].attrs["units"] = "mm"
    for name, meaning in MEANINGS.items():
        if name in renamed.variables:
            renamed[name].attrs["long_name"] = meaning
    return renamed
