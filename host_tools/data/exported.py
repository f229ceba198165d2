"""Measurements that a probe has exported as arrays (.npz) to a netCDF data set with units.

A probe of this release exports that itself (`GET exports/measurements.nc`); this is for arrays that were kept.
"""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np

from device import __version__
from device.files.durable import write_durably
from device.files.netcdf_file import netcdf_of_arrays
from device.measurement.quantities import UNKNOWNS, InvalidQuantity

IDENTIFIABLE = tuple(f"{name.rsplit('_', 1)[0]}_identifiable" for name in UNKNOWNS)


def _arrays_in(npz: Path) -> dict[str, np.ndarray]:
    """Return the arrays of a probe's .npz; raises `InvalidQuantity` when it is none."""
    try:
        with np.load(npz, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except (ValueError, zipfile.BadZipFile, EOFError) as error:
        raise _refused(npz, f"no .npz ({error})") from None
    missing = {"measurement_id", "features", "feature_names", *UNKNOWNS, *IDENTIFIABLE} - arrays.keys()
    if missing:
        raise _refused(npz, f"without {', '.join(sorted(missing))}")
    return _without_undetermined(arrays)


def _without_undetermined(arrays: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return arrays without what no press determines: of that releases of before exported a middle of the possible."""
    told = dict(arrays)
    for name in UNKNOWNS:
        stem, unit = name.rsplit("_", 1)
        for column in {name, f"{stem}_std_{unit}"} & arrays.keys():
            told[column] = np.where(arrays[f"{stem}_identifiable"] == 1, arrays[column], np.nan)
    return told


def _refused(npz: Path, why: str) -> InvalidQuantity:
    return InvalidQuantity(
        "measurements", npz, f"a file of `GET exports/measurements.npz`, not one {why}", "export them again"
    )


def write_netcdf(npz: Path, out: Path) -> int:
    """Write a new netCDF file of a probe's .npz; return how many measurements it has.

    Whole or not at all. Texts, numbers and flags are as the probe wrote them: NaN, "" and -1 are what is not known, and
    NaN of what a press does not determine.
    Raises `InvalidQuantity` for what is no export, `FileExistsError` for a file that is there: nothing is replaced.
    """
    arrays = _arrays_in(npz)
    if out.exists():
        raise FileExistsError(f"{out} is there already: choose another name.")
    write_durably(out, netcdf_of_arrays(arrays, f"made of {npz.name} by release {__version__}"))
    return len(arrays["measurement_id"])
