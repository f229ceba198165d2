"""Builds the virtual probe's table of how far the pressed face moves outwards, from finite-strain force ramps."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
from joblib import Parallel, delayed

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.face_motion import FaceMotion
from device.simulation.physics.inclusion_axes import InclusionAxes
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.forward.face_state import FaceState
from host_tools.forward.plan import Level
from host_tools.forward.solution import Solution
from host_tools.probe_tables.changes_in_slabs import PLACES, SLABS_SOLVED, build_changes_in_slabs
from host_tools.probe_tables.force_ramps import BASELINE, CHANGES, EVERY, FORCES_N, ramp, ramps_of, scene_in
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
from host_tools.scenes.scene import Scene, Waveguide


def outward_mm(solution: Solution) -> tuple[Array, Array]:
    """Return how far points of the face move [R] without the inclusion, and what the inclusion adds."""
    without, pressed = (_outward_mm(state) for state in (solution.baseline, solution.pressed))
    return without, pressed - without


def _outward_mm(face: FaceState) -> Array:
    assert face.outward_mm is not None  # finite strain says it
    return face.outward_mm[0, ::EVERY]


def _added_per_n_mm3(waveguide: Waveguide, size_mm: float, depth_mm: float, mismatch: float) -> Array:
    """Return [F, R] over force, size cubed and mismatch."""
    inclusion = Inclusion(size_mm, depth_mm, NOMINAL.modulus_kpa(mismatch))
    scene = scene_in(NOMINAL, inclusion, waveguide=waveguide)
    added = np.array([outward_mm(solution)[1] for solution in ramp(scene)])
    return np.asarray(added / FORCES_N[:, None] / (size_mm**3 * mismatch))


def build_face_motion(
    *,
    waveguide: Waveguide | None = None,
    points: tuple[int, int, int] = POINTS,
    slab_places: int = PLACES,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> FaceMotion:
    """Solve every point of the table (six minutes on two cores); `on_point` hears done and total.

    Of a waveguide, the simulated probe's unless given; raise `InvalidQuantity` for one whose face no table holds.
    """
    waveguide = waveguide or Waveguide()
    require_tabulated(waveguide)
    fine = inclusion_axes(points, SMALLEST_SIZE_MM)
    axes = InclusionAxes(fine.size_mm[COARSE], fine.depth_mm[COARSE], fine.elastic_mismatch[[0, -1]])
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    without = _baseline_per_n(scene_in(NOMINAL, waveguide=waveguide), FORCES_N, BASELINE)
    places = [tuple(map(float, place)) for place in product(*axes)]
    solving = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(_added_per_n_mm3)(waveguide, *place) for place in places
    )
    added: list[Array] = []
    total = len(places) + SLABS_SOLVED * slab_places
    for done, of_place in enumerate(solving, start=1):
        added.append(of_place)
        on_point(done, total)
    per_n_mm3 = np.array(added).reshape(1, *map(len, axes), *without.shape)
    (slabs,) = build_changes_in_slabs(
        [NominalTable(axes, per_n_mm3, FORCES_N)],
        partial(motion_of_inclusion, waveguide, axes.elastic_mismatch),
        partial(motion_without_inclusion, waveguide),
        places=slab_places,
        jobs=jobs,
        on_point=lambda done: on_point(len(places) + done, total),
    )
    r_mm = np.linspace(0.0, waveguide.radius_mm, without.shape[-1])
    return FaceMotion(*axes, FORCES_N, r_mm, without, per_n_mm3, slabs)


def motion_of_inclusion(
    waveguide: Waveguide, mismatches: Array, one: ScatteredInclusion, slab: Slab, reached: int
) -> Array:
    """Return the way outwards [1, M, 1, F, R] that an inclusion adds in a slab, over force, size cubed and mismatch."""
    forces_n = SLAB_FORCES_N[:reached]
    inclusions = [Inclusion(one.size_mm, one.depth_mm, slab.modulus_kpa(float(mismatch))) for mismatch in mismatches]
    ramps = ramps_of([scene_in(slab, of, waveguide=waveguide) for of in inclusions], forces_n, CHANGES)
    added = np.array([[outward_mm(solution)[1] for solution in of_one] for of_one in ramps])
    over = forces_n[:, None] * mismatches[:, None, None] * one.size_mm**3
    return np.asarray((added / over)[None, :, None])


def motion_without_inclusion(waveguide: Waveguide, slab: Slab) -> Array:
    """Return the way outwards in a slab without an inclusion [1, 1, F, R], over the force."""
    return _baseline_per_n(scene_in(slab, waveguide=waveguide), SLAB_FORCES_N, WITHOUT_INCLUSION)[None, None]


def _baseline_per_n(scene: Scene, forces_n: Array, levels: Sequence[Level]) -> Array:
    return np.array([outward_mm(solution)[0] for solution in ramp(scene, forces_n, levels)]) / forces_n[:, None]


def write_face_motion(table: FaceMotion, folder: Path, probe: Probe | None = None) -> None:
    """Write the table with the surroundings and the probe that it was solved for."""
    table.save(folder, {**solved_for(probe or simulated_probe()), "strain": "finite"})
