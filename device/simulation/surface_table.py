"""The virtual probe's mechanics: a table of faces under a force ramp, so that no finite elements run on the device.

For every (size, depth, Young's modulus) of the paper's box and every force up to 0.8 N it gives deformation w(r) and
contact pressure p(r) of the face: those without a lump, and what the lump adds. Finite strain with true sliding, so
neither is proportional to the force; both are kept per newton, and what a lump adds also per mm3 of its size cubed,
because those are smooth. Chebyshev polynomials in size, depth, ln E and force. Written by `host_tools table`.
Source: Trefethen, Approximation Theory and Approximation Practice, chapter 5 (barycentric interpolation).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import UNKNOWNS, Bound, Inclusion, require
from device.simulation.chebyshev import interpolation_weights
from device.simulation.table_file import load_table, save_table

Array = NDArray[np.float64]
NAME, SCHEMA = "surface_table", "tsis.surface_table/2"
ACTION = "run `host_tools table` to make it again"


class Face(NamedTuple):
    """Deformation (mm) and contact pressure (kPa) of the face at the table's radii [R]."""

    w_mm: Array
    p_kpa: Array


@dataclass(frozen=True)
class Ramp:
    """One scene's faces over the force: `fields_per_n` [2, F, R] are w and p over the force at `force_n` [F]."""

    force_n: Array
    fields_per_n: Array

    def at(self, force_n: float) -> Face:
        """Return the face under a force (N, not negative); beyond the table the largest one's, in proportion."""
        weights = interpolation_weights(self.force_n, min(force_n, float(self.force_n[-1])))
        w_mm, p_kpa = force_n * np.tensordot(weights, self.fields_per_n, (0, 1))
        return Face(w_mm, p_kpa)

    def at_small_strain(self, force_n: float) -> Face:
        """Return the face under a force if it stayed proportional to what it is under the smallest one."""
        w_mm, p_kpa = force_n * self.fields_per_n[:, 0]
        return Face(w_mm, p_kpa)


class PressRamps(NamedTuple):
    """The ramp without a lump and what one lump adds, at radii `r_mm` [R]."""

    r_mm: Array
    bare: Ramp
    lump: Ramp


@dataclass(frozen=True)
class SurfaceTable:
    """`bare_per_n` [2, F, R] without a lump, `lump_per_n_mm3` [2, S, D, M, F, R] what one adds; w first, then p.

    Sizes begin at 1 mm: a smaller lump's field is that one's, scaled with its volume.
    """

    size_mm: Array
    depth_mm: Array
    youngs_modulus_kpa: Array
    force_n: Array
    r_mm: Array
    bare_per_n: Array
    lump_per_n_mm3: Array

    def ramps(self, inclusion: Inclusion) -> PressRamps:
        """Return the ramps of one inclusion; refuses one outside the table."""
        return PressRamps(self.r_mm, Ramp(self.force_n, self.bare_per_n), self.lump(inclusion))

    def lump(self, inclusion: Inclusion) -> Ramp:
        """Return what an inclusion adds to the ramp; refuses one outside the table."""
        size_mm, fields = inclusion.size_mm, self.lump_per_n_mm3
        require("size_mm", size_mm, Bound(0.0, float(self.size_mm[-1]), "mm"), "choose one inside the table's range")
        for name in UNKNOWNS:
            points: Array = getattr(self, name)
            value = max(size_mm, points[0]) if name == "size_mm" else getattr(inclusion, name)
            unit = "kPa" if name.endswith("_kpa") else "mm"
            require(name, value, Bound(points[0], points[-1], unit), "choose an inclusion inside the table's range")
            if name == "youngs_modulus_kpa":
                points, value = np.log(points), np.log(value)
            fields = np.tensordot(interpolation_weights(points, value), fields, (0, 1))
        return Ramp(self.force_n, size_mm**3 * fields)

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write surface_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in self.__dataclass_fields__}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table", **origin})


def load_surface_table(folder: Path) -> SurfaceTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, tuple(SurfaceTable.__dataclass_fields__), ACTION)
    return SurfaceTable(**{name: values.astype(np.float64) for name, values in arrays.items()})
