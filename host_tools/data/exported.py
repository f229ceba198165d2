"""Measurements that a probe has exported as arrays (.npz) to a netCDF data set with units.

A probe of this release exports that itself (`GET exports/measurements.nc`); this is for arrays that were kept.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import xarray as xr

from device.measurement.quantities import UNKNOWNS, InvalidQuantity, unit_of


def exported_dataset(npz: Path) -> xr.Dataset:
    """Return measurements (`measurement`) and their features (`measurement`, `feature`) of a probe's .npz.

    Raises `InvalidQuantity` when it is none. Texts, numbers and flags are as the probe wrote them: NaN, "" and -1 are
    what is not known.
    """
    try:
        with np.load(npz, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (ValueError, zipfile.BadZipFile, EOFError) as error:
        raise _refused(npz, f"no .npz ({error})") from None
    missing = {"measurement_id", "features", "feature_names", *UNKNOWNS} - arrays.keys()
    if missing:
        raise _refused(npz, f"without {', '.join(sorted(missing))}")
    names, features = arrays.pop("feature_names"), arrays.pop("features")
    dataset = xr.Dataset(
        {name: ("measurement", values, _attributes(name, values)) for name, values in arrays.items()},
        coords={"feature": names},
        attrs={"schema": "tsis.measurements/1", "source": npz.name},
    )
    dataset["features"] = ("measurement", "feature"), features
    dataset["feature_unit"] = "feature", np.array([unit_of(str(name)) for name in names], dtype=np.str_)
    return dataset


def _attributes(name: str, values: np.ndarray) -> dict[str, str]:
    """Return the unit of what is measured; numbers of things, flags and texts have none."""
    return {"units": unit_of(name)} if np.issubdtype(values.dtype, np.floating) else {}


def _refused(npz: Path, why: str) -> InvalidQuantity:
    return InvalidQuantity(
        "measurements", npz, f"a file of `GET exports/measurements.npz`, not one {why}", "export them again"
    )


def write_netcdf(npz: Path, out: Path) -> int:
    """Write a new netCDF file of a probe's .npz; return how many measurements it has. Raises as `exported_dataset`.

    Raises `FileExistsError` for a file that is there: nothing is replaced.
    """
    dataset = exported_dataset(npz)
    if out.exists():
        raise FileExistsError(f"{out} is there already: choose another name.")
    dataset.to_netcdf(out, engine="h5netcdf")
    return int(dataset.sizes["measurement"])
