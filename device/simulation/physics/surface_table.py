"""The virtual probe's mechanics: a table of faces under a force ramp, so that no finite elements run on the device.

For every inclusion (1-15 mm, 4-12 mm deep, 8-200 kPa) in the nominal slab and every force it gives deformation w(r) and
contact pressure p(r) of the face: those without an inclusion, and what the inclusion adds. Finite strain with true
sliding, so neither is proportional to the force; both are kept per newton, and what an inclusion adds also per mm3 of
its size cubed and over its mismatch, because those are smooth. Chebyshev polynomials in size, depth, mismatch and
force. Another slab adds its change at the same force and mismatch (`slab_changes.py`). Written by `host_tools table`.
Source: Trefethen, Approximation Theory and Approximation Practice, chapter 5 (barycentric interpolation).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import interpolation_weights
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import SlabChanges, field_shapes

NAME, SCHEMA = "surface_table", "tsis.surface_table/4"
ACTION = "run `host_tools table` to make it again"


class Face(NamedTuple):
    """Deformation (mm) and contact pressure (kPa) of the face at the table's radii [R]."""

    w_mm: Array
    p_kpa: Array


@dataclass(frozen=True)
class Ramp:
    """One scene's faces over the force: `fields_per_n` [2, F, R] are w and p over the force at `force_n` [F].

    They hold to the last of these, or to `largest_n`.
    """

    force_n: Array
    fields_per_n: Array
    largest_n: float = math.inf

    def at(self, force_n: float) -> Face:
        """Return the face under a force (N, not negative); beyond what holds the largest one's, in proportion."""
        weights = interpolation_weights(self.force_n, min(force_n, float(self.force_n[-1]), self.largest_n))
        w_mm, p_kpa = force_n * np.tensordot(weights, self.fields_per_n, (0, 1))
        return Face(w_mm, p_kpa)

    def at_small_strain(self, force_n: float) -> Face:
        """Return the face under a force if it stayed proportional to what it is under the smallest one."""
        w_mm, p_kpa = force_n * self.fields_per_n[:, 0]
        return Face(w_mm, p_kpa)


class PressRamps(NamedTuple):
    """The ramp without an inclusion and what one inclusion adds, at radii `r_mm` [R].

    `tabulated_inclusion_field` is what it adds under the layers and at the place that fields off the axis are tabulated
    with, None where that is `inclusion_field` itself.
    """

    r_mm: Array
    baseline: Ramp
    inclusion_field: Ramp
    tabulated_inclusion_field: Ramp | None = None


@dataclass(frozen=True)
class SurfaceTable:
    """`bare_per_n` [2, F, R] without an inclusion, `lump_per_n_mm3` [2, S, D, M, F, R] what one adds; w first, then p.

    Both are of the nominal slab; `slabs` is what others change.
    """

    size_mm: Array
    depth_mm: Array
    elastic_mismatch: Array
    force_n: Array
    r_mm: Array
    bare_per_n: Array
    lump_per_n_mm3: Array
    slabs: SlabChanges

    def ramps(self, inclusion: Inclusion, slab: Slab = NOMINAL) -> PressRamps:
        """Return the ramps of one inclusion in a slab; refuses one outside the table, or at the slab's base."""
        inclusion_field = self.inclusion_field(inclusion, slab)
        baseline = Ramp(self.force_n, self.bare_per_n + self.slabs.baseline_per_n(slab), inclusion_field.largest_n)
        return PressRamps(self.r_mm, baseline, inclusion_field)

    def inclusion_field(self, inclusion: Inclusion, slab: Slab = NOMINAL) -> Ramp:
        """Return what an inclusion adds to the ramp in a slab; refuses one outside the table, or at the slab's base."""
        axes = InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)
        axes.require_held(inclusion, slab)
        slab.require_held(inclusion)
        if slab == NOMINAL:
            return Ramp(self.force_n, axes.inclusion_per_n(self.lump_per_n_mm3, inclusion, slab))
        shapes = field_shapes(axes, self.lump_per_n_mm3, self.force_n, inclusion, slab)
        changed = shapes[0] + self.slabs.inclusion_per_n(shapes, self.force_n, inclusion, slab)
        return Ramp(self.force_n, changed, float(self.slabs.largest_n))

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write surface_table.npz and its description with the hash."""
        own = {name: getattr(self, name).astype(np.float32) for name in OWN}
        arrays = own | {name: getattr(self.slabs, name) for name in OF_SLABS}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table", **origin})


OF_SLABS = tuple(SlabChanges.__dataclass_fields__)
OWN = tuple(name for name in SurfaceTable.__dataclass_fields__ if name != "slabs")


def load_surface_table(folder: Path) -> SurfaceTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, (*OWN, *OF_SLABS), ACTION)
    slabs = SlabChanges(**{name: arrays[name] for name in OF_SLABS})
    return SurfaceTable(**{name: arrays[name].astype(np.float64) for name in OWN}, slabs=slabs)
