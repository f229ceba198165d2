"""Builds the virtual probe's table of deformed surfaces from finite-element solves.

Chebyshev points in size (0 included), depth and ln E: 9 x 8 x 5 hold 0.5 % of the peak between the points (shown by
`tests/host_tools/test_surface_table.py` against fresh solves).
"""

from __future__ import annotations

import os
from collections.abc import Callable
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from device.measurement.quantities import Inclusion
from device.simulation.surface_table import Array, SurfaceTable, chebyshev_points
from host_tools.forward.solve import solve
from host_tools.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene

POINTS = (9, 8, 5)
"""Points in size, depth and modulus."""


def _lump_for_1_n(size_mm: float, depth_mm: float, modulus_kpa: float) -> Array:
    solution = solve(Scene(Inclusion(size_mm, depth_mm, modulus_kpa), Press(force_n=1.0)))
    return solution.lump_deformation_mm


def build_surface_table(
    *,
    points: tuple[int, int, int] = POINTS,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> SurfaceTable:
    """Solve every point of the table (about half a minute on two cores); `on_point` hears done and total."""
    ranges = list(zip(PAPER_BOX_LOW, PAPER_BOX_HIGH, strict=True))
    size, depth = (chebyshev_points(*ranges[i], points[i]) for i in (0, 1))
    modulus = np.exp(chebyshev_points(np.log(ranges[2][0]), np.log(ranges[2][1]), points[2]))
    bare = solve(Scene(None, Press(force_n=1.0)))
    lump = np.zeros((*points, len(bare.r_mm)))  # without size there is no lump field: row 0 stays 0
    grid = list(product(range(1, points[0]), range(points[1]), range(points[2])))
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    fields = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_lump_for_1_n)(size[i], depth[j], modulus[k]) for i, j, k in grid
    )
    for done, (index, field) in enumerate(zip(grid, fields, strict=True), start=1):
        lump[index] = field
        on_point(done, len(grid))
    return SurfaceTable(size, depth, modulus, bare.r_mm, bare.w_mm, lump)


def write_surface_table(table: SurfaceTable, folder: Path) -> None:
    """Write the table with the surroundings it was solved for."""
    table.save(folder, {"scene_defaults": Scene(None, Press(force_n=1.0)).surroundings()})
