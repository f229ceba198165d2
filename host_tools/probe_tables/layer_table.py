"""Builds the virtual probe's table of what other layers change: a star of moduli, each against its own mesh's default.

Each layer at two ratios, every second size and depth of the surface table and the ends of its mismatches; differences
of two solves on one mesh, since meshes differ by more than a layer changes an inclusion's pressure. The waveguide's
layers and the tissue's outermost are then solved in other slabs, too, at one stiffer ratio each.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
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
    IN_SLABS_RATIO,
    SKIN_MM,
    SOLVED_RATIOS,
    WAVEGUIDE_LAYERS,
    LayerRatios,
    LayerTable,
)
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import SlabChanges
from host_tools.forward.plan import Level
from host_tools.probe_tables.changes_in_slabs import PLACES, SLABS_SOLVED, build_changes_in_slabs
from host_tools.probe_tables.force_ramps import CHANGES, FORCES_N, bare_per_n, first_that_can, inclusions_per_n_mm3
from host_tools.probe_tables.slab_changes import (
    SLAB_FORCES_N,
    WITHOUT_INCLUSION,
    NominalTable,
    ScatteredInclusion,
)
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
            tissue = replace(tissue, layers=(upper,))
            if slab.thickness_mm > DEEP_FROM_MM:
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
    slab_places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> LayerTable:
    """Solve every point of the table (half an hour on two cores); `on_point` hears done and total.

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
    total = len(places) + SLABS_SOLVED * slab_places
    for done, of_place in enumerate(solving, start=1):
        solved.append(of_place)
        on_point(done, total)
    # [scene, S, D, M, 2, F, R] to [scene, 2, S, D, M, F, R]
    on_axes = np.array(solved).reshape(len(scenes), len(axes.size_mm), len(axes.depth_mm), *solved[0].shape)
    change = _changes(np.moveaxis(on_axes, 4, 1))
    in_slabs = build_changes_in_slabs(
        nominal_tables(axes, change),
        partial(layers_of_inclusion, waveguide, axes.elastic_mismatch),
        partial(layers_without_inclusion, waveguide),
        places=slab_places,
        jobs=jobs,
        on_point=lambda done: on_point(len(places) + done, total),
    )
    return assembled(axes, _changes(np.array(baseline)), change, in_slabs)


def assembled(axes: InclusionAxes, baseline: Array, inclusions: Array, slabs: tuple[SlabChanges, ...]) -> LayerTable:
    """Return the table of changes [layer, 2, 2, ...] of `SOLVED_RATIOS`, and of what other slabs change of them."""
    scale = np.abs(inclusions).max(axis=tuple(range(3, inclusions.ndim)))
    over = scale.reshape(*scale.shape, *[1] * (inclusions.ndim - 3))
    return LayerTable(
        *axes,
        force_n=FORCES_N,
        bare_change_per_n=baseline.astype(np.float32),
        inclusion_change_per_n_mm3=(inclusions / over).astype(np.float16),
        inclusion_scale=scale,
        slabs=slabs,
    )


def nominal_tables(axes: InclusionAxes, change: Array) -> list[NominalTable]:
    """Return what each of `IN_SLABS_RATIO` changes in the nominal slab, of all changes."""
    return [
        NominalTable(axes, of_layer[SOLVED_RATIOS[name].index(ratio)], FORCES_N)
        for of_layer, (name, ratio) in zip(change, IN_SLABS_RATIO.items(), strict=False)
    ]


def scenes_in_slabs(waveguide: Waveguide) -> tuple[list[LayeredScene], list[LayeredScene]]:
    """Return the probe as it is on both meshes, and the scenes of `IN_SLABS_RATIO` in their order."""
    others = [
        LayeredScene(replace(AS_TABULATED, **{name: ratio}), layer >= WAVEGUIDE_LAYERS, waveguide)
        for layer, (name, ratio) in enumerate(IN_SLABS_RATIO.items())
    ]
    return [LayeredScene(AS_TABULATED, in_tissue, waveguide) for in_tissue in (False, True)], others


def layers_of_inclusion(
    waveguide: Waveguide, mismatches: Array, one: ScatteredInclusion, slab: Slab, reached: int
) -> Array:
    """Return what each layer changes of what an inclusion adds in a slab [layer, M, 2, F, R]."""
    at = one.size_mm, one.depth_mm, mismatches, SLAB_FORCES_N[:reached]
    return _less_usual(waveguide, lambda scene: inclusions_per_n_mm3(scene, slab, CHANGES, *at))


def layers_without_inclusion(waveguide: Waveguide, slab: Slab) -> Array:
    """Return what each layer changes in a slab without an inclusion [layer, 2, F, R], all on one level."""

    def on(level: Level) -> Array:
        return _less_usual(waveguide, lambda scene: bare_per_n(scene(slab), SLAB_FORCES_N, (level,)))

    return first_that_can(on, WITHOUT_INCLUSION)


def _less_usual(waveguide: Waveguide, solve: Callable[[LayeredScene], Array]) -> Array:
    """Return what is solved [layer, ...] for each of `IN_SLABS_RATIO`, less the same of the probe as it is."""
    usual, others = scenes_in_slabs(waveguide)
    of_usual = [solve(scene) for scene in usual]
    return np.array([solve(scene) - of_usual[scene.in_tissue] for scene in others])


def _changes(fields: Array) -> Array:
    """Return [layer, 2, ...]: every other scene less the default on its mesh."""
    (in_one_piece, layered), others = fields[:2], fields[2:].reshape(len(SOLVED_RATIOS), 2, *fields.shape[1:])
    return np.concatenate([others[:WAVEGUIDE_LAYERS] - in_one_piece, others[WAVEGUIDE_LAYERS:] - layered])


def write_layer_table(table: LayerTable, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "finite"})
