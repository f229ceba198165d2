"""Solves what tissue other than the nominal slab changes of the pressed face, and fits polynomials to it.

Inclusions and slabs are scattered together, denser towards their ends, as the polynomials want it. Each inclusion is
solved in several slabs and in the nominal one on one mesh, and the difference is what counts: from mesh to mesh
pressures differ by more than a slab changes them. Slabs of one mesh are layers of it; those below a slab's base are as
good as rigid. Forces are the same in all tissue, up to the largest that a ramp goes to: 2 kPa gives way by 10 mm there.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from itertools import product
from typing import NamedTuple

import numpy as np
from joblib import Parallel, delayed
from numpy.typing import NDArray
from scipy.stats import qmc

from device.measurement.arrays import Array
from device.measurement.parameters import ABOVE_BASE_MM
from device.measurement.quantities import Inclusion
from device.measurement.ramp_modes.legendre import LegendreTerms
from device.simulation.physics.chebyshev import points_inside
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, PEOPLES_KPA, PEOPLES_MM, Slab
from device.simulation.physics.slab_changes import (
    DEPTH_MM,
    SIZE_MM,
    SLAB,
    SlabChanges,
    changing_terms,
    coordinates,
    field_shapes,
    resampling,
)
from host_tools.forward.plan import Level
from host_tools.probe_tables.force_ramps import (
    CHANGES,
    SceneOf,
    bare_per_n,
    first_that_can,
    inclusions_per_n_mm3,
    scene_on_one_mesh,
)
from host_tools.scenes.scene import Waveguide

PLACES, SLABS_A_PLACE = 160, 3
"""Inclusions that are solved, and slabs beside the nominal one that each of them is solved in."""
SEED = 1
SLAB_LARGEST_N = 0.66
"""As far as a hand goes in a ramp; softest tissue in a thick slab cannot be pressed much further."""
SLAB_FORCES_N = points_inside(0.0, SLAB_LARGEST_N, 5)
FEWEST_FORCES = 3
"""Of these forces, as many are reached in any tissue."""
MODULI_KPA = (2.0, 2.3, 3.3, 5.0, 9.0, 16.0, 25.0, 30.0)
THICKNESSES_MM = (15.0, 16.2, 20.2, 30.0, 46.0, 60.0)
"""Slabs that are solved without an inclusion: all but Chebyshev points in ln Et and 1/T, the nominal one among them."""
WITHOUT_INCLUSION = Level("blunt_rim", 3), Level("blunt", 4), Level("blunt", 3)
"""Levels of slabs without an inclusion, each where the one before cannot be pressed so far. On the table's own,
`blunt_fine 3`, changes of pressure differ from the first's by 0.1 % of the peak up to 8 mm from the axis and by 0.5 %
at 9.9 mm; it takes ten minutes where 2 kPa takes this one ten seconds.
"""
REACHES = (7.0, 7.0, 6.0, 5.0, 9.0, 12.0), *[(3.0, 3.0, 3.0, 2.1, 4.0, 6.0)] * 4
"""Of each shape, a term counts when its degrees in size, depth, ln Et, 1/T^2, mismatch and force over these add up to
at most 1."""
HIGHEST = (9, 9, 9, 9, 2, 3)
SMALL_CHANGE = 0.3
"""Of the field's peak; errors of a change as small as this, or smaller, count alike."""
RIDGE, ROUNDING = 1e-6, 1e-12
ROWS_AT_ONCE = 60
APART_MM = 0.5
"""Thicknesses on one mesh are the same or differ by this much: thinner layers would make bad elements."""


class ScatteredInclusion(NamedTuple):
    """Place and size of one inclusion, and the slabs that it is solved in; the nominal one is the first."""

    size_mm: float
    depth_mm: float
    slabs: tuple[Slab, ...]
    offset_mm: float = 0.0

    @property
    def thicknesses_mm(self) -> tuple[float, ...]:
        """The ascending thicknesses that its mesh has."""
        return tuple(sorted({slab.thickness_mm for slab in self.slabs}))


