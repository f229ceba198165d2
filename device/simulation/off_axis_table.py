"""What a lump off the probe's axis adds to the face, and what a tilted probe does, for the virtual probe.

Small strain in three dimensions: fields are proportional to the force (or the tilt) and depend on radius and on the
angle from the direction of the lump, as a cosine series. Between the solved moduli what counts is the contrast of an
incompressible sphere, (E - Et) / (E + 3/2 Et), in which the field is all but linear. Written by `host_tools table`.
Source: Eshelby, Proc. R. Soc. A 241 (1957), on the contrast.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, require
from device.simulation.chebyshev import interpolation_weights
from device.simulation.table_file import load_table, save_table

Array = NDArray[np.float64]
NAME, SCHEMA = "off_axis_table", "tsis.off_axis_table/1"
ACTION = "run `host_tools table` to make it again"
TISSUE_KPA = 5.0
FADING_MM = 2.5
"""Length over which a lump beyond the largest offset stops to count; assumed, it moves the rim at most."""
FORGOTTEN = 1e-3
"""What is left of a lump that is not looked for any more: farther off, any inclusion will do."""


def contrast(youngs_modulus_kpa: float | Array, tissue_kpa: float = TISSUE_KPA) -> float | Array:
    """Return (E - Et) / (E + 3/2 Et): 0 for tissue, 1 for a rigid sphere."""
    return (youngs_modulus_kpa - tissue_kpa) / (youngs_modulus_kpa + 1.5 * tissue_kpa)


@dataclass(frozen=True)
class OffAxisTable:
    """`lump_per_n_mm3` [2, S, D, M, O, K, R]; `tilt_per_deg` [2, R] times the cosine of the angle; w first, then p."""

    size_mm: Array
    depth_mm: Array
    youngs_modulus_kpa: Array
    offset_mm: Array
    r_mm: Array
    lump_per_n_mm3: Array
    tilt_per_deg: Array

    def centred_share(self, offset_mm: float) -> float:
        """Return how much of the mean over the angle is still the centred lump's: from 1 on the axis to 0."""
        return 1 - min(offset_mm / float(self.offset_mm[0]), 1.0) ** 2

    def modes(self, inclusion: Inclusion, offset_mm: float) -> Array:
        """Return the modes [2, K, R] for 1 N of a lump off the axis, but for the centred lump's share.

        Nearer than the first offset of the table the k-th mode grows with the k-th power of the offset, as it must for
        a smooth field (the mean over the angle with the second). Beyond the last the lump's field fades.
        Raises `InvalidQuantity` for an inclusion outside the table.
        """
        first_mm, last_mm = float(self.offset_mm[0]), float(self.offset_mm[-1])
        fading = np.exp(-max(offset_mm - last_mm, 0.0) / FADING_MM)
        if fading < FORGOTTEN:
            return np.zeros((2, *np.shape(self.lump_per_n_mm3)[-2:]))
        modes = fading * self._modes(inclusion, min(max(offset_mm, first_mm), last_mm))
        power = np.arange(modes.shape[1])
        power[0] = 2
        return np.asarray(modes * (min(offset_mm / first_mm, 1.0) ** power)[:, None])

    def _modes(self, inclusion: Inclusion, offset_mm: float) -> Array:
        size_mm, fields = inclusion.size_mm, self.lump_per_n_mm3
        require("size_mm", size_mm, Bound(0.0, float(self.size_mm[-1]), "mm"), ACTION)
        at = dict(zip(UNKNOWNS, inclusion.as_tuple(), strict=True)) | {"size_mm": max(size_mm, self.size_mm[0])}
        for name in (*UNKNOWNS, "offset_mm"):
            points: Array = getattr(self, name)
            value = at.get(name, offset_mm)
            unit = "kPa" if name.endswith("_kpa") else "mm"
            require(name, value, Bound(points[0], points[-1], unit), "choose an inclusion inside the table's range")
            if name == "youngs_modulus_kpa":
                points, value = np.asarray(contrast(points)), float(contrast(value))
            fields = np.tensordot(interpolation_weights(points, value), fields, (0, 1))
        return np.asarray(size_mm**3 * fields)

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write off_axis_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in self.__dataclass_fields__}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table", **origin})


def load_off_axis_table(folder: Path) -> OffAxisTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, tuple(OffAxisTable.__dataclass_fields__), ACTION)
    return OffAxisTable(**{name: values.astype(np.float64) for name, values in arrays.items()})
