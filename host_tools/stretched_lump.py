"""An ellipsoid for the virtual probe: the probe's own sphere of its width, and what being longer adds to that.

Ellipsoid and sphere are solved in three dimensions in the same way, and their difference is carried on to the probe's
table: so a lump that is hardly longer is hardly another one, and what the table's own spheres are off is in both. Small
strain; with force and slab the difference grows as the sphere does.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from device.measurement.quantities import Inclusion
from device.simulation.chebyshev import Array
from device.simulation.off_axis_table import OffAxisTable
from host_tools.scene import Scene
from host_tools.solved_lump import UNDER_THE_PROBE_MM, solved_lump


@dataclass(frozen=True)
class StretchedLump(OffAxisTable):
    """The probe's table with `stretch_per_n` [2, K, R]: what an ellipsoid adds to the sphere under the probe, for 1 N.

    It is that of one ellipsoid at one offset: press the probe just there, and not on the axis itself, where no table of
    lumps aside is asked.
    """

    stretch_per_n: Array

    def modes(self, inclusion: Inclusion, offset_mm: float) -> Array:
        """Return the modes [2, K, R] for 1 N of the ellipsoid under the probe, or of the sphere far beside it."""
        sphere = super().modes(inclusion, offset_mm)
        return sphere + self.stretch_per_n if offset_mm < UNDER_THE_PROBE_MM else sphere


def stretched_lump(scene: Scene, table: OffAxisTable) -> StretchedLump:
    """Return the probe's table with the ellipsoid of a scene, off the axis along x; two solves."""
    round_place = replace(scene.placement, width_ratio_x=1.0, width_ratio_y=1.0)
    ellipsoid, sphere = (solved_lump(one, table) for one in (scene, replace(scene, placement=round_place)))
    own = {name: getattr(table, name) for name in OffAxisTable.__dataclass_fields__}
    return StretchedLump(**own, stretch_per_n=ellipsoid.modes_per_n - sphere.modes_per_n)
