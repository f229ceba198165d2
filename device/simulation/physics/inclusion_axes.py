"""Where an inclusion lies on the axes of a table of inclusions: size, depth and mismatch, or refused when outside.

Sizes begin above zero: a smaller inclusion's field is the smallest one's, scaled with its volume, so none adds nothing.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, Inclusion, require
from device.simulation.physics.chebyshev import interpolated, interpolation_weights, slope_weights
from device.simulation.physics.slab import Slab

ACTION = "choose an inclusion inside the table's range"
ROUNDING = 1e-6
"""An inclusion at either end of the mismatch is held: files keep the ends in single precision."""


class InclusionAxes(NamedTuple):
    """Ascending points of the three axes."""

    size_mm: Array
    depth_mm: Array
    elastic_mismatch: Array

    def inclusion_per_n(self, fields_per_n_mm3: Array, inclusion: Inclusion, slab: Slab) -> Array:
        """Return an inclusion's field per newton from fields [2, S, D, M, ...] over force, cubed size and mismatch.

        Raises `InvalidQuantity` for an inclusion outside the axes, whose mismatch is that in the stated `slab`.
        """
        self.require_held(inclusion, slab)
        size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
        mismatch = slab.elastic_mismatch(modulus_kpa)
        place = max(size_mm, float(self.size_mm[0])), depth_mm, mismatch
        return size_mm**3 * mismatch * interpolated(fields_per_n_mm3, self, place)

    def growth_per_n(self, fields_per_n_mm3: Array, inclusion: Inclusion, slab: Slab) -> tuple[Array, Array]:
        """Return how the same field grows with the size, per size itself, and with the depth, per mm.

        Raises as `inclusion_per_n`.
        """
        self.require_held(inclusion, slab)
        size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
        mismatch, held_mm = slab.elastic_mismatch(modulus_kpa), max(size_mm, float(self.size_mm[0]))
        of_mismatch = np.tensordot(interpolation_weights(self.elastic_mismatch, mismatch), fields_per_n_mm3, (0, 3))
        at_size, at_depth = interpolation_weights(self.size_mm, held_mm), interpolation_weights(self.depth_mm, depth_mm)
        with_size, with_depth = slope_weights(self.size_mm, held_mm), slope_weights(self.depth_mm, depth_mm)
        grows = 3 * at_size + held_mm * with_size  # below the smallest as there, so that nothing jumps
        by_size, by_depth = (
            np.einsum("s,d,xsd...->x...", of_size, of_depth, of_mismatch)
            for of_size, of_depth in ((grows, at_depth), (at_size, with_depth))
        )
        volume = size_mm**3 * mismatch
        return volume * by_size, volume * by_depth

    def require_held(self, inclusion: Inclusion, slab: Slab) -> None:
        """Refuse an inclusion outside the axes, whose mismatch is that in the stated `slab`."""
        size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
        softest, stiffest = (slab.stated.modulus_kpa(float(end)) for end in self.elastic_mismatch[[0, -1]])
        require("size_mm", size_mm, Bound(0.0, float(self.size_mm[-1]), "mm"), ACTION)
        require("depth_mm", depth_mm, Bound(float(self.depth_mm[0]), float(self.depth_mm[-1]), "mm"), ACTION)
        ends_kpa = Bound(softest * (1 - ROUNDING), stiffest * (1 + ROUNDING), "kPa")
        require("youngs_modulus_kpa", modulus_kpa, ends_kpa, ACTION)
