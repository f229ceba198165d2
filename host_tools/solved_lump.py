"""One lump solved in three dimensions to a table of itself: what the virtual probe's tables of spheres do not hold.

Oblong lumps are pressed with it. Small strain; with force and slab the field grows as that of the sphere that the press
is told of, as for every lump off the axis. The lump lies under the middle of the probe, or is not there at all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from device.measurement.quantities import Inclusion
from device.simulation.chebyshev import Array
from device.simulation.off_axis_table import OffAxisTable
from host_tools.forward.materials import baseline, with_inclusion
from host_tools.forward.plan import model_plan
from host_tools.forward.tiers import build
from host_tools.off_axis_table import face_modes
from host_tools.scene import Press, Scene

UNDER_THE_PROBE_MM = 5.0
"""Pressed farther beside the lump than this, nothing of it shows."""


@dataclass(frozen=True)
class SolvedLump(OffAxisTable):
    """A table of one lump: `modes_per_n` [2, K, R] of deformation and pressure, whatever inclusion is asked for."""

    modes_per_n: Array

    def centred_share(self, offset_mm: float) -> float:
        """Return 0: nothing of a sphere's field is this lump's."""
        return 0.0

    def modes(self, inclusion: Inclusion, offset_mm: float) -> Array:
        """Return the modes [2, K, R] for 1 N of the lump under the probe, or zeros beside it."""
        return self.modes_per_n if offset_mm < UNDER_THE_PROBE_MM else np.zeros_like(self.modes_per_n)


def solved_lump(scene: Scene, table: OffAxisTable) -> SolvedLump:
    """Return the table of a scene's lump, on the radii and with the tilt of the probe's own table."""
    pressed = scene.with_press(Press(force_n=1.0))
    meshed = build(pressed, replace(model_plan(pressed), grading="coarse"))
    bare, lump = (
        meshed.model.press(materials, [pressed.press], estimate_error=False)[0].state
        for materials in (baseline(pressed), with_inclusion(pressed))
    )
    own = {name: getattr(table, name) for name in OffAxisTable.__dataclass_fields__}
    return SolvedLump(**own, modes_per_n=face_modes(meshed.rays.r_mm[0], lump, bare))
