"""A journal's rows to one netCDF file with units, in blocks of scenes, so that memory does not grow with their number.

A failed scene stays in the file as a row of NaN with its reason. Columns are those of the first solved row.
"""

from __future__ import annotations

import json
import os
from itertools import islice
from pathlib import Path
from typing import Any

import h5netcdf  # type: ignore[import-untyped]
import h5py  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from device.files.durable import sync_directory
from device.files.netcdf_file import INCLUSION
from device.measurement.quantities import InvalidQuantity
from host_tools.data.journal import Journal, Row
from host_tools.forward.solution_dataset import MEANINGS, OF_SWEEPS, unit_of

WORDS = {"reason": "why the scene failed, or empty", "level": "on which level the scene was solved, or empty"}
"""Columns of text; only scenes that climb have a level each."""
NOT_VARIABLES = ("index", "r_mm", *WORDS)
BLOCK_SCENES = 64
"""Some 10 MB of rows with five loads each."""


def write_dataset(journal: Journal, path: Path) -> None:
    """Write the journal's rows by their index to a netCDF file, whole or not at all."""
    solved = _first_solved(journal)
    temporary = path.with_suffix(path.suffix + ".tmp")
    try:
        _fill(temporary, journal, solved)
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)
    sync_directory(path.parent)


def _fill(temporary: Path, journal: Journal, solved: Row) -> None:
    with h5netcdf.File(temporary, "w") as file:
        empty_of = _lay_out(file, journal, solved)
        rows, start = journal.in_order(), 0
        while block := list(islice(rows, BLOCK_SCENES)):
            stop = start + len(block)
            for name, empty in empty_of.items():
                file[name][start:stop] = np.array([row.get(name, empty) for row in block], dtype=float)
            for name in (name for name in WORDS if name in solved):
                file[name][start:stop] = np.array([row.get(name, "") for row in block], dtype=object)
            start = stop
    with temporary.open("rb") as written:
        os.fsync(written.fileno())


def origin_of(path: Path) -> Any:
    """Return what a file says it is a sweep of, as `SweepPlan.as_record`; None for a file that is no sweep."""
    try:
        with h5netcdf.File(path, "r") as file:
            return json.loads(file.attrs["origin"])
    except (OSError, KeyError, ValueError):
        return None


def _first_solved(journal: Journal) -> Row:
    reason = ""
    for row in journal.in_order():
        if not row["reason"]:
            return row
        reason = reason or row["reason"]
    action = f"the first reason was: {reason.removesuffix('.')}; all reasons stand in {journal.path}"
    raise InvalidQuantity("scenes solved", 0, "at least one", action)


def _lay_out(file: h5netcdf.File, journal: Journal, solved: Row) -> dict[str, NDArray[np.float64]]:
    """Create dimensions, coordinates and empty variables; return the value of each variable in a failed row."""
    file.attrs.update(schema=journal.plan["schema"], origin=json.dumps(journal.plan), **journal.software)
    coordinates = {"r_mm": (np.asarray(solved["r_mm"], dtype=float), "mm")}
    if "forces_n" in journal.plan:
        coordinates = {"load": (np.asarray(journal.plan["forces_n"], dtype=float), "N")} | coordinates
    file.dimensions = {"scene": len(journal)} | {name: len(values) for name, (values, _) in coordinates.items()}
    for name, (values, unit) in coordinates.items():
        _create(file, name, (name,), unit)[...] = values
    empty_of = {}
    for name in (name for name in solved if name not in NOT_VARIABLES):
        empty_of[name] = np.full_like(np.asarray(solved[name], dtype=float), np.nan)
        _create(file, name, ("scene", *list(coordinates)[: empty_of[name].ndim]), unit_of(name))
    for name in (name for name in WORDS if name in solved):
        words = file.create_variable(name, ("scene",), h5py.string_dtype())
        words.attrs["long_name"] = WORDS[name]
    return empty_of


def _create(file: h5netcdf.File, name: str, dimensions: tuple[str, ...], unit: str) -> h5netcdf.Variable:
    variable = file.create_variable(name, dimensions, float, fillvalue=np.nan)
    variable.attrs["units"] = unit
    if meaning := MEANINGS.get(OF_SWEEPS.get(name, name)) or INCLUSION.get(name):
        variable.attrs["long_name"] = meaning
    return variable
