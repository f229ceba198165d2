"""What other layers change, and how far the face moves outwards, in other slabs than the nominal one.

Known less well than the face itself, for they are small: inclusions and slabs scattered as in `slab_changes`, fewer of
them and with fewer terms, each solved on a mesh of its own. What a layer changes is a difference of two solves on one
mesh, so that meshes do not count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import product

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import SlabChanges, resampling
from host_tools.probe_tables.force_ramps import first_that_can
from host_tools.probe_tables.slab_changes import (
    FEWEST_FORCES,
    SLAB_FORCES_N,
    SLAB_LARGEST_N,
    SLABS_A_PLACE,
    NominalTable,
    ScatteredInclusion,
    SlabRows,
    as_rows,
    fitted,
    scattered,
)

PLACES, SLABS_SOLVED = 30, SLABS_A_PLACE
"""Inclusions that are solved, and slabs that each of them is solved in."""
MODULI_KPA, THICKNESSES_MM = (2.0, 2.7, 5.0, 12.0, 30.0), (15.0, 20.0, 30.0, 60.0)
"""Slabs that are solved without an inclusion; the nominal one is among them."""
REACHES = (3.0, 3.0, 4.0, 3.0, 3.0, 3.0), *[(2.0, 2.0, 3.0, 2.0, 2.0, 2.0)] * 4
HIGHEST = (3, 3, 4, 3, 1, 3)
"""Of each shape, which terms count: as in `slab_changes`. Of places left out, changes of deformation are missed by
4-9 % of themselves, where the nominal slab's would miss 24-40 %; those of pressure, themselves a hundredth of an
inclusion's, by a fifth to two thirds. So it is of the waveguide's layers; a skin's changes, of 1-5 % of both peaks, are
missed by up to a quarter. Of the mismatch only the ends are solved."""

InclusionSolve = Callable[[ScatteredInclusion, Slab, int], Array]
"""Fields [L, M, X, F, R] of L tables, of an inclusion in a slab at the first so many of `SLAB_FORCES_N`."""
BaselineSolve = Callable[[Slab], Array]
"""Fields [L, X, F, R] of L tables, of a slab without an inclusion at `SLAB_FORCES_N`."""


def build_changes_in_slabs(
    nominal: Sequence[NominalTable],
    solve: InclusionSolve,
    solve_baseline: BaselineSolve,
    *,
    places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int], None] = lambda done: None,
) -> tuple[SlabChanges, ...]:
    """Solve all slabs and inclusions, and fit what they change of each table; `on_point` hears how many are done."""
    slabs = [Slab(*one) for one in product(MODULI_KPA, THICKNESSES_MM)]
    baseline = Parallel(n_jobs=jobs)(delayed(solve_baseline)(slab) for slab in slabs)
    scenes = scattered(places)
    wanted = [(one, slab) for one in scenes for slab in one.slabs[1:]]
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(as_far_as_it_goes)(solve, one, slab) for one, slab in wanted
    )
    solved = []
    for of_slab in solving:
        solved.append(of_slab)
        on_point(len(solved))
    return assembled(nominal, scenes, baseline, solved)


def as_far_as_it_goes(solve: InclusionSolve, one: ScatteredInclusion, slab: Slab) -> Array:
    """Return the fields [L, M, X, F, R], NaN at forces to which soft tissue cannot be pressed.

    Raises `PressFailed` where not even `FEWEST_FORCES` are reached.
    """
    fields = first_that_can(lambda reached: solve(one, slab, reached), range(len(SLAB_FORCES_N), FEWEST_FORCES - 1, -1))
    missing = len(SLAB_FORCES_N) - fields.shape[-2]
    return np.pad(fields, (*[(0, 0)] * 3, (0, missing), (0, 0)), constant_values=np.nan)


def assembled(
    nominal: Sequence[NominalTable],
    scenes: Sequence[ScatteredInclusion],
    baseline: Sequence[Array],
    solved: Sequence[Array],
) -> tuple[SlabChanges, ...]:
    """Return what slabs change of each table, of the fields [L, X, F, R] of all slabs without an inclusion and those
    [L, M, X, F, R] of every inclusion in each of its slabs.
    """
    of_slabs = np.array(baseline).reshape(len(MODULI_KPA), len(THICKNESSES_MM), *baseline[0].shape)
    usual = MODULI_KPA.index(NOMINAL.youngs_modulus_kpa), THICKNESSES_MM.index(NOMINAL.thickness_mm)
    of_slabs = of_slabs - of_slabs[usual]
    by_place = np.split(np.array(solved), len(scenes))
    found = []
    for number, table in enumerate(nominal):
        rows = [_rows(one, fields[:, number], table) for one, fields in zip(scenes, by_place, strict=True)]
        degrees, shares = fitted(SlabRows(*map(np.concatenate, zip(*rows, strict=True))), REACHES, HIGHEST)
        to_own = resampling(SLAB_FORCES_N, table.force_n)
        found.append(
            SlabChanges(
                slab_modulus_kpa=np.array(MODULI_KPA),
                slab_thickness_mm=np.array(THICKNESSES_MM),
                bare_change_per_n=np.einsum("gf,ktxfr->ktxgr", to_own, of_slabs[:, :, number]).astype(np.float32),
                change_degrees=degrees,
                shape_shares=shares.astype(np.float32),
                largest_n=np.array(SLAB_LARGEST_N),
            )
        )
    return tuple(found)


def _rows(one: ScatteredInclusion, fields: Array, table: NominalTable) -> SlabRows:
    """Return the rows of one inclusion, of the fields [n, M, X, F, R] in its slabs but the nominal one."""
    shapes = table.shapes(one)
    in_nominal = np.moveaxis(shapes[0], 0, 1)[None]
    return as_rows(one, np.concatenate([in_nominal, fields]), shapes, table.axes.elastic_mismatch)
