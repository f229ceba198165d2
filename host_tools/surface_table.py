"""Builds the virtual probe's table of faces from finite-element force ramps in finite strain.

Chebyshev points in size, depth, ln E and force: 6 x 6 x 3 x 5 hold 0.5 % of a lump's largest deformation between the
points and 1 % of its largest pressure, ring means both (`tests/host_tools/test_surface_table.py`, fresh solves),
because what is interpolated is the lump field over the force and over the size cubed.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from device.measurement.quantities import Inclusion
from device.simulation.chebyshev import Array, points_inside, points_with_ends
from device.simulation.surface_table import PressRamps, Ramp, SurfaceTable
from host_tools.forward.accuracy import Level
from host_tools.forward.plan import model_plan
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve_ramp
from host_tools.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene

POINTS = (6, 6, 3)
"""Points in size, depth and modulus."""
SMALLEST_SIZE_MM = 1.0
FORCES_N = points_inside(0.0, 0.8, 5)
"""Up to some 4 mm of indentation; no solve at 0 N, where a field over the force has no value."""
EVERY = 2
"""Every which of the face's radii is kept: 0.1 mm apart."""
RING_MM = 1.0
"""Pressures are kept as means over rings of this width: at points they ring inside the elements by some 2 % of a lump's
peak, their forces do not. Light spreads as far in the skin."""
BARE = Level("blunt_fine", 3)
"""The level of the one ramp without a lump."""


def ramp(scene: Scene, forces_n: Array = FORCES_N, level: Level | None = None) -> tuple[Solution, ...]:
    """Return the scene's solutions at ascending forces, in finite strain with true sliding."""
    presses = [Press(force_n=float(force)) for force in forces_n]
    plan = model_plan(scene.with_press(presses[-1]), strain="finite")
    if level:
        plan = replace(plan, grading=level.grading, order=level.order)
    return solve_ramp(scene, presses, plan)


def fields(solution: Solution) -> tuple[Array, Array]:
    """Return (w, p) [2, R] without the lump, and what the lump adds, at the radii that the table keeps."""
    bare, pressed = solution.baseline, solution.pressed
    without, with_lump = (
        np.stack([face.w_mm[0], ring_means(solution.r_mm, face.p_kpa[0])]) for face in (bare, pressed)
    )
    return without[:, ::EVERY], (with_lump - without)[:, ::EVERY]


def ring_means(r_mm: Array, p_kpa: Array) -> Array:
    """Return the mean pressure over the ring `RING_MM` wide around every radius, cut at the rim."""
    density = r_mm * p_kpa
    force = np.concatenate([[0.0], np.cumsum(np.diff(r_mm) * (density[1:] + density[:-1]) / 2)])
    inner, outer = np.maximum(r_mm - RING_MM / 2, 0.0), np.minimum(r_mm + RING_MM / 2, r_mm[-1])
    return np.asarray((np.interp(outer, r_mm, force) - np.interp(inner, r_mm, force)) * 2 / (outer**2 - inner**2))


def _ramps_per_n(scene: Scene, level: Level | None = None) -> tuple[Array, Array]:
    """Return both kinds of fields over the force, each [2, F, R]."""
    bare, lump = zip(*(fields(solution) for solution in ramp(scene, level=level)), strict=True)
    over = FORCES_N[None, :, None]
    return np.stack(bare, axis=1) / over, np.stack(lump, axis=1) / over


def press_ramps(scene: Scene) -> PressRamps:
    """Return the ramps of one scene, solved for it alone: for what the table does not hold."""
    bare, lump = _ramps_per_n(scene)
    r_mm = np.linspace(0.0, scene.waveguide.radius_mm, bare.shape[-1])
    return PressRamps(r_mm, Ramp(FORCES_N, bare), Ramp(FORCES_N, lump))


def _lump_per_n_mm3(size_mm: float, depth_mm: float, modulus_kpa: float) -> Array:
    return _ramps_per_n(Scene(Inclusion(size_mm, depth_mm, modulus_kpa)))[1] / size_mm**3


def build_surface_table(
    *,
    points: tuple[int, int, int] = POINTS,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> SurfaceTable:
    """Solve every point of the table (about ten minutes on two cores); `on_point` hears done and total."""
    low, high = PAPER_BOX_LOW, PAPER_BOX_HIGH
    size = points_with_ends(SMALLEST_SIZE_MM, high[0], points[0])
    depth = points_with_ends(low[1], high[1], points[1])
    modulus = np.exp(points_with_ends(np.log(low[2]), np.log(high[2]), points[2]))
    bare = _ramps_per_n(Scene(None), BARE)[0]
    r_mm = np.linspace(0.0, Scene(None).waveguide.radius_mm, bare.shape[-1])
    lump = np.zeros((*points, 2, len(FORCES_N), len(r_mm)))
    grid = list(product(*map(range, points)))
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    solved = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_lump_per_n_mm3)(size[i], depth[j], modulus[k]) for i, j, k in grid
    )
    for done, (index, field) in enumerate(zip(grid, solved, strict=True), start=1):
        lump[index] = field
        on_point(done, len(grid))
    return SurfaceTable(size, depth, modulus, FORCES_N, r_mm, bare, np.moveaxis(lump, 3, 0))


def write_surface_table(table: SurfaceTable, folder: Path) -> None:
    """Write the table with the surroundings it was solved for."""
    table.save(folder, {"scene_defaults": Scene(None, Press(force_n=1.0)).surroundings(), "strain": "finite"})
