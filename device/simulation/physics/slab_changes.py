"""What tissue other than the nominal slab changes of a table's fields, at the same force and the same mismatch.

Without an inclusion it is interpolated between slabs, in ln Et and 1/T. What an inclusion adds becomes stronger or
weaker, wider or narrower, and takes the shape of an inclusion a little larger, deeper or pressed harder: the change is
a sum of the field itself, of how it grows with size, depth and force, and of it times the squared radius, which leaves
a fiftieth of it. Each one's share is a sum of
Legendre polynomials in the inclusion's size and depth, the slab's ln Et and 1/T^2, the mismatch and the force, of
limited total degree, less its value in the nominal slab, where nothing changes. They are fitted to slabs and inclusions
scattered over all that fit in one another: thin slabs hold no deep inclusions, so no grid of all would do. Written by
`host_tools table`. Source: total degrees and scattered points, Narayan & Zhou, Stochastic collocation on unstructured
multivariate meshes, Commun. Comput. Phys. 18 (2015).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.legendre import LegendreTerms
from device.simulation.physics.chebyshev import interpolation_weights, points_inside, slope_weights
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, PEOPLES_KPA, PEOPLES_MM, Slab

SIZE_MM, DEPTH_MM, FORCE_N = (1.0, 15.0), (4.0, 12.0), (0.0, 0.7)
"""Ends between which the polynomials' coordinates run from -1 to 1; a smaller inclusion changes as the smallest."""
SLAB = slice(2, 4)
"""Where the coordinates have the slab."""


@dataclass(frozen=True, eq=False)
class SlabChanges:
    """`bare_change_per_n` [K, T, X, F, R] of X fields at `slab_modulus_kpa` [K] and `slab_thickness_mm` [T].

    `change_degrees` [N, 6] of the terms in size, depth, modulus, thickness, mismatch and force; `shape_shares`
    [N, 5, X] are how much they add of each of `field_shapes`, from 0 to `largest_n`: beyond, what they change is
    carried on as a polynomial in the force. Of the pressed face the fields are w and p.
    """

    slab_modulus_kpa: Array
    slab_thickness_mm: Array
    bare_change_per_n: NDArray[np.float32]
    change_degrees: NDArray[np.uint8]
    shape_shares: NDArray[np.float32]
    largest_n: Array

    def baseline_per_n(self, slab: Slab) -> Array:
        """Return what a slab changes of the fields [X, F, R] without an inclusion, over the force."""
        return between_slabs(self.bare_change_per_n, self.slab_modulus_kpa, self.slab_thickness_mm, slab)

    def inclusion_per_n(self, shapes: Array, force_n: Array, inclusion: Inclusion, slab: Slab) -> Array:
        """Return what a slab changes of an inclusion's fields [X, F, R], over the force, from their `field_shapes` at
        `force_n` [F].
        """
        reached_n = points_inside(0.0, float(self.largest_n), len(force_n))
        shares = changing_terms(self._terms, coordinates(inclusion, slab, reached_n)) @ self._flat_shares
        at_reached, back = resampling(force_n, reached_n), resampling(reached_n, force_n)
        of_shapes = shares.reshape(len(force_n), *self.shape_shares.shape[1:])
        return np.asarray(np.einsum("fg,ghx,gj,hxjr->xfr", back, of_shapes, at_reached, shapes, optimize=True))

    @cached_property
    def _flat_shares(self) -> Array:
        return self.shape_shares.reshape(len(self.change_degrees), -1).astype(np.float64)

    @cached_property
    def _terms(self) -> LegendreTerms:
        return LegendreTerms(self.change_degrees)


EACH = "bare_change_per_n", "shape_shares"
"""What is each table's own where several know the same slabs."""
OF_SLABS = tuple(f"slabs_{name}" for name in SlabChanges.__dataclass_fields__)


