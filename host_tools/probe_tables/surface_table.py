"""Builds the virtual probe's table of faces from finite-element force ramps in finite strain.

Chebyshev points in size, depth, mismatch and force: 7 x 7 x 3 x 5 hold 0.2 % of an inclusion's largest deformation
between the points and 0.4 % of its largest pressure, ring means both
(`tests/host_tools/probe_tables/test_surface_table.py`, fresh solves), because what is interpolated is the inclusion
field over the force, the size cubed and the mismatch. What other slabs change is solved as a star: one modulus or one
thickness apart from the nominal slab, at every second size and depth, and each as the difference of two solves on one
mesh, whose errors cancel.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from itertools import pairwise, product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.simulation.physics.chebyshev import points_inside, points_with_ends
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.surface_table import COARSE, PressRamps, Ramp, SurfaceTable
from host_tools.forward.accuracy import Level
from host_tools.forward.plan import model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve_ramps
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe
from host_tools.scenes.scene import PAPER_BOX_HIGH, PAPER_BOX_LOW, Press, Scene, Tissue, TissueLayer, Waveguide

POINTS = (7, 7, 3)
"""Points in size, depth and mismatch."""
ELASTIC_MISMATCHES = (0.1, 0.96)
"""8-200 kPa in tissue of 4-6.25 kPa, with a little to spare; 6.4-305 kPa in the nominal slab."""
SLAB_MODULI_KPA = (4.0, 5.0, 6.25)
SLAB_THICKNESSES_MM = (27.5, 30.0, 36.0)
"""The star, nominal in the middle; in the thinnest slab the deepest and largest inclusion just clears the base."""
RIGID_KPA = 1e6
"""Modulus of what stands in for the base."""
SMALLEST_SIZE_MM = 1.0
LARGEST_N = 0.8
FORCES_N = points_inside(0.0, LARGEST_N, 5)
"""Up to some 4 mm of indentation; no solve at 0 N, where a field over the force has no value."""
EVERY = 2
"""Every which of the face's radii is kept: 0.1 mm apart."""
RING_MM = 1.0
"""Pressures are kept as means over rings of this width: at points they ring inside the elements by some 2 % of an
inclusion's peak, their forces do not. Light spreads as far in the skin.
"""
BASELINE = (Level("blunt_fine", 3),)
"""The level of the ramps without an inclusion."""
INCLUSIONS = Level("blunt_rim", 3), Level("blunt", 4), Level("blunt", 3)
"""Those of an inclusion's: each where the one before cannot be pressed so far, mostly because its rim folds. What rims
do wrong is most of the error: of a peak of pressure the last is off by 0.3-1.2 %, the others by 0.1-0.4 %.
`blunt_rim 3` takes 1.2 times its time, `blunt 4` 2.2 times.
"""
CHANGES = (Level("blunt", 3),)
"""That of changes: nothing folds on it, and both terms of a difference are on one level."""


def ramp(scene: Scene, forces_n: Array = FORCES_N, levels: Sequence[Level] = INCLUSIONS) -> tuple[Solution, ...]:
    """Return the scene's solutions at ascending forces, in finite strain with true sliding."""
    return _ramps([scene], forces_n, levels)[0]


def _ramps(
    scenes: Sequence[Scene], forces_n: Array = FORCES_N, levels: Sequence[Level] = INCLUSIONS
) -> tuple[tuple[Solution, ...], ...]:
    """Return the ramps of scenes that differ in the modulus of the inclusion alone, on the first level that can."""
    presses = [Press(force_n=float(force)) for force in forces_n]
    plan = model_plan(scenes[0].with_press(presses[-1]), strain="finite")
    for level in levels[:-1]:
        with suppress(PressFailed):
            return solve_ramps(scenes, presses, replace(plan, grading=level.grading, order=level.order))
    return solve_ramps(scenes, presses, replace(plan, grading=levels[-1].grading, order=levels[-1].order))


def fields(solution: Solution) -> tuple[Array, Array]:
    """Return (w, p) [2, R] without the inclusion, and what the inclusion adds, at the radii that the table keeps."""
    baseline, pressed = solution.baseline, solution.pressed
    without, inclusion_materials = (
        np.stack([face.w_mm[0], ring_means(solution.r_mm, face.p_kpa[0])]) for face in (baseline, pressed)
    )
    return without[:, ::EVERY], (inclusion_materials - without)[:, ::EVERY]


