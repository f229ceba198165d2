"""What an inclusion off the probe's axis adds to the face, and what a tilted probe does, for the virtual probe.

Small strain in three dimensions: fields are proportional to the force (or the tilt) and depend on radius and on the
angle from the direction of the inclusion, as a cosine series. Inclusions are in the nominal slab, between whose
solved moduli the mismatch counts (`slab.py`); tilts are in slabs of any tissue, between which ln Et and 1/T count.

Another slab changes an inclusion's field, at the same mismatch, as on the axis (`slab_changes.py`): it becomes stronger
or weaker, wider or narrower, and takes the shape of an inclusion a little larger or deeper, here also of one farther
off. The mean over the angle, its first cosine and all further ones have shares of their own: the first two push and
turn the whole probe, which answers with its back held. Written by `host_tools table`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.legendre import LegendreTerms
from device.simulation.physics.chebyshev import interpolated, interpolation_weights, slope_weights
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import between_slabs, changing_terms, coordinates

NAME, SCHEMA = "off_axis_table", "tsis.off_axis_table/4"
ACTION = "run `host_tools table` to make it again"
FADING_MM = 2.5
"""Length over which an inclusion beyond the largest offset stops to count; assumed, it moves the rim at most."""
FORGOTTEN = 1e-3
"""What is left of an inclusion that is not looked for any more: farther off, any inclusion will do."""
COSINES = slice(0, 1), slice(1, 2), slice(2, None)
"""Which cosines of the angle have shares of their own."""


@dataclass(frozen=True, eq=False)
class AsideChanges:
    """`aside_degrees` [N, 6] of the terms in size, depth, modulus, thickness, mismatch and offset.

    `aside_shares` [3, N, 5, 2] are how much they add of each of `aside_shapes` to each of `COSINES`, w first, then p.
    """

    aside_degrees: NDArray[np.uint8]
    aside_shares: NDArray[np.float32]

    def modes(
        self, shapes: Array, inclusion: Inclusion, slab: Slab, offset_mm: float, offsets_mm: tuple[float, float]
    ) -> Array:
        """Return what a slab changes of the modes [2, K, R] of an inclusion, from its `aside_shapes`.

        `offsets_mm` are the least and the largest offset that shares are fitted to.
        """
        at = coordinates(inclusion, slab, np.array([offset_mm]), offsets_mm)
        [terms] = changing_terms(self._terms, at)
        changes = [
            np.einsum("n,nhx,hxkr->xkr", terms, shares, shapes[:, :, of_shares], optimize=True)
            for shares, of_shares in zip(self.aside_shares, COSINES, strict=True)
        ]
        return np.concatenate(changes, axis=1)

    @cached_property
    def _terms(self) -> LegendreTerms:
        return LegendreTerms(self.aside_degrees)


def aside_shapes(
    axes: InclusionAxes, per_n_mm3: Array, offset_mm: Array, inclusion: Inclusion, at_mm: float, slab: Slab = NOMINAL
) -> Array:
    """Return shapes [5, 2, K, R] of an inclusion `at_mm` off the axis of the nominal slab: its field, how it grows.

    With its size, per size itself; with its depth, per mm; and with the offset, per mm. The last is the field times the
    squared share of the radius in the largest. `per_n_mm3` [2, S, D, M, O, K, R] as a table has it on `axes`, at
    offsets `offset_mm` [O] and even radii; the mismatch is the inclusion's in `slab`.
    """
    at_offsets = axes.inclusion_per_n(per_n_mm3, inclusion, slab)
    here, slope = interpolation_weights(offset_mm, at_mm), slope_weights(offset_mm, at_mm)
    with_place = [np.tensordot(here, growth, (0, 1)) for growth in axes.growth_per_n(per_n_mm3, inclusion, slab)]
    field, by_offset = (np.tensordot(weights, at_offsets, (0, 1)) for weights in (here, slope))
    wider = field * np.linspace(0.0, 1.0, field.shape[-1]) ** 2
    return np.stack([field, *with_place, by_offset, wider])


@dataclass(frozen=True)
class OffAxisTable:
    """`lump_per_n_mm3` [2, S, D, M, O, K, R], over the mismatch too; w comes first, then p. `slabs` change it.

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
    slabs: AsideChanges

    def centred_share(self, offset_mm: float) -> float:
        """Return how much of the mean over the angle is still the centred inclusion's: from 1 on the axis to 0."""
        return 1 - min(offset_mm / float(self.offset_mm[0]), 1.0) ** 2

    def modes(self, inclusion: Inclusion, offset_mm: float, slab: Slab = NOMINAL) -> Array:
        """Return the modes [2, K, R] for 1 N of an inclusion off the axis, but for the centred inclusion's share.

        Nearer than the first offset of the table the k-th mode grows with the k-th power of the offset, as it must for
        a smooth field (the mean over the angle with the second). Beyond the last the inclusion's field fades.
        Raises `InvalidQuantity` for an inclusion outside the table.
        """
        first_mm, last_mm = float(self.offset_mm[0]), float(self.offset_mm[-1])
        fading = np.exp(-max(offset_mm - last_mm, 0.0) / FADING_MM)
        if fading < FORGOTTEN:
            return np.zeros((2, *np.shape(self.lump_per_n_mm3)[-2:]))
        modes = fading * self._modes(inclusion, min(max(offset_mm, first_mm), last_mm), slab)
        power = np.arange(modes.shape[1])
        power[0] = 2
        return np.asarray(modes * (min(offset_mm / first_mm, 1.0) ** power)[:, None])

    def _modes(self, inclusion: Inclusion, offset_mm: float, slab: Slab) -> Array:
        if slab == NOMINAL:
            return self._in_nominal_slab(inclusion, offset_mm, slab)
        axes = InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)
        shapes = aside_shapes(axes, self.lump_per_n_mm3, self.offset_mm, inclusion, offset_mm, slab)
        held = replace(inclusion, size_mm=max(inclusion.size_mm, float(self.size_mm[0])))  # as the smallest one solved
        ends_mm = float(self.offset_mm[0]), float(self.offset_mm[-1])
        return np.asarray(shapes[0] + self.slabs.modes(shapes, held, slab, offset_mm, ends_mm))

    def _in_nominal_slab(self, inclusion: Inclusion, offset_mm: float, slab: Slab) -> Array:
        """Return the modes [2, K, R] in the nominal slab of an inclusion of the mismatch that it has in `slab`."""
        axes = InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)
        at_offsets = axes.inclusion_per_n(self.lump_per_n_mm3, inclusion, slab)
        return interpolated(at_offsets, [self.offset_mm], [offset_mm])

    def growth_with(self, slab: Slab, inclusion: Inclusion, offset_mm: float) -> Array:
        """Return how much larger w and p [2] of an inclusion are in a slab than in the nominal one, at equal mismatch.

        By the root mean square of its modes at the offset, or at the nearest of the table; 1 where there is none.
        """
        at_mm = float(np.clip(offset_mm, self.offset_mm[0], self.offset_mm[-1]))
        fields = self._modes(inclusion, at_mm, slab), self._in_nominal_slab(inclusion, at_mm, slab)
        now, before = (np.sqrt((field**2).sum(axis=(1, 2))) for field in fields)
        return np.asarray(np.divide(now, before, out=np.ones(2), where=before > 0))

    def tilt_in(self, slab: Slab) -> Array:
        """Return the field [2, R] of one degree in a slab, to be multiplied by the angle's cosine."""
        return between_slabs(self.tilt_per_deg, self.tilt_modulus_kpa, self.tilt_thickness_mm, slab)

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write off_axis_table.npz and its description with the hash."""
        own = {name: getattr(self, name).astype(np.float32) for name in OWN}
        arrays = own | {name: getattr(self.slabs, name) for name in OF_SLABS}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table", **origin})


OF_SLABS = tuple(AsideChanges.__dataclass_fields__)
OWN = tuple(name for name in OffAxisTable.__dataclass_fields__ if name != "slabs")


def load_off_axis_table(folder: Path) -> OffAxisTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, (*OWN, *OF_SLABS), ACTION)
    slabs = AsideChanges(**{name: arrays[name] for name in OF_SLABS})
    return OffAxisTable(**{name: arrays[name].astype(np.float64) for name in OWN}, slabs=slabs)