def scattered(
    places: int = PLACES, ends: Sequence[tuple[float, float]] = (SIZE_MM, DEPTH_MM), seed: int = SEED
) -> list[ScatteredInclusion]:
    """Return inclusions in slabs that hold them, of a Sobol sequence with the density of Chebyshev points.

    `ends` are those of size and depth, and of the offset where there is one.
    """
    even = qmc.Sobol(len(ends) + 2 * SLABS_A_PLACE, seed=seed).random_base2(places.bit_length())[:places]
    low, high = np.array(ends).T
    found = []
    for shares in (1 - np.cos(np.pi * even)) / 2:
        size_mm, depth_mm, *offset_mm = (low + shares[: len(ends)] * (high - low)).tolist()
        of_slabs = shares[len(ends) :]
        thinnest_mm = max(PEOPLES_MM[0], size_mm + depth_mm + ABOVE_BASE_MM)
        slabs = [NOMINAL]
        for modulus, thickness in zip(of_slabs[::2], of_slabs[1::2], strict=True):
            modulus_kpa = min(float(PEOPLES_KPA[0] * (PEOPLES_KPA[1] / PEOPLES_KPA[0]) ** modulus), PEOPLES_KPA[1])
            wanted_mm = 1 / (1 / PEOPLES_MM[1] + thickness * (1 / thinnest_mm - 1 / PEOPLES_MM[1]))
            thickness_mm = max(round(float(wanted_mm), 1), math.ceil(10 * thinnest_mm) / 10)
            slabs.append(Slab(modulus_kpa, _not_too_near(thickness_mm, slabs)))
        found.append(ScatteredInclusion(size_mm, depth_mm, tuple(slabs), *offset_mm))
    return found


def _not_too_near(thickness_mm: float, slabs: Sequence[Slab]) -> float:
    """Return the thickness, or that of a slab which all but has it."""
    near = (slab.thickness_mm for slab in slabs if abs(slab.thickness_mm - thickness_mm) < APART_MM)
    return next(near, thickness_mm)


def inclusion_in_slabs(one: ScatteredInclusion, mismatches: Array, waveguide: Waveguide) -> Array:
    """Return what an inclusion adds in each of its slabs at all mismatches [1 + n, M, 2, F, R].

    Over force, size cubed and mismatch, at `SLAB_FORCES_N`; NaN where soft tissue cannot be pressed so far.
    """
    scene_of = partial(scene_on_one_mesh, thicknesses_mm=one.thicknesses_mm, waveguide=waveguide)
    return np.array([_as_far_as_it_goes(scene_of, slab, one, mismatches) for slab in one.slabs])


def _as_far_as_it_goes(scene_of: SceneOf, slab: Slab, one: ScatteredInclusion, mismatches: Array) -> Array:
    """Return the fields [M, 2, F, R] in a slab; raises `PressFailed` where not even `FEWEST_FORCES` are reached."""

    def to(reached: int) -> Array:
        forces_n = SLAB_FORCES_N[:reached]
        return inclusions_per_n_mm3(scene_of, slab, CHANGES, one.size_mm, one.depth_mm, mismatches, forces_n)

    fields = first_that_can(to, range(len(SLAB_FORCES_N), FEWEST_FORCES - 1, -1))
    missing = len(SLAB_FORCES_N) - fields.shape[2]
    return np.pad(fields, ((0, 0), (0, 0), (0, missing), (0, 0)), constant_values=np.nan)


class SlabRows(NamedTuple):
    """Coordinates [n, 6] of inclusions in slabs at a mismatch and a force, changes [n, X, R] of X fields,
    `field_shapes` [n, 5, X, R] of the inclusions in the nominal slab, and their peaks [n, X].
    """

    at: Array
    changes: Array
    shapes: Array
    peaks: Array