def ring_means(r_mm: Array, p_kpa: Array) -> Array:
    """Return the mean pressure over the ring `RING_MM` wide around every radius, cut at the rim."""
    density = r_mm * p_kpa
    force = np.concatenate([[0.0], np.cumsum(np.diff(r_mm) * (density[1:] + density[:-1]) / 2)])
    inner, outer = np.maximum(r_mm - RING_MM / 2, 0.0), np.minimum(r_mm + RING_MM / 2, r_mm[-1])
    return np.asarray((np.interp(outer, r_mm, force) - np.interp(inner, r_mm, force)) * 2 / (outer**2 - inner**2))


def _per_n(solutions: Sequence[Solution], forces_n: Array = FORCES_N) -> tuple[Array, Array]:
    """Return both kinds of fields of a ramp over the force, each [2, F, R]."""
    baseline, inclusion_field = zip(*(fields(solution) for solution in solutions), strict=True)
    over = forces_n[None, :, None]
    return np.stack(baseline, axis=1) / over, np.stack(inclusion_field, axis=1) / over


def press_ramps(scene: Scene, largest_n: float = LARGEST_N) -> PressRamps:
    """Return the ramps of one scene up to a force, solved for it alone: for what the table does not hold.

    That without the inclusion is on the level of the table's: on the mesh of an inclusion the light beside it would
    tell another tissue, by half a kPa.
    """
    inclusion_field = inclusion_ramp(scene, largest_n)
    baseline = bare_per_n(replace(scene, inclusion=None), inclusion_field.force_n)
    r_mm = np.linspace(0.0, scene.waveguide.radius_mm, baseline.shape[-1])
    return PressRamps(r_mm, Ramp(inclusion_field.force_n, baseline), inclusion_field)


def inclusion_ramp(scene: Scene, largest_n: float = LARGEST_N, levels: Sequence[Level] = INCLUSIONS) -> Ramp:
    """Return what the inclusion of one scene adds up to a force, solved for it alone."""
    forces_n = points_inside(0.0, largest_n, len(FORCES_N))
    return Ramp(forces_n, _per_n(ramp(scene, forces_n, levels), forces_n)[1])


def scene_in(slab: Slab, inclusion: Inclusion | None = None, *, waveguide: Waveguide | None = None) -> Scene:
    """Return the default scene in another slab, pressed by a waveguide: the simulated probe's unless given."""
    tissue = replace(Tissue(), youngs_modulus_kpa=slab.youngs_modulus_kpa, thickness_mm=slab.thickness_mm)
    return Scene(inclusion, tissue=tissue, waveguide=waveguide or Waveguide())


def scene_on_one_mesh(
    slab: Slab,
    inclusion: Inclusion | None = None,
    thicknesses_mm: Sequence[float] = SLAB_THICKNESSES_MM,
    *,
    waveguide: Waveguide | None = None,
) -> Scene:
    """Return the scene in the layers of a slab that is as thick as the last of the ascending `thicknesses_mm`.

    Those below `slab`, whose thickness is one of them, are as good as rigid: slabs of all these thicknesses have one
    mesh. Pressures near the rim differ by some 5 % of an inclusion's from mesh to mesh, more than the thickness changes
    them.
    """
    depths_mm = (0.0, *thicknesses_mm)
    layers = [
        TissueLayer(f"to_{base:g}_mm", base - top, slab.youngs_modulus_kpa if base <= slab.thickness_mm else RIGID_KPA)
        for top, base in pairwise(depths_mm)
    ]
    bulk_kpa = layers.pop().youngs_modulus_kpa
    tissue = replace(Tissue(), youngs_modulus_kpa=bulk_kpa, thickness_mm=depths_mm[-1], layers=tuple(layers))
    return Scene(inclusion, tissue=tissue, waveguide=waveguide or Waveguide())


SOFT, STIFF = (Slab(youngs_modulus_kpa=modulus) for modulus in SLAB_MODULI_KPA[::2])
THIN, THICK = (Slab(thickness_mm=thickness) for thickness in SLAB_THICKNESSES_MM[::2])
SOLVED = (
    (scene_in, NOMINAL, INCLUSIONS),
    (scene_in, NOMINAL, CHANGES),
    (scene_in, SOFT, CHANGES),
    (scene_in, STIFF, CHANGES),
    (scene_on_one_mesh, NOMINAL, CHANGES),
    (scene_on_one_mesh, THIN, CHANGES),
    (scene_on_one_mesh, THICK, CHANGES),
)
"""The nominal slab, and the star: how each slab is meshed, and on which levels its inclusions are solved. Changes with
the modulus are from the second, those with the thickness from the fifth."""
SceneOf = Callable[[Slab, Inclusion | None], Scene]


def baseline_per_n(scene_of: SceneOf, slab: Slab, levels: Sequence[Level] = BASELINE) -> Array:
    """Return the fields [2, F, R] without an inclusion over the force, at forces that indent alike in every slab."""
    return bare_per_n(scene_of(slab, None), FORCES_N * slab.stiffness_ratio, levels)