def slab_arrays(several: Sequence[SlabChanges]) -> dict[str, NDArray[Any]]:
    """Return what a file holds of changes in the same slabs, of the same terms, by the names in `OF_SLABS`."""
    first = several[0]
    return {
        f"slabs_{name}": np.stack([getattr(one, name) for one in several]) if name in EACH else getattr(first, name)
        for name in SlabChanges.__dataclass_fields__
    }


def slabs_of(arrays: Mapping[str, NDArray[Any]]) -> tuple[SlabChanges, ...]:
    """Return the changes whose arrays `slab_arrays` gave."""
    named = {name: arrays[f"slabs_{name}"] for name in SlabChanges.__dataclass_fields__}
    return tuple(
        SlabChanges(**named | {name: named[name][number] for name in EACH}) for number in range(len(named[EACH[0]]))
    )


def between_slabs(fields: NDArray[np.floating], modulus_kpa: Array, thickness_mm: Array, slab: Slab) -> Array:
    """Return the fields [...] of a slab, of those [E, T, ...] at moduli [E] and thicknesses [T], in ln Et and 1/T."""
    modulus = interpolation_weights(np.log(modulus_kpa), float(np.log(slab.youngs_modulus_kpa)))
    thickness = interpolation_weights(1 / thickness_mm, 1 / slab.thickness_mm)
    return np.tensordot(np.multiply.outer(modulus, thickness), fields, 2)


def field_shapes(
    axes: InclusionAxes, per_n_mm3: Array, force_n: Array, inclusion: Inclusion, slab: Slab = NOMINAL
) -> Array:
    """Return shapes [5, X, F, R] over the force of an inclusion in the nominal slab: its fields, and how they grow.

    With its size, per size itself; with its depth, per mm; and with the force, per force itself. The last is the field
    times the squared share of the radius in the largest. `per_n_mm3` [X, S, D, M, F, R] as a table has it on `axes`, at
    `force_n` [F] and even radii; the mismatch is the inclusion's in `slab`.
    """
    field = axes.inclusion_per_n(per_n_mm3, inclusion, slab)
    with_force = np.array([force * slope_weights(force_n, float(force)) for force in force_n])
    by_force = np.einsum("gf,xfr->xgr", with_force, field)
    wider = field * np.linspace(0.0, 1.0, field.shape[-1]) ** 2
    return np.stack([field, *axes.growth_per_n(per_n_mm3, inclusion, slab), by_force, wider])


def resampling(from_n: Array, to_n: Array) -> Array:
    """Return the weights [n, F] of values at forces [F] in their polynomial's values at others [n]."""
    return np.array([interpolation_weights(from_n, float(force)) for force in to_n])


def coordinates(inclusion: Inclusion, slab: Slab, last: Array, last_ends: tuple[float, float] = FORCE_N) -> Array:
    """Return the coordinates [n, 6] of an inclusion in a slab: size, depth, ln Et, 1/T^2, mismatch, and a `last` [n].

    That one is the force (N), unless its ends are those of another quantity.
    """
    size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
    squared_per_mm2 = PEOPLES_MM[1] ** -2, PEOPLES_MM[0] ** -2
    of_place = (
        max(size_mm, SIZE_MM[0]),
        depth_mm,
        np.log(slab.youngs_modulus_kpa),
        slab.thickness_mm**-2,
        slab.elastic_mismatch(modulus_kpa),
    )
    values = np.column_stack([np.tile(of_place, (len(last), 1)), last])
    low, high = np.array([SIZE_MM, DEPTH_MM, np.log(PEOPLES_KPA), squared_per_mm2, (0.0, 1.0), last_ends]).T
    return np.asarray(2 * (values - low) / (high - low) - 1)


def changing_terms(terms: LegendreTerms, at: Array) -> Array:
    """Return the terms [n, N] at coordinates [n, 6], less what they are there in the nominal slab."""
    nominal = np.array(at)
    nominal[:, SLAB] = coordinates(Inclusion(1.0, 4.0, 10.0), NOMINAL, np.ones(1))[:, SLAB]
    return terms.values(at) - terms.values(nominal)
