"""Builds the virtual probe's table of faces from finite-element force ramps in finite strain.

Chebyshev points in size, depth, mismatch and force: 7 x 7 x 3 x 5 hold 0.2 % of an inclusion's largest deformation
between the points and 0.4 % of its largest pressure, ring means both
(`tests/host_tools/probe_tables/test_surface_table.py`, fresh solves), because what is interpolated is the inclusion
field over the force, the size cubed and the mismatch. All of it is in the nominal slab; `slab_changes`
solves others.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.parameters import ELASTIC_MISMATCHES
from device.measurement.quantities import InvalidQuantity
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL
from device.simulation.physics.surface_table import SurfaceTable
from host_tools.probe_tables.force_ramps import FORCES_N, INCLUSIONS, bare_per_n, inclusions_per_n_mm3, scene_in
from host_tools.probe_tables.slab_changes import PLACES, NominalTable, build_slab_changes
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene, Waveguide

POINTS = (7, 7, 3)
"""Points in size, depth and mismatch."""
SMALLEST_SIZE_MM = 1.0
COARSE = slice(None, None, 2)
"""Tables of what layers change are of every second size and depth: of an odd number of Chebyshev points these are
Chebyshev points as well."""


def inclusion_axes(points: tuple[int, int, int], smallest_size_mm: float) -> InclusionAxes:
    """Return Chebyshev points over the sizes and depths of the paper's box and over `ELASTIC_MISMATCHES`."""
    low, high = PAPER_BOX_LOW, PAPER_BOX_HIGH
    return InclusionAxes(
        points_with_ends(smallest_size_mm, high[0], points[0]),
        points_with_ends(low[1], high[1], points[1]),
        points_with_ends(*ELASTIC_MISMATCHES, points[2]),
    )


def require_tabulated(waveguide: Waveguide) -> None:
    """Refuse a face that no table can hold: fields over the radius are those of a round, flat one."""
    action = "build a round and flat face, or solve each scene on its own"
    if waveguide.face != "round":
        raise InvalidQuantity("face.shape of the tables' probe", waveguide.face, "round", action)
    if waveguide.dome_mm:
        raise InvalidQuantity("face.dome_mm of the tables' probe", waveguide.dome_mm, "0 mm", action)


def build_surface_table(
    *,
    waveguide: Waveguide | None = None,
    points: tuple[int, int, int] = POINTS,
    slab_places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> SurfaceTable:
    """Solve every point of the table (some 50 minutes on two cores, most of it other slabs); `on_point` hears done and
    total.

    Of a waveguide, the simulated probe's unless given; raise `InvalidQuantity` for one whose face no table holds.
    """
    waveguide = waveguide or Waveguide()
    require_tabulated(waveguide)
    axes = inclusion_axes(points, SMALLEST_SIZE_MM)
    places = list(product(axes.size_mm, axes.depth_mm))
    total = len(places) + slab_places
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    scene_of = partial(scene_in, waveguide=waveguide)
    baseline = bare_per_n(scene_of(NOMINAL), FORCES_N)
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(inclusions_per_n_mm3)(scene_of, NOMINAL, INCLUSIONS, *place, axes.elastic_mismatch) for place in places
    )
    inclusion_field: list[Array] = []
    for done, of_place in enumerate(solving, start=1):
        inclusion_field.append(of_place)
        on_point(done, total)
    nominal = NominalTable(axes, on_axes(axes, inclusion_field), FORCES_N)
    slabs = build_slab_changes(
        nominal,
        waveguide=waveguide,
        places=slab_places,
        jobs=jobs,
        on_point=lambda done: on_point(len(places) + done, total),
    )
    r_mm = np.linspace(0.0, waveguide.radius_mm, baseline.shape[-1])
    return SurfaceTable(*axes, FORCES_N, r_mm, baseline, nominal.per_n_mm3, slabs)


def on_axes(axes: InclusionAxes, solved: Sequence[Array]) -> Array:
    """Return the fields [2, S, D, M, F, R] of those [M, 2, F, R] of every place, depths fastest."""
    grid = np.array(solved).reshape(len(axes.size_mm), len(axes.depth_mm), *solved[0].shape)
    return np.moveaxis(grid, 3, 0)


def write_surface_table(table: SurfaceTable, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "finite"})


def solved_for(probe: Probe) -> dict[str, object]:
    """Return what a table of pressed faces says of its origin."""
    scene = Scene(None, Press(force_n=1.0), probe.waveguide)
    return {"scene_defaults": scene.surroundings(), **probe.origin()}
