"""Tissue in layers that no table knows, solved anew: what they change of a press.

It is the difference of two finite-element solutions of one scene, with the layers and with even tissue in their place.
The error of the mesh is in both and drops out, and nothing that a model knows has told the layers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.slab import Slab
from device.simulation.physics.slab_changes import resampling
from device.simulation.physics.surface_table import PressRamps
from host_tools.probe_tables.force_ramps import CHANGES, TissueStack, bare_per_n, first_that_can, per_n, ramp
from host_tools.probe_tables.slab_changes import SLAB_FORCES_N

REACHES = SLAB_FORCES_N, SLAB_FORCES_N[:-1]
"""Forces that are solved; soft tissue does not bear the last."""


def in_layers(
    as_tabled: PressRamps, slab: Slab, inclusion: Inclusion | None, stacks: Sequence[TissueStack]
) -> list[PressRamps]:
    """Return how the face deforms on each of the stacks, of layers as thick: as tabled, and what two solutions differ.

    Without an inclusion what one adds stays as tabled. Raises `PressFailed` where the forces cannot be reached.
    """
    return first_that_can(lambda forces_n: _in_layers(as_tabled, slab, inclusion, stacks, forces_n), REACHES)


def _in_layers(
    as_tabled: PressRamps, slab: Slab, inclusion: Inclusion | None, stacks: Sequence[TissueStack], forces_n: Array
) -> list[PressRamps]:
    baseline, field = as_tabled.baseline, as_tabled.inclusion_field
    to_table = resampling(forces_n, baseline.force_n)

    def solved(stack: TissueStack) -> Array:
        """Return the fields [2, 2, F, R] of the face without the inclusion, and what that adds."""
        without = bare_per_n(stack.scene(slab), forces_n, CHANGES)
        if inclusion is None:
            return np.array([without, np.zeros_like(without)])
        return np.array([without, per_n(ramp(stack.scene(slab, inclusion), forces_n, CHANGES), forces_n)[1]])

    def changed(fields: Array) -> PressRamps:
        of_baseline, added = np.einsum("gf,kxfr->kxgr", to_table, fields - even)
        return as_tabled._replace(
            baseline=replace(baseline, fields_per_n=baseline.fields_per_n + of_baseline),
            inclusion_field=replace(field, fields_per_n=field.fields_per_n + added),
        )

    even = solved(stacks[0].evened())
    return [as_tabled if stack.is_even else changed(solved(stack)) for stack in stacks]
