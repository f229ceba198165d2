"""Builds the virtual probe's table of what other layers change: a star of moduli, each against its own mesh's default.

Each layer at two ratios, every second size and depth of the surface table and the ends of its mismatches; differences
of two solves on one mesh, since meshes differ by more than a layer changes an inclusion's pressure.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.layer_table import (
    AS_TABULATED,
    DEEP_FROM_MM,
    SKIN_MM,
    SOLVED_RATIOS,
    LayerRatios,
    LayerTable,
)
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.probe_tables.force_ramps import CHANGES, FORCES_N, bare_per_n, inclusions_per_n_mm3
from host_tools.probe_tables.surface_table import (
    COARSE,
    POINTS,
    SMALLEST_SIZE_MM,
    inclusion_axes,
    require_tabulated,
    solved_for,
)
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import Scene, Tissue, TissueLayer, Waveguide

WAVEGUIDE_LAYERS = 3
"""The first of `SOLVED_RATIOS` are the waveguide's: they need no further surfaces in the tissue."""


@dataclass(frozen=True)
class LayeredScene:
    """The default scene in a slab, with other layers; `in_tissue`: meshed with the surfaces of the tissue's layers."""

    layers: LayerRatios
    in_tissue: bool
    waveguide: Waveguide = field(default_factory=Waveguide)

    def __call__(self, slab: Slab, inclusion: Inclusion | None = None) -> Scene:
        """Return the scene of an inclusion in a slab, or of none."""
        layers, usual = self.layers, self.waveguide
        ratios = layers.face_modulus_ratio, layers.middle_modulus_ratio, layers.backing_modulus_ratio
        moduli = tuple(modulus * ratio for modulus, ratio in zip(usual.layer_moduli_kpa, ratios, strict=True))
        waveguide = replace(usual, layer_moduli_kpa=moduli)
        tissue = Tissue(slab.youngs_modulus_kpa, slab.thickness_mm)
        if self.in_tissue:
            upper = TissueLayer("uppermost", SKIN_MM, slab.youngs_modulus_kpa * layers.skin_modulus_ratio)
            bulk = TissueLayer("above_deep", DEEP_FROM_MM - SKIN_MM, slab.youngs_modulus_kpa)
            deep_kpa = slab.youngs_modulus_kpa * layers.deep_modulus_ratio
            tissue = replace(tissue, youngs_modulus_kpa=deep_kpa, layers=(upper, bulk))
        return Scene(inclusion, waveguide=waveguide, tissue=tissue)


def solved_scenes(waveguide: Waveguide) -> tuple[list[LayeredScene], list[LayeredScene]]:
    """Return the probe as it is on both meshes, and the scenes of `SOLVED_RATIOS` in their order, two a layer."""
    others = [
        LayeredScene(replace(AS_TABULATED, **{name: ratio}), layer >= WAVEGUIDE_LAYERS, waveguide)
        for layer, (name, ratios) in enumerate(SOLVED_RATIOS.items())
        for ratio in ratios
    ]
    return [LayeredScene(AS_TABULATED, in_tissue, waveguide) for in_tissue in (False, True)], others


def build_layer_table(
    *,
    waveguide: Waveguide | None = None,
    points: tuple[int, int, int] = POINTS,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> LayerTable:
    """Solve every point of the table (some ten minutes on two cores); `on_point` hears done and total.

    Of a waveguide, the simulated probe's unless given; raise `InvalidQuantity` for one that has not three layers, or
    whose face no table holds.
    """
    waveguide = waveguide or Waveguide()
    require_tabulated(waveguide)
    if (found := len(waveguide.layer_moduli_kpa)) != WAVEGUIDE_LAYERS:
        raise InvalidQuantity("layers of the waveguide", found, f"{WAVEGUIDE_LAYERS}", "build the other parts")
    fine = inclusion_axes(points, SMALLEST_SIZE_MM)
    axes = InclusionAxes(fine.size_mm[COARSE], fine.depth_mm[COARSE], fine.elastic_mismatch[[0, -1]])
    usual, others = solved_scenes(waveguide)
    scenes = [*usual, *others]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    baseline = Parallel(n_jobs=jobs)(delayed(bare_per_n)(scene(NOMINAL), FORCES_N, CHANGES) for scene in scenes)
    places = [(scene, NOMINAL, CHANGES, *place) for scene in scenes for place in product(axes.size_mm, axes.depth_mm)]
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(inclusions_per_n_mm3)(*place, axes.elastic_mismatch) for place in places
    )
    solved: list[Array] = []
    for done, of_place in enumerate(solving, start=1):
        solved.append(of_place)
        on_point(done, len(places))
    # [scene, S, D, M, 2, F, R] to [scene, 2, S, D, M, F, R]
    on_axes = np.array(solved).reshape(len(scenes), len(axes.size_mm), len(axes.depth_mm), *solved[0].shape)
    return _assembled(axes, np.array(baseline), np.moveaxis(on_axes, 4, 1))


def _assembled(axes: InclusionAxes, baseline: Array, inclusions: Array) -> LayerTable:
    """Return the table of the fields [scene, 2, ...] in the order of `solved_scenes`."""
    change = _changes(inclusions)
    scale = np.abs(change).max(axis=tuple(range(3, change.ndim)))
    return LayerTable(
        *axes,
        bare_change_per_n=_changes(baseline).astype(np.float32),
        inclusion_change_per_n_mm3=(change / scale.reshape(*scale.shape, *[1] * (change.ndim - 3))).astype(np.float16),
        inclusion_scale=scale,
    )


def _changes(fields: Array) -> Array:
    """Return [layer, 2, ...]: every other scene less the default on its mesh."""
    (in_one_piece, layered), others = fields[:2], fields[2:].reshape(len(SOLVED_RATIOS), 2, *fields.shape[1:])
    return np.concatenate([others[:WAVEGUIDE_LAYERS] - in_one_piece, others[WAVEGUIDE_LAYERS:] - layered])


def write_layer_table(table: LayerTable, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "finite"})
