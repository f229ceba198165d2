"""The netCDF file of a sweep to what training needs.

Scenes that failed, and rows that lack a number of feature or truth, are counted and left out. The nine phantom scenes
are the rows nearest to an orthogonal array over the box, so that calibration sees all of it; the other rows train.
Source of 125 + 9: Lee & Won 2013, section IV; of the array: Taguchi's L9.
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from device.measurement.paper_mode.estimate import PAPER_UNITS
from device.measurement.quantities import UNKNOWNS, InvalidQuantity
from host_tools.data.plan import SCHEMA, SCHEMA_OF_LOADS
from host_tools.paper_network.train import MIN_TRAINING_ROWS, TrainingRows
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW

FEATURES = tuple(PAPER_UNITS)
L9 = np.array([(0, 0, 0), (0, 1, 1), (0, 2, 2), (1, 0, 1), (1, 1, 2), (1, 2, 0), (2, 0, 2), (2, 1, 0), (2, 2, 1)])
PHANTOM_LOW, PHANTOM_HIGH = (5.0, 4.5, 50.0), (14.0, 10.0, 110.0)
"""Corners of the phantoms' part of the box: inclusions that can be made and that the probe can see."""


def read_dataset(path: Path) -> xr.Dataset:
    """Return the data set in memory; raise `InvalidQuantity` when the file is no sweep."""
    try:
        with xr.open_dataset(path, engine="h5netcdf") as dataset:
            loaded = dataset.load()
    except (OSError, ValueError) as error:
        raise InvalidQuantity(
            "data set", path, "a netCDF file made by `host_tools sweep`", f"make it anew ({error})"
        ) from error
    schema = loaded.attrs.get("schema")
    if schema not in (SCHEMA, SCHEMA_OF_LOADS):
        bound = f"{SCHEMA} or {SCHEMA_OF_LOADS}"
        raise InvalidQuantity("schema", schema, bound, "make the data set with this version")
    return loaded


def training_rows(path: Path) -> TrainingRows:
    """Return the usable rows of a sweep as features and truths, with the nine phantoms marked and the others counted.

    A row is left out when it gives a reason for having failed, or when a feature or a truth is not finite. Raise
    `InvalidQuantity` for a data set of several loads, of finite strain or with a tolerance, since the three features
    are of one load and must not jump from level to level, and for one without a column that training needs.
    """
    dataset = read_dataset(path)
    if "load" in dataset.dims:
        bound = f"{SCHEMA}, of one load in small strain"
        raise InvalidQuantity(
            "schema", SCHEMA_OF_LOADS, bound, "sweep with one force, without --strain and --tolerance"
        )
    _require_columns(dataset)
    truth = np.column_stack([dataset[name].values for name in UNKNOWNS])
    features = np.column_stack([dataset[name].values for name in FEATURES])
    usable = (dataset["reason"].values == "") & np.isfinite(np.column_stack([truth, features])).all(axis=1)
    truth, features = truth[usable], features[usable]
    origin: dict[str, Any] = json.loads(dataset.attrs["origin"])
    return TrainingRows(
        feature_names=FEATURES,
        features=features,
        truth=truth,
        phantom_index=phantom_index(truth),
        dataset_sha256=hashlib.sha256(np.column_stack([truth, features]).tobytes()).hexdigest(),
        scene_defaults=origin["scene_defaults"],
        excluded_rows=int(np.sum(~usable)),
    )


def require_enough(rows: TrainingRows, path: Path) -> None:
    """Raise `InvalidQuantity` for fewer usable rows of a file than training needs beside the nine phantoms."""
    usable, needed = len(rows.features), MIN_TRAINING_ROWS + len(L9)
    if usable < needed:
        found = f"{usable} of {usable + rows.excluded_rows}"
        bound = f"at least {needed}, {MIN_TRAINING_ROWS} that train and {len(L9)} phantoms that never do"
        raise InvalidQuantity(f"usable rows of {path}", found, bound, "sweep more scenes")


def _require_columns(dataset: xr.Dataset) -> None:
    action = "make the data set anew with `host_tools sweep`"
    for name in (*UNKNOWNS, *FEATURES, "reason"):
        if name not in dataset:
            raise InvalidQuantity(name, "missing", "a column of the data set", action)
    if "origin" not in dataset.attrs:
        raise InvalidQuantity("origin", "missing", "an attribute of the data set", action)


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
