"""Solves what tissue other than the nominal slab changes of an inclusion off the axis, and fits polynomials to it.

As on the axis (`slab_changes.py`): inclusions, offsets and slabs are scattered, each inclusion is solved in several
slabs and in the nominal one on one mesh, and the difference is what counts. Small strain in three dimensions; the press
without the inclusion is solved in axisymmetry. On the coarse mesh a change of deformation is within 0.2 % of the
inclusion's peak, and one of pressure within 1 %, of order 4's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.off_axis_table import COSINES, AsideChanges, aside_shapes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import DEPTH_MM, coordinates
from host_tools.forward.face_state import Rays
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.meshes.mesh import axisymmetric_mesh
from host_tools.forward.meshes.solid_mesh import COARSE, solid_mesh
from host_tools.forward.plan import GRADED
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.off_axis_inclusion import ROUND_ORDER, OffAxisModel, RoundBody
from host_tools.forward.tiers import AXISYMMETRIC_SIZES, SOLID_ANGLES
from host_tools.probe_tables.cosine_modes import face_modes
from host_tools.probe_tables.force_ramps import scene_on_one_mesh
from host_tools.probe_tables.slab_changes import ROUNDING, ScatteredInclusion, SlabRows, fitted, scattered
from host_tools.scenes.scene import Placement, Press, Scene, Waveguide

ORDER = 3
PLACES, SEED = 200, 2
SIZE_MM, OFFSETS_MM = (2.0, 15.0), (2.0, 16.0)
SMALL_N = 1e-3
"""A press that folds nothing in any tissue; in small strain fields are proportional to the force."""
OFF_THE_RIM = slice(None, -3)
"""Radii that changes are fitted at. At the rim the press without the inclusion is singular: the last sample of its
pressure stands for a force that is not there, and so does every ring that reaches it.
"""
REACHES = (5.0, 5.0, 5.0, 4.0, 3.0, 7.0), *[(3.0, 3.0, 3.0, 2.0, 2.0, 4.0)] * 4
HIGHEST = (9, 9, 9, 9, 1, 9)
"""Of every shape, as `slab_changes.REACHES`; the last degree is that of the offset."""


class TableAside(NamedTuple):
    """A table's modes [2, S, D, M, O, K, R] in the nominal slab, over force, size cubed and mismatch."""

    axes: InclusionAxes
    per_n_mm3: Array
    offset_mm: Array

    def shapes(self, one: ScatteredInclusion) -> Array:
        """Return `aside_shapes` [M, 5, 2, K, R] of an inclusion, over size cubed and mismatch."""
        found = []
        for mismatch in self.axes.elastic_mismatch.tolist():
            modulus_kpa = NOMINAL.modulus_kpa(mismatch + ROUNDING * (0.5 - mismatch))
            inclusion = Inclusion(one.size_mm, one.depth_mm, modulus_kpa)
            shapes = aside_shapes(self.axes, self.per_n_mm3, self.offset_mm, inclusion, one.offset_mm)
            found.append(shapes / (one.size_mm**3 * mismatch))
        return np.array(found)


class AsidePlace:
    """Solves inclusions at one place off the axis in any tissue, all on the mesh of one `scene`."""

    def __init__(self, scene: Scene) -> None:
        self._rays = Rays.over(scene.waveguide, SOLID_ANGLES)
        self._mesh = solid_mesh(scene, symmetry="half", order=ORDER, resolution=COARSE)
        self._sampler = FaceSampler(self._mesh, self._rays, "half")
        round_body = replace(scene, inclusion=None, placement=Placement())
        self._round_mesh = axisymmetric_mesh(round_body, order=ROUND_ORDER, resolution=AXISYMMETRIC_SIZES[GRADED])
        self._round_sampler = FaceSampler(self._round_mesh, Rays.over(scene.waveguide), "axisymmetric")

    def modes_per_n(self, scenes: Sequence[Scene]) -> Array:
        """Return the modes [n, 2, K, R] for 1 N of inclusions in one tissue."""
        plain = baseline(scenes[0])
        body = RoundBody(self._round_mesh, plain, self._round_sampler)
        model = OffAxisModel(self._mesh, self._sampler, body, order=ORDER, other_order=ORDER - 1)
        without, *pressed = (
            model.press(materials, [Press(force_n=SMALL_N)], estimate_error=False)[0].state
            for materials in (plain, *map(with_inclusion, scenes))
        )
        return np.array([face_modes(self._rays.r_mm[0], face, without) for face in pressed]) / SMALL_N


