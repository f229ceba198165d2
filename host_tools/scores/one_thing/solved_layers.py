"""Tissue in layers that no table knows, solved anew: what they change of a press.

It is the difference of two finite-element solutions of one scene, with the layers and with even tissue in their place.
The error of the mesh is in both and drops out, and nothing that a model knows has told the layers. On the axis that is
at finite strain; off it in three dimensions at small strain, and it changes with the force as on the axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.off_axis_table import OffAxisTable
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.slab_changes import resampling
from device.simulation.physics.surface_table import PressRamps
from host_tools.probe_tables.aside_changes import OFF_THE_RIM, AsidePlace
from host_tools.probe_tables.force_ramps import CHANGES, TissueStack, bare_per_n, first_that_can, per_n, ramp
from host_tools.probe_tables.slab_changes import SLAB_FORCES_N
from host_tools.scenes.scene import Placement

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


@dataclass(frozen=True)
class AsideInLayers(OffAxisTable):
    """A table whose inclusion is in layers that change its modes [2, K, R] where it is pressed, `at_mm` aside."""

    at_mm: float
    changed_per_n: Array

    def modes(self, inclusion: Inclusion, offset_mm: float, slab: Slab = NOMINAL) -> Array:
        """Return the modes [2, K, R] for 1 N of the inclusion, at other places those of the table."""
        is_there = abs(offset_mm - self.at_mm) < 1e-6
        return super().modes(inclusion, offset_mm, slab) + (self.changed_per_n if is_there else 0.0)


def aside_in_layers(
    table: OffAxisTable, slab: Slab, inclusion: Inclusion, offset_mm: float, stacks: Sequence[TissueStack]
) -> list[OffAxisTable]:
    """Return the table of an inclusion so far off the axis on each of the stacks, of layers as thick."""
    scenes = [
        replace(stack.scene(slab, inclusion), placement=Placement(offset_x_mm=offset_mm))
        for stack in (stacks[0].evened(), *stacks)
    ]
    place = AsidePlace(scenes[0])
    even = place.modes_per_n(scenes[:1])[0]

    def changed(number: int) -> OffAxisTable:
        if stacks[number].is_even:
            return table
        changed_per_n = place.modes_per_n([scenes[1 + number]])[0] - even
        return AsideInLayers(**vars(table), at_mm=offset_mm, changed_per_n=_as_off_the_rim(changed_per_n, even))

    return [changed(number) for number in range(len(stacks))]


def _as_off_the_rim(changed: Array, modes: Array) -> Array:
    """Return what changes modes [2, K, R], at the rim as much of them as off it: there solutions are singular."""
    off, of_changes = modes[..., OFF_THE_RIM], changed[..., OFF_THE_RIM]
    squares = np.sum(off**2, axis=-1, keepdims=True)
    part = np.divide(
        np.sum(of_changes * off, axis=-1, keepdims=True), squares, np.zeros_like(squares), where=squares > 0
    )
    at_rim = slice(OFF_THE_RIM.stop, None)
    found = np.array(changed)
    found[..., at_rim] = part * modes[..., at_rim]
    return found
