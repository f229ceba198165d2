"""Measurements as one netCDF data set with units, `tsis.measurements/1`: the arrays of an export, for xarray.

h5netcdf writes it by HDF5, in memory; its libraries are loaded with the first such export. A text is of any length;
what is not known is as in the arrays.
"""

from __future__ import annotations

import io
from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

import numpy as np

from device.measurement.calibration import written
from device.measurement.confidence_belt import COVERAGE
from device.measurement.feature_definitions import unit_of_feature
from device.measurement.quantities import unit_of

SCHEMA = "tsis.measurements/1"
CONVENTIONS = "CF-1.8"
INCLUSION = {
    "size_mm": "diameter of the inclusion",
    "depth_mm": "depth of the inclusion's top below the skin",
    "youngs_modulus_kpa": "Young's modulus of the inclusion",
}
PARTS = {
    "low": "lower end of the {level:g} % interval, {whole}",
    "high": "upper end of the {level:g} % interval, {whole}",
    "std": "{whole}: spread that the press leaves; in mode paper scatter over its frames",
}


def _meanings() -> dict[str, str]:
    """Return what the columns of unknowns are, in words."""
    told = dict(INCLUSION)
    for name, whole in INCLUSION.items():
        stem, unit = name.rsplit("_", 1)
        told |= {
            f"{stem}_{part}_{unit}": words.format(level=100 * COVERAGE, whole=whole) for part, words in PARTS.items()
        }
    return told


MEANINGS = _meanings()
NOT_DETERMINED = "NaN where the press does not determine it; the interval holds what is possible"
COMMENTS = {name: NOT_DETERMINED for name in MEANINGS if name in INCLUSION or "_std_" in name}


FLAGS = {"flag_values": np.array([-1, 0, 1], np.int8), "flag_meanings": "not_known false true"}
"""Of what is true or false (CF, 3.5): a fill value instead would make readers turn -1 into NaN."""
LEAST_KNOWN = {"frames": 1, "ramps": 1, "measurement_version": 1}
"""Below it stands the -1 of what is not known (CF, 2.5.1: outside `valid_min` is missing)."""


def netcdf_of_arrays(arrays: Mapping[str, np.ndarray], done: str) -> bytes:
    """Return the file of the arrays of an export, each as long as `features`.

    Its `source` is the probes that measured, its `history` when that was `done`.
    """
    import h5netcdf  # type: ignore[import-untyped]

    names, features = arrays["feature_names"], arrays["features"]
    content = io.BytesIO()
    with h5netcdf.File(content, "w") as file:
        file.dimensions = {"measurement": features.shape[0], "feature": features.shape[1]}
        file.attrs.update({"Conventions": CONVENTIONS, "schema": SCHEMA, "source": _source(arrays)})
        file.attrs.update({"history": f"{written(datetime.now(UTC))} {done}", "interval_level_percent": 100 * COVERAGE})
        for name, values in arrays.items():
            if name in ("feature_names", "features"):
                continue
            _add(file, name, ("measurement",), values, unit_of(name) if values.dtype.kind == "f" else None)
        _add(file, "features", ("measurement", "feature"), features)
        _add(file, "feature", ("feature",), names)
        units = [unit_of_feature(str(name)) for name in names]
        _add(file, "feature_unit", ("feature",), np.array(units, dtype=np.str_))
    return content.getvalue()


def _source(arrays: Mapping[str, np.ndarray]) -> str:
    """Return which probes measured: after a restore not the one that exports, or not it alone.

    Arrays of an early release do not say.
    """
    serials = arrays.get("serial", np.full(len(arrays["features"]), ""))
    probes = [str(one) or "unknown" for one in sorted(set(serials))]
    return f"probe{'' if len(probes) == 1 else 's'} {', '.join(probes)}" if probes else "no measurement"


def _add(file: Any, name: str, dimensions: tuple[str, ...], values: np.ndarray, unit: str | None = None) -> None:
    """Add a variable: numbers as they are, texts as texts of any length."""
    import h5py  # type: ignore[import-untyped]

    if values.dtype.kind == "U":
        added = file.create_variable(name, dimensions, h5py.string_dtype())
        values = values.astype(object)
    else:
        added = file.create_variable(name, dimensions, values.dtype)
    if values.size:
        added[...] = values
    if unit is not None:
        added.attrs["units"] = unit
    if values.dtype == np.int8:
        added.attrs.update(FLAGS)
    if name in LEAST_KNOWN:
        added.attrs["valid_min"] = values.dtype.type(LEAST_KNOWN[name])
    for attribute, words in (("long_name", MEANINGS), ("comment", COMMENTS)):
        if name in words:
            added.attrs[attribute] = words[name]
