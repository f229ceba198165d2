"""Measurements as NumPy arrays: in one .npz without pickled objects (`numpy.load(file, allow_pickle=False)` reads it),
or in one netCDF data set with units.

What is not known is NaN among numbers, "" among texts, and -1 where else 0 is false and 1 true.
"""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from device import __version__
from device.errors import InvalidRequest
from device.exports.selection import Exported
from device.exports.table import WIDE_COLUMNS
from device.files.netcdf_file import netcdf_of_arrays

MOST = 20_000
"""So many measurements are held in memory at a time, some 40 MB with the features of mode standard."""
TRUTHS = ("identifiable", "is_open", "reached", "simulated")
WHOLE = ("seq", "frames", "ramps", "measurement_version")
TEXTS = (
    "_id", "_at", "_utc", "_local", "_ref", "_issuer", "_number", "_by", "_reason", "_sha256", "kind", "side",
    "operator", "note", "mode", "status", "reason", "warnings", "model", "serial", "software",
)  # fmt: skip


def arrays_of(exported: Iterable[Exported]) -> dict[str, np.ndarray]:
    """Return the columns of the wide table, [n] each, and `features` [n, F] with `feature_names` [F].

    Raises `InvalidRequest` for more than `MOST` measurements.
    """
    chosen: list[Exported] = []
    for one in exported:
        chosen.append(one)
        if len(chosen) > MOST:
            raise InvalidRequest(f"There are more than {MOST} measurements.", "Choose fewer: by exam, time or mode.")
    columns = {name: _column(name, [cell(one) for one in chosen]) for name, cell in WIDE_COLUMNS.items()}
    features = [one.measurement["features"] for one in chosen]
    names = sorted({name for of_one in features for name in of_one})
    values = [[of_one.get(name, np.nan) for name in names] for of_one in features]
    table = np.array(values, dtype=np.float64).reshape(len(chosen), len(names))
    return {**columns, "feature_names": np.array(names, dtype=np.str_), "features": table}


def npz_of(exported: Iterable[Exported]) -> bytes:
    """Return the .npz; raises as `arrays_of`."""
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **arrays_of(exported))
    return content.getvalue()


def netcdf_of(exported: Iterable[Exported]) -> bytes:
    """Return the netCDF file; raises as `arrays_of`."""
    return netcdf_of_arrays(arrays_of(exported), f"exported by release {__version__}")


def _column(name: str, cells: list[Any]) -> np.ndarray:
    if name.endswith(TRUTHS):
        return np.array([-1 if cell is None else int(cell) for cell in cells], dtype=np.int8)
    if name.endswith(TEXTS):
        return np.array(["" if cell is None else cell for cell in cells], dtype=np.str_)
    if name in WHOLE:
        return np.array([-1 if cell is None else cell for cell in cells], dtype=np.int64)
    return np.array([np.nan if cell is None else cell for cell in cells], dtype=np.float64)
