"""What an inclusion off the probe's axis adds to the face, and what a tilted probe does, for the virtual probe.

Small strain in three dimensions: fields are proportional to the force (or the tilt) and depend on radius and on the
angle from the direction of the inclusion, as a cosine series. Inclusions are in the nominal slab, and `PressedFace`
carries them over to another one; tilts are in slabs of any tissue, between which ln Et and 1/T count. Between the
solved moduli the inclusion's mismatch counts (`slab.py`). Written by `host_tools table`.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import interpolated
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import between_slabs

NAME, SCHEMA = "off_axis_table", "tsis.off_axis_table/3"
ACTION = "run `host_tools table` to make it again"
FADING_MM = 2.5
"""Length over which an inclusion beyond the largest offset stops to count; assumed, it moves the rim at most."""
FORGOTTEN = 1e-3
"""What is left of an inclusion that is not looked for any more: farther off, any inclusion will do."""


@dataclass(frozen=True)
class OffAxisTable:
    """`lump_per_n_mm3` [2, S, D, M, O, K, R], over the mismatch too; w comes first, then p.

    `tilt_per_deg` [E, T, 2, R], times the angle's cosine, at `tilt_modulus_kpa` [E] and `tilt_thickness_mm` [T].
    """

    size_mm: Array
    depth_mm: Array
    elastic_mismatch: Array
    offset_mm: Array
    r_mm: Array
    lump_per_n_mm3: Array
    tilt_modulus_kpa: Array
    tilt_thickness_mm: Array
    tilt_per_deg: Array

    def centred_share(self, offset_mm: float) -> float:
        """Return how much of the mean over the angle is still the centred inclusion's: from 1 on the axis to 0."""
        return 1 - min(offset_mm / float(self.offset_mm[0]), 1.0) ** 2

    def modes(self, inclusion: Inclusion, offset_mm: float) -> Array:
        """Return the modes [2, K, R] for 1 N of an inclusion off the axis, but for the centred inclusion's share.

        Nearer than the first offset of the table the k-th mode grows with the k-th power of the offset, as it must for
        a smooth field (the mean over the angle with the second). Beyond the last the inclusion's field fades.
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
        axes = InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)
        at_offsets = axes.inclusion_per_n(self.lump_per_n_mm3, inclusion, NOMINAL)
        return interpolated(at_offsets, [self.offset_mm], [offset_mm])

    def tilt_in(self, slab: Slab) -> Array:
        """Return the field [2, R] of one degree in a slab, to be multiplied by the angle's cosine."""
        return between_slabs(self.tilt_per_deg, self.tilt_modulus_kpa, self.tilt_thickness_mm, slab)

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write off_axis_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in self.__dataclass_fields__}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table", **origin})


def load_off_axis_table(folder: Path) -> OffAxisTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, tuple(OffAxisTable.__dataclass_fields__), ACTION)
    return OffAxisTable(**{name: values.astype(np.float64) for name, values in arrays.items()})
