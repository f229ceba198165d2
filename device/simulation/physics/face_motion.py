"""How far the pressed face moves outwards, so that it can be drawn where the camera sees it.

The virtual probe's tables have deformation and pressure by where a point of the face was before the press, and the
pressure per area of then. A camera sees the point where it is, some 0.15 mm further out at 0.6 N, and skin is wetted by
force over the area that is: 1-4 % less. Kept like what layers change: over the force, an inclusion's also over size
cubed and mismatch, of the nominal slab; other slabs change it as `slab_changes` says. Written by `host_tools table
--part motion`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import OF_SLABS, SlabChanges, field_shapes, slab_arrays, slabs_of
from device.simulation.physics.surface_table import PressRamps

NAME, SCHEMA = "face_motion", "tsis.face_motion/2"
ACTION = "run `host_tools table --part motion` to make it again"


@dataclass(frozen=True, eq=False)
class FaceMotion:
    """`outward_per_n` [F, R]: how far points of the face move from the axis (mm) without an inclusion, over the force.

    `inclusion_outward_per_n_mm3` [1, S, D, M, F, R]: what an inclusion adds, also over size cubed and mismatch. Of the
    tables' layers, at `force_n` [F]; `slabs` is what other slabs than the nominal one change.
    """

    size_mm: Array
    depth_mm: Array
    elastic_mismatch: Array
    force_n: Array
    r_mm: Array
    outward_per_n: Array
    inclusion_outward_per_n_mm3: Array
    slabs: SlabChanges

    def moved(self, ramps: PressRamps, ratio: float, inclusion: Inclusion, slab: Slab) -> PressRamps:
        """Return the ramps by where points are under load, with pressures per area under load.

        `ratio` is the part of the motion that is made, 1 for all. Refuses an inclusion outside the table. A field off
        the axis grows as the centred one does.
        """
        without = ramps.baseline.fields_per_n
        outward_mm, added_mm = (
            ratio * ramps.baseline.force_n[:, None] * per_n for per_n in self.outward_per_n_in(inclusion, slab)
        )
        baseline = self._drawn_where_it_is(without, outward_mm)
        pressed = self._drawn_where_it_is(without + ramps.inclusion_field.fields_per_n, outward_mm + added_mm)
        return ramps._replace(
            baseline=replace(ramps.baseline, fields_per_n=baseline),
            inclusion_field=replace(ramps.inclusion_field, fields_per_n=pressed - baseline),
            tabulated_inclusion_field=ramps.tabulated_inclusion_field or ramps.inclusion_field,
        )

    def outward_per_n_in(self, inclusion: Inclusion, slab: Slab) -> tuple[Array, Array]:
        """Return the ways outwards in a slab [F, R] over the force, without the inclusion and what that adds."""
        axes = InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)
        outward, added = self.outward_per_n, axes.inclusion_per_n(self.inclusion_outward_per_n_mm3, inclusion, slab)
        if slab != NOMINAL:
            outward = outward + self.slabs.baseline_per_n(slab)[0]
            shapes = field_shapes(axes, self.inclusion_outward_per_n_mm3, self.force_n, inclusion, slab)
            added = added + self.slabs.inclusion_per_n(shapes, self.force_n, inclusion, slab)
        return outward, added[0]

    def _drawn_where_it_is(self, fields: Array, outward_mm: Array) -> Array:
        """Return w and p [2, F, R] of points that have moved by outward_mm [F, R]."""
        at_mm = self.r_mm + outward_mm
        growth = np.gradient(at_mm**2, self.r_mm, axis=1, edge_order=2)[:, 1:] / (2 * self.r_mm[1:])
        area_ratio = np.concatenate([growth[:, :1], growth], axis=1)
        carried = fields / np.stack([np.ones_like(area_ratio), area_ratio])
        return np.array([
            [np.interp(self.r_mm, at, one) for at, one in zip(at_mm, field, strict=True)] for field in carried
        ])  # fmt: skip

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write face_motion.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in OWN} | slab_arrays([self.slabs])
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table --part motion", **origin})


OWN = tuple(name for name in FaceMotion.__dataclass_fields__ if name != "slabs")


def load_face_motion(folder: Path) -> FaceMotion:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, (*OWN, *OF_SLABS), ACTION)
    (slabs,) = slabs_of(arrays)
    return FaceMotion(**{name: arrays[name].astype(np.float64) for name in OWN}, slabs=slabs)