def bare_per_n(scene: Scene, forces_n: Array, levels: Sequence[Level] = BASELINE) -> Array:
    """Return the fields [2, F, R] of a scene without an inclusion over ascending forces."""
    return _per_n(ramp(scene, forces_n, levels), forces_n)[0]


def inclusions_per_n_mm3(
    scene_of: SceneOf,
    slab: Slab,
    levels: Sequence[Level],
    size_mm: float,
    depth_mm: float,
    mismatches: Sequence[float] | Array,
) -> Array:
    """Return what an inclusion adds at all mismatches [M, 2, F, R], over force, size cubed and mismatch.

    At forces that indent alike in every slab; one mesh and one baseline serve all mismatches.
    """
    forces_n = FORCES_N * slab.stiffness_ratio
    scenes = [scene_of(slab, Inclusion(size_mm, depth_mm, slab.modulus_kpa(float(one)))) for one in mismatches]
    ramps = _ramps(scenes, forces_n, levels)
    found = [_per_n(of_one, forces_n)[1] / one for of_one, one in zip(ramps, mismatches, strict=True)]
    return np.array(found) / size_mm**3


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
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> SurfaceTable:
    """Solve every point of the table (some eight minutes on two cores); `on_point` hears done and total.

    Of a waveguide, the simulated probe's unless given; raise `InvalidQuantity` for one whose face no table holds.
    """
    waveguide = waveguide or Waveguide()
    require_tabulated(waveguide)
    axes = inclusion_axes(points, SMALLEST_SIZE_MM)
    mismatches = axes.elastic_mismatch
    solved = [(partial(scene_of, waveguide=waveguide), slab, levels) for scene_of, slab, levels in SOLVED]
    places = [(*one, *place) for one, grid in zip(solved, _grids(axes), strict=True) for place in product(*grid[:2])]
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    baseline = Parallel(n_jobs=jobs)(delayed(baseline_per_n)(*one) for *one, _ in solved[1:])
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(inclusions_per_n_mm3)(*place, mismatches) for place in places
    )
    inclusion_field: list[Array] = []
    for done, of_place in enumerate(solving, start=1):
        inclusion_field += list(of_place)
        on_point(done, len(places))
    return assembled(axes, baseline, inclusion_field, radius_mm=waveguide.radius_mm)


def _grids(axes: InclusionAxes) -> list[InclusionAxes]:
    """Return the points of each of `SOLVED`: all of them in the nominal slab, the coarse ones for the star."""
    coarse = InclusionAxes(axes.size_mm[COARSE], axes.depth_mm[COARSE], axes.elastic_mismatch)
    return [axes, *[coarse] * (len(SOLVED) - 1)]


def assembled(
    axes: InclusionAxes, bare_per_n: Sequence[Array], lump_per_n_mm3: Sequence[Array], *, radius_mm: float
) -> SurfaceTable:
    """Return the table of the fields [2, F, R] in the order of `SOLVED`; each grid with the mismatch fastest.

    Those without an inclusion are of the star alone, whose first slab is the nominal one.
    """
    remaining, inclusions = iter(lump_per_n_mm3), []
    for grid in _grids(axes):
        fields_on_grid = np.array([next(remaining) for _ in product(*grid)])
        shape = [len(points) for points in grid]
        inclusions.append(np.moveaxis(fields_on_grid.reshape(*shape, *fields_on_grid.shape[1:]), 3, 0))
    return SurfaceTable(
        *axes,
        slab_modulus_kpa=np.array(SLAB_MODULI_KPA),
        slab_thickness_mm=np.array(SLAB_THICKNESSES_MM),
        force_n=FORCES_N,
        r_mm=np.linspace(0.0, radius_mm, inclusions[0].shape[-1]),
        bare_per_n=bare_per_n[0],
        lump_per_n_mm3=inclusions[0],
        bare_change_per_n=_changes(*bare_per_n),
        lump_change_per_n_mm3=_changes(*inclusions[1:]),
    )


def _changes(nominal: Array, soft: Array, stiff: Array, layered: Array, thin: Array, thick: Array) -> Array:
    return np.stack([soft - nominal, stiff - nominal, thin - layered, thick - layered])


def write_surface_table(table: SurfaceTable, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "finite"})


def solved_for(probe: Probe) -> dict[str, object]:
    """Return what a table of pressed faces says of its origin."""
    scene = Scene(None, Press(force_n=1.0), probe.waveguide)
    return {"scene_defaults": scene.surroundings(), **probe.origin()}