def as_rows(one: ScatteredInclusion, fields: Array, shapes: Array, mismatches: Array) -> SlabRows:
    """Return the rows of one inclusion: fields [1 + n, M, X, F, R] in its slabs, shapes [5, X, M, F, R].

    Forces that were not reached are left out.
    """
    at = [
        coordinates(Inclusion(one.size_mm, one.depth_mm, slab.modulus_kpa(float(mismatch))), slab, SLAB_FORCES_N)
        for slab in one.slabs[1:]
        for mismatch in mismatches
    ]
    slabs = len(one.slabs) - 1
    changes = np.moveaxis(fields[1:] - fields[0], 2, 3).reshape(-1, *fields.shape[2:3], fields.shape[-1])
    of_shapes = np.moveaxis(shapes, (0, 1), (2, 3)).reshape(-1, *shapes.shape[:2], shapes.shape[-1])
    peaks = np.abs(shapes[0]).max(axis=(1, 2, 3))
    repeated = np.tile(of_shapes, (slabs, 1, 1, 1)), np.tile(peaks, (len(changes), 1))
    rows = SlabRows(np.concatenate(at), changes, *repeated)
    return SlabRows(*(part[np.isfinite(changes).all(axis=(1, 2))] for part in rows))


def fitted(
    rows: SlabRows, reaches: Sequence[Sequence[float]] = REACHES, highest: Sequence[int] = HIGHEST
) -> tuple[NDArray[np.uint8], Array]:
    """Return degrees [N, 6] and shares [N, 5, X] of the shapes, by least squares over all radii.

    Which terms count: `REACHES`, `HIGHEST`. An error counts over the peak of the inclusion's field, and the less the
    more the slab changes it: near the nominal slab a small change is to be right, too.
    """
    degrees, of_shape = terms_of_shapes(reaches, highest)
    terms, unknowns = LegendreTerms(degrees), sum(int(wanted.sum()) for wanted in of_shape)
    fields = rows.changes.shape[1]
    normal, right = np.zeros((fields, unknowns, unknowns)), np.zeros((fields, unknowns))
    for start in range(0, len(rows.at), ROWS_AT_ONCE):
        part = SlabRows(*(one[start : start + ROWS_AT_ONCE] for one in rows))
        design = changing_terms(terms, part.at)
        for field in range(fields):
            equations, values = _equations(part, design, of_shape, field)
            normal[field] += equations.T @ equations
            right[field] += equations.T @ values
    found = np.zeros((len(degrees), *rows.shapes.shape[1:3]))
    for field in range(fields):
        ends = np.cumsum([int(wanted.sum()) for wanted in of_shape])[:-1]
        for shape, shares in enumerate(np.split(_solved(normal[field], right[field]), ends)):
            found[of_shape[shape], shape, field] = shares
    return degrees, found


def _equations(rows: SlabRows, design: Array, of_shape: Sequence[NDArray[np.bool_]], field: int) -> tuple[Array, Array]:
    """Return the equations of the shares, one a row and radius, and what they shall give."""
    relative = np.abs(rows.changes[:, field]).max(axis=1) / rows.peaks[:, field]
    weight = 1 / (rows.peaks[:, field] * (SMALL_CHANGE + relative))
    columns = [
        (weight[:, None] * design[:, wanted])[..., None] * rows.shapes[:, shape, field, None]
        for shape, wanted in enumerate(of_shape)
    ]
    equations = np.moveaxis(np.concatenate(columns, axis=1), 1, 2)
    return equations.reshape(-1, equations.shape[-1]), (weight[:, None] * rows.changes[:, field]).ravel()


def _solved(normal: Array, right: Array) -> Array:
    """Return the unknowns of scaled normal equations; a little ridge keeps shapes that are all but alike apart."""
    scale = np.sqrt(np.diag(normal))
    scaled = normal / np.multiply.outer(scale, scale) + RIDGE * np.eye(len(scale))
    return np.asarray(np.linalg.solve(scaled, right / scale) / scale)


def terms_of_shapes(
    reaches: Sequence[Sequence[float]], highest: Sequence[int]
) -> tuple[NDArray[np.uint8], list[NDArray[np.bool_]]]:
    """Return the degrees [N, 6] of all terms that change with the slab, and which of them each shape has."""
    furthest = np.minimum(np.max(reaches, axis=0), highest)
    every = np.array(list(product(*(range(int(one) + 1) for one in furthest))), dtype=np.uint8)
    changes = every[:, SLAB].any(axis=1)
    of_shape = [changes & ((every / np.array(reach)).sum(axis=1) <= 1 + 1e-9) for reach in reaches]
    needed = np.any(of_shape, axis=0)
    return np.asarray(every[needed]), [wanted[needed] for wanted in of_shape]