def aside_in_slabs(one: ScatteredInclusion, mismatches: Array, waveguide: Waveguide) -> Array:
    """Return the modes [1 + n, M, 2, K, R] of an inclusion in each of its slabs at all mismatches.

    Over force, size cubed and mismatch, all on one mesh.
    """

    def scene_of(slab: Slab, mismatch: float) -> Scene:
        inclusion = Inclusion(one.size_mm, one.depth_mm, slab.modulus_kpa(mismatch))
        scene = scene_on_one_mesh(slab, inclusion, one.thicknesses_mm, waveguide=waveguide)
        return replace(scene, placement=Placement(offset_x_mm=one.offset_mm))

    place = AsidePlace(scene_of(NOMINAL, float(mismatches[0])))
    over = one.size_mm**3 * mismatches[:, None, None, None]
    of_slabs = ([scene_of(slab, float(mismatch)) for mismatch in mismatches] for slab in one.slabs)
    return np.array([place.modes_per_n(scenes) for scenes in of_slabs]) / over


def as_rows(one: ScatteredInclusion, fields: Array, shapes: Array, mismatches: Array) -> list[SlabRows]:
    """Return the rows of one inclusion for each of `COSINES`, whose modes off the rim stand in a row.

    Fields [1 + n, M, 2, K, R] are those in its slabs; shapes are [M, 5, 2, K, R].
    """
    fields, shapes = fields[..., OFF_THE_RIM], shapes[..., OFF_THE_RIM]
    at = [
        coordinates(inclusion, slab, np.array([one.offset_mm]), OFFSETS_MM)
        for slab in one.slabs[1:]
        for mismatch in mismatches.tolist()
        for inclusion in [Inclusion(one.size_mm, one.depth_mm, slab.modulus_kpa(mismatch))]
    ]
    changes = (fields[1:] - fields[0]).reshape(-1, *fields.shape[2:])
    of_shapes = np.tile(shapes, (len(one.slabs) - 1, 1, 1, 1, 1))
    peaks = np.abs(of_shapes[:, 0].sum(axis=2)).max(axis=2)  # along +x all cosines are 1
    return [
        SlabRows(
            np.concatenate(at),
            changes[:, :, cosines].reshape(*changes.shape[:2], -1),
            of_shapes[:, :, :, cosines].reshape(*of_shapes.shape[:3], -1),
            peaks,
        )
        for cosines in COSINES
    ]


def build_aside_changes(
    nominal: TableAside,
    *,
    waveguide: Waveguide,
    places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int], None] = lambda done: None,
) -> AsideChanges:
    """Solve all inclusions in their slabs, and fit what these change of a table, at its own mismatches."""
    scenes, mismatches = scattered(places, (SIZE_MM, DEPTH_MM, OFFSETS_MM), SEED), nominal.axes.elastic_mismatch
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(aside_in_slabs)(one, mismatches, waveguide) for one in scenes
    )
    rows = []
    for one, fields in zip(scenes, solving, strict=True):
        rows.append(as_rows(one, fields, nominal.shapes(one), mismatches))
        on_point(len(rows))
    return fitted_aside(rows)


def fitted_aside(rows: list[list[SlabRows]]) -> AsideChanges:
    """Return the changes that fit the rows of all inclusions best."""
    of_cosines = [SlabRows(*map(np.concatenate, zip(*one, strict=True))) for one in zip(*rows, strict=True)]
    found = [fitted(one, REACHES, HIGHEST) for one in of_cosines]
    return AsideChanges(found[0][0], np.array([shares for _, shares in found]).astype(np.float32))
