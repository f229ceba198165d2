"""An ellipsoid for the virtual probe: one inclusion solved in three dimensions, and what being longer adds to a sphere.

The virtual probe's tables hold spheres alone, so an oblong inclusion gets a table of itself. It lies under the middle
of the probe, or is not there at all.

Ellipsoid and sphere of its width are solved in three dimensions in the same way, and their difference is carried on to
the probe's table: so an inclusion that is hardly longer is hardly another one, and what the table's own spheres are off
is in both. Small strain in the nominal slab; with force and slab the difference grows as the sphere does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.off_axis_table import OffAxisTable
from device.simulation.physics.slab import NOMINAL, Slab
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.tiers import build
from host_tools.probe_tables.cosine_modes import face_modes
from host_tools.scenes.scene import Press, Scene

UNDER_THE_PROBE_MM = 5.0
"""Pressed farther beside the inclusion than this, nothing of it shows."""


@dataclass(frozen=True)
class SolvedInclusion(OffAxisTable):
    """A table of one inclusion, whichever is asked for: `modes_per_n` [2, K, R] of deformation and pressure."""

    modes_per_n: Array

    def centred_share(self, offset_mm: float) -> float:
        """Return 0: nothing of a sphere's field is this inclusion's."""
        return 0.0

    def modes(self, inclusion: Inclusion, offset_mm: float, slab: Slab = NOMINAL) -> Array:
        """Return the modes [2, K, R] for 1 N of the inclusion under the probe, or zeros beside it.

        They are those of the scene's own tissue, whatever slab is asked for.
        """
        return self.modes_per_n if offset_mm < UNDER_THE_PROBE_MM else np.zeros_like(self.modes_per_n)


def solved_inclusion(scene: Scene, table: OffAxisTable) -> SolvedInclusion:
    """Return the table of a scene's inclusion, on the radii and with the tilt of the probe's own table."""
    pressed = scene.with_press(Press(force_n=1.0))
    meshed = build(pressed, replace(model_plan(pressed), grading="coarse"))
    inclusion_free, inclusion_field = (
        meshed.model.press(materials, [pressed.press], estimate_error=False)[0].state
        for materials in (baseline(pressed), with_inclusion(pressed))
    )
    own = {name: getattr(table, name) for name in OffAxisTable.__dataclass_fields__}
    return SolvedInclusion(**own, modes_per_n=face_modes(meshed.rays.r_mm[0], inclusion_field, inclusion_free))


@dataclass(frozen=True)
class StretchedInclusion(OffAxisTable):
    """The probe's table with `stretch_per_n` [2, K, R]: what an ellipsoid adds to the sphere under the probe, for 1 N.

    It is that of one ellipsoid at one offset: press the probe just there, and not on the axis itself, where no table of
    inclusions aside is asked.
    """

    stretch_per_n: Array

    def modes(self, inclusion: Inclusion, offset_mm: float, slab: Slab = NOMINAL) -> Array:
        """Return the modes [2, K, R] for 1 N of the ellipsoid under the probe, or of the sphere far beside it."""
        sphere = super().modes(inclusion, offset_mm, slab)
        if offset_mm >= UNDER_THE_PROBE_MM:
            return sphere
        growth = self.growth_with(slab, inclusion, offset_mm)
        return np.asarray(sphere + growth[:, None, None] * self.stretch_per_n)


def stretched_inclusion(scene: Scene, table: OffAxisTable) -> StretchedInclusion:
    """Return the probe's table with the ellipsoid of a scene, off the axis along x; two solves."""
    round_place = replace(scene.placement, width_ratio_x=1.0, width_ratio_y=1.0)
    ellipsoid, sphere = (solved_inclusion(one, table) for one in (scene, replace(scene, placement=round_place)))
    own = {name: getattr(table, name) for name in OffAxisTable.__dataclass_fields__}
    return StretchedInclusion(**own, stretch_per_n=ellipsoid.modes_per_n - sphere.modes_per_n)