class NominalTable(NamedTuple):
    """A table's fields [X, S, D, M, F, R] in the nominal slab, over force, size cubed and mismatch, at its forces."""

    axes: InclusionAxes
    per_n_mm3: Array
    force_n: Array

    def shapes(self, one: ScatteredInclusion) -> Array:
        """Return `field_shapes` [5, X, M, F, R] of an inclusion at `SLAB_FORCES_N`, over size cubed and mismatch."""
        to_own = resampling(self.force_n, SLAB_FORCES_N)
        at_forces = []
        for mismatch in self.axes.elastic_mismatch:
            inclusion = Inclusion(
                one.size_mm, one.depth_mm, NOMINAL.modulus_kpa(float(mismatch + ROUNDING * (0.5 - mismatch)))
            )
            shapes = field_shapes(self.axes, self.per_n_mm3, self.force_n, inclusion)
            at_forces.append(np.einsum("gf,hxfr->hxgr", to_own, shapes) / (one.size_mm**3 * mismatch))
        return np.stack(at_forces, axis=2)


def build_slab_changes(
    nominal: NominalTable,
    *,
    waveguide: Waveguide,
    places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int], None] = lambda done: None,
) -> SlabChanges:
    """Solve all slabs and inclusions, and fit what they change of a table, at its own mismatches and forces."""
    scenes = scattered(places)
    slabs = [Slab(*one) for one in product(MODULI_KPA, THICKNESSES_MM)]
    baseline = Parallel(n_jobs=jobs)(delayed(slab_change_per_n)(slab, waveguide) for slab in slabs)
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(inclusion_in_slabs)(one, nominal.axes.elastic_mismatch, waveguide) for one in scenes
    )
    rows = []
    for one, fields in zip(scenes, solving, strict=True):
        rows.append(as_rows(one, fields, nominal.shapes(one), nominal.axes.elastic_mismatch))
        on_point(len(rows))
    return assembled(nominal, baseline, SlabRows(*map(np.concatenate, zip(*rows, strict=True))))


def slab_change_per_n(slab: Slab, waveguide: Waveguide) -> Array:
    """Return what a slab changes of the fields [2, F, R] without an inclusion over the force, at `SLAB_FORCES_N`.

    Slab and nominal slab are on one mesh and one level. Raises `PressFailed` where a force cannot be reached on any.
    """
    return first_that_can(
        lambda level: _on_level(slab, waveguide, level) - _on_level(NOMINAL, waveguide, level), WITHOUT_INCLUSION
    )


@lru_cache(maxsize=2 * len(WITHOUT_INCLUSION))  # the nominal slab is a term of every change
def _on_level(slab: Slab, waveguide: Waveguide, level: Level) -> Array:
    return bare_per_n(scene_on_one_mesh(slab, None, THICKNESSES_MM, waveguide=waveguide), SLAB_FORCES_N, (level,))


def assembled(nominal: NominalTable, baseline: Sequence[Array], rows: SlabRows) -> SlabChanges:
    """Return the changes, those without an inclusion at the table's own forces, as polynomials in the force."""
    to_own = resampling(SLAB_FORCES_N, nominal.force_n)
    shape = len(MODULI_KPA), len(THICKNESSES_MM)
    of_slabs = np.einsum("gf,kxfr->kxgr", to_own, np.array(baseline)).reshape(*shape, *baseline[0].shape)
    degrees, shares = fitted(rows)
    return SlabChanges(
        slab_modulus_kpa=np.array(MODULI_KPA),
        slab_thickness_mm=np.array(THICKNESSES_MM),
        bare_change_per_n=of_slabs.astype(np.float32),
        change_degrees=degrees,
        shape_shares=shares.astype(np.float32),
        largest_n=np.array(SLAB_LARGEST_N),
    )
