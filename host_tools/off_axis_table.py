"""Builds the virtual probe's table of lumps off the axis, and of a tilted probe, from solves in three dimensions.

Small strain, on the coarse mesh (0.6 % of the peak). Between the points (5 x 4 x 2 x 6) the fields hold 5 % of the peak
for stiff lumps under the face, 10 % for soft ones and 15 % at its rim, as `tests/host_tools/test_off_axis_table.py`
measures against fresh solves.
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
from device.simulation.chebyshev import Array, points_with_ends
from device.simulation.off_axis_table import OffAxisTable
from device.simulation.slab import NOMINAL
from host_tools.forward.face_state import FaceState
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.tiers import build
from host_tools.forward.tilt import tilt_per_degree
from host_tools.scene import Placement, Press, Scene
from host_tools.surface_table import lump_axes, ring_means

POINTS = (5, 4, 2, 6)
"""Points in size, depth, contrast and offset."""
SMALLEST_SIZE_MM = 2.0
OFFSETS_MM = (2.0, 16.0)
MODES = 11
"""Cosines kept: the twelfth of the narrowest lump is below a thousandth of its peak."""
EVERY = 4
"""Every which of the face's radii is kept: 0.2 mm apart."""


def off_axis_scene(inclusion: Inclusion, offset_mm: float, *, force_n: float = 1.0) -> Scene:
    """Return the default scene with the inclusion off the axis, along +x."""
    return Scene(inclusion, Press(force_n=force_n), placement=Placement(offset_x_mm=offset_mm))


def cosine_modes(field: Array) -> Array:
    """Return the cosine series [K, R] of a field [A, R] on evenly spaced rays, symmetric in the angle."""
    series = np.fft.rfft(field, axis=0).real / len(field)
    series[1:] *= 2
    return np.asarray(series[:MODES])


def lumps_per_n_mm3(size_mm: float, depth_mm: float, offset_mm: float, contrasts: Array) -> Array:
    """Return the modes [M, 2, K, R] of one geometry at all contrasts, over these too, on one mesh."""
    moduli_kpa = [NOMINAL.modulus_kpa(float(contrast)) for contrast in contrasts]
    scene = off_axis_scene(Inclusion(size_mm, depth_mm, moduli_kpa[-1]), offset_mm)
    meshed = build(scene, replace(model_plan(scene), grading="coarse"))
    bare, *pressed = (
        meshed.model.press(materials, [scene.press], estimate_error=False)[0].state
        for materials in (baseline(scene), *(with_inclusion(_with_modulus(scene, E)) for E in moduli_kpa))
    )
    modes = np.stack([face_modes(meshed.rays.r_mm[0], face, bare) for face in pressed])
    return modes / size_mm**3 / contrasts[:, None, None, None]


def _with_modulus(scene: Scene, modulus_kpa: float) -> Scene:
    assert scene.inclusion is not None  # off_axis_scene has given it one
    return replace(scene, inclusion=replace(scene.inclusion, youngs_modulus_kpa=modulus_kpa))


def face_modes(r_mm: Array, face: FaceState, bare: FaceState) -> Array:
    """Return the cosine series [2, K, R] of what a lump adds to deformation and pressure, on the radii of the table."""
    p_kpa = np.array([ring_means(r_mm, ray) for ray in face.p_kpa - bare.p_kpa])
    return np.stack([cosine_modes(face.w_mm - bare.w_mm), cosine_modes(p_kpa)])[..., ::EVERY]


def build_off_axis_table(
    *,
    points: tuple[int, int, int, int] = POINTS,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> OffAxisTable:
    """Solve every point of the table (about twenty minutes on two cores); `on_point` hears done and total."""
    axes = lump_axes(points[:3], SMALLEST_SIZE_MM)
    offset = points_with_ends(*OFFSETS_MM, points[3])
    r_mm, tilt_w_mm, tilt_p_kpa = tilt_per_degree(Scene(None))
    tilt = np.stack([tilt_w_mm, ring_means(r_mm, tilt_p_kpa)])[:, ::EVERY]
    lump = np.zeros((*points, 2, MODES, tilt.shape[-1]))
    grid = list(product(range(points[0]), range(points[1]), range(points[3])))
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    solved = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(lumps_per_n_mm3)(axes.size_mm[i], axes.depth_mm[j], offset[m], axes.contrast) for i, j, m in grid
    )
    for done, ((i, j, m), modes) in enumerate(zip(grid, solved, strict=True), start=1):
        lump[i, j, :, m] = modes
        on_point(done, len(grid))
    return OffAxisTable(*axes, offset, r_mm[::EVERY], np.moveaxis(lump, 4, 0), tilt)


def write_off_axis_table(table: OffAxisTable, folder: Path) -> None:
    """Write the table with the surroundings it was solved for."""
    table.save(folder, {"scene_defaults": Scene(None, Press(force_n=1.0)).surroundings(), "strain": "small"})
