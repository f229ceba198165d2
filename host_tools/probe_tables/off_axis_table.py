"""Builds the virtual probe's table of inclusions off the axis, and of a tilted probe, from solves in three dimensions.

Small strain, on the coarse mesh (0.6 % of the peak). Between the points (5 x 5 x 2 x 7) deformations hold 2 % of the
inclusion's peak and ring means of pressure, which jump from mesh to mesh, 4 % rms, as
`tests/host_tools/probe_tables/test_off_axis_table.py` measures against fresh solves.

A probe that is tilted while it touches turns its back about y, by one degree, in small strain and closed contact. That
is linear, so it adds to any press; where the sum of the pressures would pull, the face has lifted, and closed contact
no longer holds. The field is a cosine of the angle, so the ray along +x says it all.
"""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed
from ngsolve import x

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_with_ends
from device.simulation.physics.off_axis_table import OffAxisTable
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.forward.face_state import Rays
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.meshes.solid_mesh import SolidResolution, solid_mesh
from host_tools.forward.plan import model_plan
from host_tools.forward.sampling import FaceSampler
from host_tools.forward.small_strain.contact import contact_pressure_kpa
from host_tools.forward.small_strain.linear_press import LinearPress
from host_tools.forward.symmetry import SOLID
from host_tools.forward.tiers import build
from host_tools.probe_tables.aside_changes import OFFSETS_MM, PLACES, SIZE_MM, TableAside, build_aside_changes
from host_tools.probe_tables.cosine_modes import EVERY, MODES, face_modes
from host_tools.probe_tables.force_ramps import ring_means, scene_in
from host_tools.probe_tables.surface_table import inclusion_axes, require_tabulated, solved_for
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import Placement, Press, Scene, Waveguide

ORDER = 3
POINTS = (5, 5, 2, 7)
"""Points in size, depth, mismatch and offset."""
SMALLEST_SIZE_MM = SIZE_MM[0]
TILT_MODULI_KPA, TILT_THICKNESSES_MM = (2.0, 5.0, 12.0, 30.0), (15.0, 20.0, 30.0, 60.0)
"""Slabs that a tilted probe is pressed on, the nominal one among them."""


def tilt_per_degree(
    scene: Scene, *, resolution: SolidResolution | None = None, order: int = ORDER
) -> tuple[Array, Array, Array]:
    """Return r_mm, w_mm and p_kpa [R] along +x for one degree that lowers the +x side, without an inclusion."""
    mesh = solid_mesh(scene, symmetry="half", order=order, resolution=resolution or SolidResolution())
    rays = Rays.over(scene.waveguide)
    sampler = FaceSampler(mesh, rays, "half")
    press, materials = LinearPress(mesh, SOLID, order), baseline(scene)
    sinking_mm = math.tan(math.radians(1.0)) * x
    u = press.displacement(materials, sinking_mm)
    probe, _ = press.contact.bodies(u.components)
    pressure = contact_pressure_kpa(mesh, SOLID, order, press.stress_of_probe(u, materials))
    return rays.r_mm[0], sampler(probe.u[-1] + sinking_mm)[0], sampler(pressure)[0]


def off_axis_scene(
    inclusion: Inclusion, offset_mm: float, *, force_n: float = 1.0, waveguide: Waveguide | None = None
) -> Scene:
    """Return the default scene with the inclusion off the axis, along +x; the waveguide is the default one, too."""
    place = Placement(offset_x_mm=offset_mm)
    return Scene(inclusion, Press(force_n=force_n), waveguide or Waveguide(), placement=place)


def inclusions_per_n_mm3(
    size_mm: float, depth_mm: float, offset_mm: float, mismatches: Array, waveguide: Waveguide | None = None
) -> Array:
    """Return the modes [M, 2, K, R] of one geometry at all mismatches, over these too, on one mesh."""
    moduli_kpa = [NOMINAL.modulus_kpa(float(mismatch)) for mismatch in mismatches]
    scene = off_axis_scene(Inclusion(size_mm, depth_mm, moduli_kpa[-1]), offset_mm, waveguide=waveguide)
    meshed = build(scene, replace(model_plan(scene), grading="coarse"))
    inclusion_free, *pressed = (
        meshed.model.press(materials, [scene.press], estimate_error=False)[0].state
        for materials in (baseline(scene), *(with_inclusion(_with_modulus(scene, E)) for E in moduli_kpa))
    )
    modes = np.stack([face_modes(meshed.rays.r_mm[0], face, inclusion_free) for face in pressed])
    return modes / size_mm**3 / mismatches[:, None, None, None]


def _with_modulus(scene: Scene, modulus_kpa: float) -> Scene:
    assert scene.inclusion is not None  # off_axis_scene has given it one
    return replace(scene, inclusion=replace(scene.inclusion, youngs_modulus_kpa=modulus_kpa))


def build_off_axis_table(
    *,
    waveguide: Waveguide | None = None,
    points: tuple[int, int, int, int] = POINTS,
    slab_places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> OffAxisTable:
    """Solve every point of the table (some 50 minutes on two cores, most of it other slabs); `on_point` hears done and
    total.

    Of a waveguide, the simulated probe's unless given; raise `InvalidQuantity` for one whose face no table holds.
    """
    waveguide = waveguide or Waveguide()
    require_tabulated(waveguide)
    axes = inclusion_axes(points[:3], SMALLEST_SIZE_MM)
    offset = points_with_ends(*OFFSETS_MM, points[3])
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    r_mm, tilt = tilts(waveguide, jobs)
    inclusion_field = np.zeros((*points, 2, MODES, len(r_mm)))
    grid = list(product(range(points[0]), range(points[1]), range(points[3])))
    total = len(grid) + slab_places
    solved = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(inclusions_per_n_mm3)(axes.size_mm[i], axes.depth_mm[j], offset[m], axes.elastic_mismatch, waveguide)
        for i, j, m in grid
    )
    for done, ((i, j, m), modes) in enumerate(zip(grid, solved, strict=True), start=1):
        inclusion_field[i, j, :, m] = modes
        on_point(done, total)
    nominal = TableAside(axes, np.moveaxis(inclusion_field, 4, 0), offset)
    slabs = build_aside_changes(
        nominal,
        waveguide=waveguide,
        places=slab_places,
        jobs=jobs,
        on_point=lambda done: on_point(len(grid) + done, total),
    )
    of_tilts = np.array(TILT_MODULI_KPA), np.array(TILT_THICKNESSES_MM), tilt
    return OffAxisTable(*axes, offset, r_mm, nominal.per_n_mm3, *of_tilts, slabs)


def tilts(waveguide: Waveguide, jobs: int = -1) -> tuple[Array, Array]:
    """Return the table's radii [R] and the fields [E, T, 2, R] of one degree in all of the slabs of tilts."""
    scenes = [scene_in(Slab(*slab), waveguide=waveguide) for slab in product(TILT_MODULI_KPA, TILT_THICKNESSES_MM)]
    solved = Parallel(n_jobs=jobs)(delayed(tilt_per_degree)(scene) for scene in scenes)
    fields = np.array([(w_mm, ring_means(r_mm, p_kpa)) for r_mm, w_mm, p_kpa in solved])[..., ::EVERY]
    shape = len(TILT_MODULI_KPA), len(TILT_THICKNESSES_MM)
    return solved[0][0][::EVERY], fields.reshape(*shape, *fields.shape[1:])


def write_off_axis_table(table: OffAxisTable, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "small"})
