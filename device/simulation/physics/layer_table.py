"""What other layers change of the pressed face: the waveguide's three, the tissue's outermost and its deepest.

A star: one layer's modulus apart from the default, solved in finite strain at two ratios, each as the
difference of two solves on one mesh; quadratic in the logarithm of the ratio, and several layers add up. Kept at
coarse sizes, depths and mismatches, of the nominal slab and on the axis: what a layer changes of the tilt and of the
shape of a field off the axis is left out. In other slabs the waveguide's layers and the tissue's outermost are known as
`slab_changes` knows the face, from one stiffer ratio of each; the tissue's deepest is not. Written by
`host_tools table --part layers`.

Tissue that is uneven in depth, over the lesion and beside it, has a table of its own: layers from the surface to the
base, in all slabs, each to first order in the logarithm of its modulus. Written by `host_tools table --part tissue`.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, fields, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.parameters import LAYER_TOPS_MM
from device.measurement.quantities import Bound, Inclusion, require
from device.measurement.ramp_modes.legendre import LegendreTerms
from device.simulation.physics.chebyshev import interpolation_weights
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import (
    OF_SLABS,
    SlabChanges,
    between_slabs,
    coordinates,
    field_shapes,
    resampling,
    slab_arrays,
    slabs_of,
)
from device.simulation.physics.surface_table import PressRamps

NAME, SCHEMA = "layer_table", "tsis.layer_table/3"
ACTION = "run `host_tools table --part layers` to make it again"
SOLVED_RATIOS = {
    "face_modulus_ratio": (0.8, 1.25),
    "middle_modulus_ratio": (0.8, 1.25),
    "backing_modulus_ratio": (0.8, 1.25),
    "skin_modulus_ratio": (2.0, 4.0),
    "deep_modulus_ratio": (0.5, 2.0),
}
"""Each layer's moduli over the default that are solved; 1 is the third point of its quadratic."""
SKIN_MM, DEEP_FROM_MM = 1.5, 20.0
WAVEGUIDE_LAYERS = 3
"""The first of `SOLVED_RATIOS` are the waveguide's."""
IN_SLABS_RATIO = {
    "face_modulus_ratio": 1.25,
    "middle_modulus_ratio": 1.25,
    "backing_modulus_ratio": 1.25,
    "skin_modulus_ratio": 2.0,
}
"""Those, the first of `SOLVED_RATIOS`, that are solved in other slabs than the nominal one, at one ratio each."""


@dataclass(frozen=True)
class LayerRatios:
    """Young's moduli over what the tables assume: the waveguide's layers from the tissue to the glass, the uppermost
    1.5 mm of the tissue, and all tissue (not the inclusion) from 20 mm down.
    """

    face_modulus_ratio: float = 1.0
    middle_modulus_ratio: float = 1.0
    backing_modulus_ratio: float = 1.0
    skin_modulus_ratio: float = 1.0
    deep_modulus_ratio: float = 1.0

    def __post_init__(self) -> None:
        for name, solved in SOLVED_RATIOS.items():
            bound = Bound(min(1.0, *solved), max(solved), "")
            require(f"world.layers.{name}", getattr(self, name), bound, "stay inside what the table of layers holds")

    def weights(self) -> Array:
        """Return the weight [layer, 2] of what each of `SOLVED_RATIOS` changes."""
        points = [sorted((1.0, *solved)) for solved in SOLVED_RATIOS.values()]
        found = [
            interpolation_weights(np.log(of_layer), float(np.log(ratio)))[np.array(of_layer) != 1.0]
            for of_layer, ratio in zip(points, astuple(self), strict=True)
        ]
        return np.array(found)


AS_TABULATED = LayerRatios()


@dataclass(frozen=True, eq=False)
class LayerTable:
    """`bare_change_per_n` [layer, 2, 2, F, R]: what each of `SOLVED_RATIOS` changes, w first, then p, over the force.

    `inclusion_change_per_n_mm3` [layer, 2, 2, S, D, M, F, R]: the same of what an inclusion adds, also over size cubed
    and mismatch, and over `inclusion_scale` [layer, 2, 2] of its own largest. Both at `force_n` [F].
    `slabs`: what other slabs change of these, one for each of `IN_SLABS_RATIO`.
    """

    size_mm: Array
    depth_mm: Array
    elastic_mismatch: Array
    force_n: Array
    bare_change_per_n: NDArray[np.float32]
    inclusion_change_per_n_mm3: NDArray[np.float16]
    inclusion_scale: Array
    slabs: tuple[SlabChanges, ...]

    def changed(self, ramps: PressRamps, layers: LayerRatios, inclusion: Inclusion, slab: Slab) -> PressRamps:
        """Return the ramps of an inclusion in a slab with other layers; refuses one outside the table.

        A field off the axis grows by as much as the centred one does with the layers. Raises `InvalidQuantity` for
        other deep tissue far from the nominal slab.
        """
        for name in (field.name for field in fields(layers)[len(IN_SLABS_RATIO) :]):
            if getattr(layers, name) != 1.0:
                slab.require_near_nominal(f"world.layers.{name}")
        weights = layers.weights()
        baseline = np.tensordot(weights, self.bare_change_per_n, 2)
        change = self.axes.inclusion_per_n(self._weighted(weights), inclusion, slab)
        if slab != NOMINAL:
            for layer, in_slabs in enumerate(self.slabs):
                if not weights[layer].any():
                    continue
                solved_ratio = list(IN_SLABS_RATIO.values())[layer]
                share = math.log(astuple(layers)[layer]) / math.log(solved_ratio)
                baseline = baseline + share * in_slabs.baseline_per_n(slab)
                per_n_mm3 = self._weighted(weights, slice(layer, layer + 1))
                shapes = field_shapes(self.axes, per_n_mm3, self.force_n, inclusion, slab)
                change = change + in_slabs.inclusion_per_n(shapes, self.force_n, inclusion, slab)
        return ramps._replace(
            baseline=replace(ramps.baseline, fields_per_n=ramps.baseline.fields_per_n + baseline),
            inclusion_field=replace(ramps.inclusion_field, fields_per_n=ramps.inclusion_field.fields_per_n + change),
            tabulated_inclusion_field=ramps.tabulated_inclusion_field or ramps.inclusion_field,
        )

    @cached_property
    def axes(self) -> InclusionAxes:
        """Sizes, depths and mismatches that are tabulated."""
        return InclusionAxes(self.size_mm, self.depth_mm, self.elastic_mismatch)

    def _weighted(self, weights: Array, layers: slice = slice(None)) -> Array:
        """Return what an inclusion adds [2, S, D, M, F, R] with some of the layers, added up by weights [layer, 2]."""
        scaled = weights[layers, :, None] * self.inclusion_scale[layers]
        changes = self.inclusion_change_per_n_mm3[layers]
        return np.asarray(np.einsum("lnf,lnfsdmkr->fsdmkr", scaled, changes, optimize=True))

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write layer_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name) for name in OWN} | slab_arrays(self.slabs)
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table --part layers", **origin})


