"""The virtual probe's mechanics: a table of faces under a force ramp, so that no finite elements run on the device.

For every inclusion (1-15 mm, 4-12 mm deep, 8-200 kPa), slab of tissue and force it gives deformation w(r) and contact
pressure p(r) of the face: those without an inclusion, and what the inclusion adds. Finite strain with true sliding, so
neither is proportional to the force; both are kept per newton, and what an inclusion adds also per mm3 of its size
cubed and over its mismatch, because those are smooth. Chebyshev polynomials in size, depth, mismatch and force; a slab
other than the nominal adds a change that is quadratic in ln Et and in 1/T. Written by `host_tools table`. Source:
Trefethen, Approximation Theory and Approximation Practice, chapter 5 (barycentric interpolation).
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import interpolation_weights
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.table_file import load_table, save_table

NAME, SCHEMA = "surface_table", "tsis.surface_table/3"
ACTION = "run `host_tools table` to make it again"
COARSE = slice(None, None, 2)
"""The changes with the slab are kept at every second size and depth: of an odd number of Chebyshev points these are
Chebyshev points as well."""


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
    """The ramp without an inclusion and what one inclusion adds, at radii `r_mm` [R].

    `nominal_inclusion_field` is what one of the same mismatch adds in the nominal slab, None where that is `inclusion`
    itself.
    """

    r_mm: Array
    baseline: Ramp
    inclusion_field: Ramp
    nominal_inclusion_field: Ramp | None = None


@dataclass(frozen=True)
class SurfaceTable:
    """`bare_per_n` [2, F, R] without an inclusion, `lump_per_n_mm3` [2, S, D, M, F, R] what one adds; w first, then p.

    Both are of the nominal slab. `bare_change_per_n` [4, ...] and `lump_change_per_n_mm3` [4, ...] are what the first
    and last of `slab_modulus_kpa` [3] and of `slab_thickness_mm` [3] change at the same mismatch and the same force
    over the tissue's modulus, at `COARSE` sizes and depths; the middle ones are nominal.
    """

    size_mm: Array
    depth_mm: Array
    elastic_mismatch: Array
    slab_modulus_kpa: Array
    slab_thickness_mm: Array
    force_n: Array
    r_mm: Array
    bare_per_n: Array
    lump_per_n_mm3: Array
    bare_change_per_n: Array
    lump_change_per_n_mm3: Array

    def ramps(self, inclusion: Inclusion, slab: Slab = NOMINAL) -> PressRamps:
        """Return the ramps of one inclusion in a slab; refuses one outside the table.

        They reach to 0.78 N times the tissue's modulus over 5 kPa: as deep in every tissue.
        """
        inclusion_field = self.inclusion_field(inclusion, slab)
        baseline = self._ramp(slab, self.bare_per_n + self._changed(self.bare_change_per_n, slab))
        nominal = None if slab == NOMINAL else self.inclusion_field(slab.nominal_equivalent(inclusion))
        return PressRamps(self.r_mm, baseline, inclusion_field, nominal)

    def inclusion_field(self, inclusion: Inclusion, slab: Slab = NOMINAL) -> Ramp:
        """Return what an inclusion adds to the ramp in a slab; refuses one outside the table."""
        fine = InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)
        coarse = InclusionAxes(self.size_mm[COARSE], self.depth_mm[COARSE], self.elastic_mismatch)
        change = coarse.inclusion_per_n(self._changed(self.lump_change_per_n_mm3, slab), inclusion, slab)
        return self._ramp(slab, fine.inclusion_per_n(self.lump_per_n_mm3, inclusion, slab) + change)

    def _ramp(self, slab: Slab, fields_per_n: Array) -> Ramp:
        return Ramp(self.force_n * slab.stiffness_ratio, fields_per_n)

    def _changed(self, changes: Array, slab: Slab) -> Array:
        """Return the sum of the changes [4, ...] that a slab makes: none in the nominal one."""
        modulus = interpolation_weights(np.log(self.slab_modulus_kpa), np.log(slab.youngs_modulus_kpa))
        thickness = interpolation_weights(1 / self.slab_thickness_mm, 1 / slab.thickness_mm)
        return np.tensordot(np.concatenate([modulus[[0, 2]], thickness[[0, 2]]]), changes, (0, 0))

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write surface_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in self.__dataclass_fields__}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table", **origin})


def load_surface_table(folder: Path) -> SurfaceTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, tuple(SurfaceTable.__dataclass_fields__), ACTION)
    return SurfaceTable(**{name: values.astype(np.float64) for name, values in arrays.items()})
