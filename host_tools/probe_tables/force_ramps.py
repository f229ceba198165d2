"""Force ramps of one scene in finite strain, as the tables of the pressed face keep them: over the force, in rings.

What a scene's own solve gives where no table holds it, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple, TypeVar

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.chebyshev import points_inside
from device.simulation.physics.slab import Slab
from device.simulation.physics.surface_table import PressRamps, Ramp
from host_tools.forward.plan import Level, model_plan
from host_tools.forward.press_model import PressFailed
from host_tools.forward.solution import Solution
from host_tools.forward.solve import solve_ramps
from host_tools.scenes.scene import Press, Scene, Tissue, TissueLayer, Waveguide

RIGID_KPA = 1e6
"""Modulus of what stands in for the base."""
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
    return ramps_of([scene], forces_n, levels)[0]


def ramps_of(
    scenes: Sequence[Scene], forces_n: Array = FORCES_N, levels: Sequence[Level] = INCLUSIONS
) -> tuple[tuple[Solution, ...], ...]:
    """Return the ramps of scenes that differ in the modulus of the inclusion alone, on the first level that can."""
    presses = [Press(force_n=float(force)) for force in forces_n]
    plan = model_plan(scenes[0].with_press(presses[-1]), strain="finite")

    def on(level: Level) -> tuple[tuple[Solution, ...], ...]:
        return solve_ramps(scenes, presses, replace(plan, grading=level.grading, order=level.order))

    return first_that_can(on, levels)


Attempt = TypeVar("Attempt")
Followed = TypeVar("Followed")


def first_that_can(solve: Callable[[Attempt], Followed], choices: Sequence[Attempt]) -> Followed:
    """Return what is solved with the first choice that the press can be followed with; raise the last one's failure."""
    for choice in choices[:-1]:
        with suppress(PressFailed):
            return solve(choice)
    return solve(choices[-1])


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


def per_n(solutions: Sequence[Solution], forces_n: Array = FORCES_N) -> tuple[Array, Array]:
    """Return both kinds of fields of a ramp over the force, each [2, F, R]."""
    baseline, inclusion_field = zip(*(fields(solution) for solution in solutions), strict=True)
    over = forces_n[None, :, None]
    return np.stack(baseline, axis=1) / over, np.stack(inclusion_field, axis=1) / over


def press_ramps(
    scene: Scene,
    largest_n: float = LARGEST_N,
    levels: Sequence[Level] = INCLUSIONS,
    baseline_levels: Sequence[Level] = BASELINE,
) -> PressRamps:
    """Return the ramps of one scene up to a force, solved for it alone: for what the table does not hold.

    That without the inclusion is on the level of the table's: on the mesh of an inclusion the light beside it would
    tell another tissue, by half a kPa.
    """
    inclusion_field = inclusion_ramp(scene, largest_n, levels)
    baseline = bare_per_n(replace(scene, inclusion=None), inclusion_field.force_n, baseline_levels)
    r_mm = np.linspace(0.0, scene.waveguide.radius_mm, baseline.shape[-1])
    return PressRamps(r_mm, Ramp(inclusion_field.force_n, baseline), inclusion_field)


def inclusion_ramp(scene: Scene, largest_n: float = LARGEST_N, levels: Sequence[Level] = INCLUSIONS) -> Ramp:
    """Return what the inclusion of one scene adds up to a force, solved for it alone."""
    forces_n = points_inside(0.0, largest_n, len(FORCES_N))
    return Ramp(forces_n, per_n(ramp(scene, forces_n, levels), forces_n)[1])


def scene_in(slab: Slab, inclusion: Inclusion | None = None, *, waveguide: Waveguide | None = None) -> Scene:
    """Return the default scene in another slab, pressed by a waveguide: the simulated probe's unless given."""
    tissue = replace(Tissue(), youngs_modulus_kpa=slab.youngs_modulus_kpa, thickness_mm=slab.thickness_mm)
    return Scene(inclusion, tissue=tissue, waveguide=waveguide or Waveguide())


class TissueStack(NamedTuple):
    """Layers from the surface down: their thicknesses (mm), and moduli over the slab's, that of the bulk last."""

    thickness_mm: tuple[float, ...]
    modulus_ratio: tuple[float, ...]

    @property
    def is_even(self) -> bool:
        """Whether all layers are as the slab."""
        return all(ratio == 1.0 for ratio in self.modulus_ratio)

    def evened(self) -> TissueStack:
        """Return the same layers of even tissue, which have the same mesh."""
        return self._replace(modulus_ratio=(1.0,) * len(self.modulus_ratio))

    def scene(self, slab: Slab, inclusion: Inclusion | None = None, *, waveguide: Waveguide | None = None) -> Scene:
        """Return the scene of a slab in these layers, pressed by a waveguide: the simulated probe's unless given."""
        scene, (*ratios, of_bulk) = scene_in(slab, inclusion, waveguide=waveguide), self.modulus_ratio
        layers = tuple(
            TissueLayer(f"layer_{number}", thickness_mm, slab.youngs_modulus_kpa * ratio)
            for number, (thickness_mm, ratio) in enumerate(zip(self.thickness_mm, ratios, strict=True))
        )
        bulk_kpa = slab.youngs_modulus_kpa * of_bulk
        return replace(scene, tissue=replace(scene.tissue, youngs_modulus_kpa=bulk_kpa, layers=layers))


def scene_on_one_mesh(
    slab: Slab | Tissue,
    inclusion: Inclusion | None,
    thicknesses_mm: Sequence[float],
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


SceneOf = Callable[[Slab, Inclusion | None], Scene]
"""A scene of an inclusion, or of none, in a slab."""


def bare_per_n(scene: Scene, forces_n: Array, levels: Sequence[Level] = BASELINE) -> Array:
    """Return the fields [2, F, R] of a scene without an inclusion over ascending forces."""
    return per_n(ramp(scene, forces_n, levels), forces_n)[0]


def inclusions_per_n_mm3(
    scene_of: SceneOf,
    slab: Slab,
    levels: Sequence[Level],
    size_mm: float,
    depth_mm: float,
    mismatches: Sequence[float] | Array,
    forces_n: Array = FORCES_N,
) -> Array:
    """Return what an inclusion adds at all mismatches [M, 2, F, R], over force, size cubed and mismatch.

    One mesh and one baseline serve all mismatches. Raises `PressFailed` where a force cannot be reached.
    """
    scenes = [scene_of(slab, Inclusion(size_mm, depth_mm, slab.modulus_kpa(float(one)))) for one in mismatches]
    ramps = ramps_of(scenes, forces_n, levels)
    found = [per_n(of_one, forces_n)[1] / one for of_one, one in zip(ramps, mismatches, strict=True)]
    return np.array(found) / size_mm**3