OWN = tuple(name for name in LayerTable.__dataclass_fields__ if name != "slabs")


def load_layer_table(folder: Path) -> LayerTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    arrays, _ = load_table(folder, NAME, SCHEMA, (*OWN, *OF_SLABS), ACTION)
    return LayerTable(**{name: arrays[name] for name in OWN}, slabs=slabs_of(arrays))


DepthRatios = tuple[float, float, float, float, float]
"""Young's moduli over the slab's of the layers that begin at `LAYER_TOPS_MM`."""
EVEN: DepthRatios = (1.0,) * len(LAYER_TOPS_MM)  # type: ignore[assignment]  # as many as there are tops
TISSUE_NAME, TISSUE_SCHEMA = "tissue_layers", "tsis.tissue_layers/1"
TISSUE_ACTION = "run `host_tools table --part tissue` to make it again"


@dataclass(frozen=True, eq=False)
class TissueLayerTable:
    """What the layers of `LAYER_TOPS_MM` change, each over the logarithm of its modulus over the slab's.

    `bare_change_per_n` [layer, K, T, 2, F, R], over the force at `force_n` [F], in slabs of `slab_modulus_kpa` [K] and
    `slab_thickness_mm` [T]; w first, then p. Of what an inclusion adds, at `reached_n` [F]: `change_degrees` [N, 6] of
    the terms of `coordinates`, and `shape_shares` [N, layer, 2, 2] of the field itself and of it times the squared
    share of the radius in the largest.
    """

    slab_modulus_kpa: Array
    slab_thickness_mm: Array
    force_n: Array
    bare_change_per_n: NDArray[np.float32]
    change_degrees: NDArray[np.uint8]
    shape_shares: NDArray[np.float32]
    reached_n: Array

    def changed(self, ramps: PressRamps, ratios: DepthRatios, inclusion: Inclusion, slab: Slab) -> PressRamps:
        """Return the ramps of an inclusion in a slab whose layers have these moduli over its own.

        A field off the axis grows by as much as the centred one does.
        """
        log_ratios, baseline, field = np.log(ratios), ramps.baseline, ramps.inclusion_field
        of_layers = np.tensordot(log_ratios, self.bare_change_per_n, 1)
        without = between_slabs(of_layers, self.slab_modulus_kpa, self.slab_thickness_mm, slab)
        to_own = resampling(self.force_n, baseline.force_n)
        shares = self.shares(inclusion, slab, np.minimum(field.force_n, self.reached_n[-1]))
        wider = np.linspace(0.0, 1.0, field.fields_per_n.shape[-1]) ** 2
        own, of_wider = np.einsum("l,flhx->hxf", log_ratios, shares)[..., None]
        return ramps._replace(
            baseline=replace(baseline, fields_per_n=baseline.fields_per_n + np.einsum("gf,xfr->xgr", to_own, without)),
            inclusion_field=replace(field, fields_per_n=field.fields_per_n * (1 + own + of_wider * wider)),
            tabulated_inclusion_field=ramps.tabulated_inclusion_field or field,
        )

    def shares(self, inclusion: Inclusion, slab: Slab, force_n: Array) -> Array:
        """Return how much a layer adds of both shapes of each field of an inclusion [F, layer, 2, 2] at forces [F]."""
        at = np.clip(coordinates(inclusion, slab, force_n), -1, 1)
        terms = LegendreTerms(self.change_degrees).values(at)
        return np.asarray(np.tensordot(terms, self.shape_shares.astype(np.float64), 1))

    def save(self, folder: Path, origin: dict[str, object]) -> None:
        """Write tissue_layers.npz and its description with the hash."""
        arrays = {name: getattr(self, name) for name in TissueLayerTable.__dataclass_fields__}
        record = {"schema": TISSUE_SCHEMA, "command": "host_tools table --part tissue", **origin}
        save_table(folder, TISSUE_NAME, arrays, record)


def load_tissue_layers(folder: Path) -> TissueLayerTable:
    """Read a table; raise `InvalidQuantity` when it is missing or not what its description says."""
    names = tuple(TissueLayerTable.__dataclass_fields__)
    arrays, _ = load_table(folder, TISSUE_NAME, TISSUE_SCHEMA, names, TISSUE_ACTION)
    return TissueLayerTable(**arrays)
