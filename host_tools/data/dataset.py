"""Rows of a sweep to one netCDF file with units, and back to what training needs.

A failed scene stays in the file as a row of NaN with its reason. The nine phantom scenes are the rows nearest to an
orthogonal array over the box, so that calibration sees all of it; the other rows train. Source of 125 + 9: Lee & Won
2013, section IV; of the array: Taguchi's L9.
"""

from __future__ import annotations

import hashlib
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from device.measurement.inversion import FEATURE_UNITS
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.data.journal import Row
from host_tools.inverse.train import TrainingRows
from host_tools.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW

FEATURES = tuple(FEATURE_UNITS)
SCHEMA = "tsis.sweep/1"
UNITS = {"_mm": "mm", "_mm2": "mm2", "_mm3": "mm3", "_kpa": "kPa", "_n": "N"}
L9 = np.array([(0, 0, 0), (0, 1, 1), (0, 2, 2), (1, 0, 1), (1, 1, 2), (1, 2, 0), (2, 0, 2), (2, 1, 0), (2, 2, 1)])
PHANTOM_LOW, PHANTOM_HIGH = (5.0, 4.5, 50.0), (14.0, 10.0, 110.0)
"""Corners of the phantoms' part of the box: inclusions that can be made and that the probe can see."""


def write_dataset(rows: list[Row], origin: Row, path: Path) -> None:
    """Write rows (one a scene, in order) to a netCDF file, whole or not at all."""
    solved = next((row for row in rows if not row["reason"]), None)
    if solved is None:
        raise InvalidQuantity("scenes solved", 0, "at least one", f"the first reason was: {rows[0]['reason']}")
    names = [name for name in solved if name not in ("index", "reason", "r_mm")]
    variables: dict[str, Any] = {name: _column(name, rows, solved) for name in names}
    variables["reason"] = ("scene", [row["reason"] for row in rows], {"long_name": "why the scene failed, or empty"})
    dataset = xr.Dataset(variables, coords={"r_mm": ("r_mm", solved["r_mm"], {"units": "mm"})})
    dataset.attrs = {"schema": SCHEMA, "origin": json.dumps(origin)}
    temporary = path.with_suffix(path.suffix + ".tmp")
    dataset.to_netcdf(temporary, engine="h5netcdf")
    with temporary.open("rb") as file:
        os.fsync(file.fileno())
    temporary.replace(path)


def _column(name: str, rows: list[Row], solved: Row) -> tuple[tuple[str, ...], NDArray[np.float64], dict[str, str]]:
    empty = np.full_like(np.asarray(solved[name], dtype=float), np.nan)
    values = np.array([row.get(name, empty) for row in rows], dtype=float)
    unit = UNITS["_" + name.rpartition("_")[2]]
    return ("scene", "r_mm") if values.ndim == 2 else ("scene",), values, {"units": unit}


def read_dataset(path: Path) -> xr.Dataset:
    """Return the data set in memory; raise `InvalidQuantity` when the file is no sweep."""
    try:
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            loaded = dataset.load()
    except (OSError, ValueError) as error:
        raise InvalidQuantity(
            "data set", path, "a netCDF file made by `host_tools sweep`", f"make it anew ({error})"
        ) from error
    if loaded.attrs.get("schema") != SCHEMA:
        raise InvalidQuantity("schema", loaded.attrs.get("schema"), SCHEMA, "make the data set with this version")
    return loaded


def training_rows(path: Path) -> TrainingRows:
    """Return the solved rows of a sweep as features and truths, with the nine phantoms marked and failures counted."""
    dataset = read_dataset(path)
    solved = dataset.isel(scene=np.flatnonzero(dataset["reason"].values == ""))
    truth = np.column_stack([solved[name].values for name in UNKNOWNS])
    features = np.column_stack([solved[name].values for name in FEATURES])
    origin: dict[str, Any] = json.loads(dataset.attrs["origin"])
    return TrainingRows(
        feature_names=FEATURES,
        features=features,
        truth=truth,
        phantom_index=phantom_index(truth),
        dataset_sha256=hashlib.sha256(np.column_stack([truth, features]).tobytes()).hexdigest(),
        scene_defaults=origin["scene_defaults"],
        excluded_rows=int(dataset.sizes["scene"] - solved.sizes["scene"]),
    )


def phantom_index(truth: NDArray[np.float64]) -> NDArray[np.int64]:
    """Return the rows nearest to the nine designs, each row once; fewer when there are fewer rows."""
    low, high = np.array(PHANTOM_LOW), np.array(PHANTOM_HIGH)
    scale = np.array(PAPER_BOX_HIGH) - np.array(PAPER_BOX_LOW)
    distance = np.linalg.norm((truth[:, None] - (low + L9 / 2 * (high - low))) / scale, axis=2)
    chosen: list[int] = []
    for design in range(min(len(L9), len(truth))):
        distance[chosen, design] = np.inf
        chosen.append(int(distance[:, design].argmin()))
    return np.array(chosen)
