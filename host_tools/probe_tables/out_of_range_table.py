"""Faces under inclusions around the trained ranges: what the range classifier learns from.

Larger, shallower and deeper inclusions than the virtual probe's tables hold, in the nominal slab, as far down as the
slab reaches. They carry the probe's own tables on: at the nearest inclusion that these hold both agree, and what
another slab changes is what it changes there. Good for telling inclusions apart (docs/modes.md), not for making
pictures of them.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from device.files.table_file import load_table, save_table
from device.measurement.arrays import Array
from device.measurement.parameters import ABOVE_BASE_MM, ELASTIC_MISMATCHES
from device.measurement.quantities import Bound, Inclusion, InvalidQuantity, require
from device.measurement.ramp_modes.surrogate import far_field_strength
from device.simulation.physics.chebyshev import interpolated, points_with_ends
from device.simulation.physics.inclusion_axes import ACTION as CHOOSE
from device.simulation.physics.off_axis_table import OffAxisTable
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.surface_table import Ramp, SurfaceTable
from device.simulation.virtual_probe import ProbeTables
from host_tools.probe_tables.aside_changes import OFFSETS_MM
from host_tools.probe_tables.force_ramps import INCLUSIONS, scene_in
from host_tools.probe_tables.force_ramps import inclusions_per_n_mm3 as centred_per_n_mm3
from host_tools.probe_tables.off_axis_table import inclusions_per_n_mm3
from host_tools.scenes.scene import Press, Scene

NAME, SCHEMA = "wide_table", "tsis.wide_table/1"
ACTION = "run `host_tools table --part wide` to make it again"
SIZES_MM, SHALLOWEST_MM = (1.2, 18.0), 3.0
POINTS, ASIDE_POINTS = (8, 9, 3), (6, 6, 2)
"""Points in size, depth and mismatch, on the axis and beside it."""
SMALLEST_ASIDE_MM = 1.8
ROUNDING_MM = 1e-9
"""Room that is left above the base, so that a sum of depth and size does not round through it."""
ASIDE_MM = OFFSETS_MM[0]
"""The first offset of the probe's own table: nearer the axis an inclusion's field fades into the centred one's."""
DEEPEST_MM, BEND_MM, BENT_OVER_MM = 17.9, 11.5, 1 / 0.7


class WideAxes(NamedTuple):
    """Ascending points in size, in the share of the way from shallowest to deepest, and in mismatch."""

    size_mm: Array
    depth_share: Array
    elastic_mismatch: Array

    def inclusion_per_n(self, fields: Array, inclusion: Inclusion, slab: Slab) -> Array:
        """Return an inclusion's field per newton from fields [2, S, D, M, ...] over force, strength and mismatch.

        Raises `InvalidQuantity` for a size or depth outside the wide ranges.
        """
        size_mm, depth_mm, modulus_kpa = inclusion.as_tuple()
        require("size_mm", size_mm, Bound(0.0, SIZES_MM[1], "mm"), CHOOSE)
        require("depth_mm", depth_mm, Bound(SHALLOWEST_MM, deepest_mm(size_mm), "mm"), CHOOSE)
        share = (depth_mm - SHALLOWEST_MM) / (deepest_mm(size_mm) - SHALLOWEST_MM)
        mismatch = slab.elastic_mismatch(modulus_kpa)
        place = max(size_mm, float(self.size_mm[0])), share, mismatch
        return far_field_strength(size_mm, depth_mm) * mismatch * interpolated(fields, self, place)

    def carried_on(self, own: Array, fields: Array, inclusion: Inclusion, near: Inclusion, slab: Slab) -> Array:
        """Return an inclusion's field per newton, where `own` is that of `near`, the nearest inclusion inside.

        The ratio of both is that of their strengths far away. What the wide fields miss at `near` is taken off: an
        inclusion inside has the probe's own field, and nothing jumps.
        """
        ratio = far_field_strength(inclusion.size_mm, inclusion.depth_mm) / far_field_strength(
            near.size_mm, near.depth_mm
        )
        beyond, at_end = (self.inclusion_per_n(fields, one, slab) for one in (inclusion, near))
        return ratio * own + (beyond - ratio * at_end)


def deepest_mm(size_mm: float) -> float:
    """Return how deep an inclusion may lie: 17.9 mm, or where it all but touches the nominal slab's base; smooth."""
    return float(DEEPEST_MM - BENT_OVER_MM * np.log1p(np.exp((size_mm - BEND_MM) / BENT_OVER_MM)))


@dataclass(frozen=True)
class WideSurfaceTable(SurfaceTable):
    """The probe's own table, carried on by `wide` [2, S, D, M, F, R] over `wide_axes`."""

    wide_axes: WideAxes
    wide: Array

    def inclusion_field(self, inclusion: Inclusion, slab: Slab = NOMINAL) -> Ramp:
        """Return what an inclusion adds to the ramp; refuses what is not among the wide ones, or not above the base."""
        near = nearest(inclusion, self, slab)
        own = super().inclusion_field(near, slab)
        fields_per_n = self.wide_axes.carried_on(own.fields_per_n, self.wide, inclusion, near, slab)
        slab.require_held(inclusion)  # last: what no slab holds is refused for its own size or depth
        return replace(own, fields_per_n=fields_per_n)


@dataclass(frozen=True)
class WideOffAxisTable(OffAxisTable):
    """The probe's own table, carried on by `wide` [2, S, D, M, K, R]: inclusions `ASIDE_MM` beside the axis."""

    wide_axes: WideAxes
    wide: Array

    def _modes(self, inclusion: Inclusion, offset_mm: float, slab: Slab) -> Array:
        require("offset_mm", offset_mm, Bound(0.0, ASIDE_MM, "mm"), "press nearer to the inclusion")
        near = nearest(inclusion, self, slab)
        own = super()._modes(near, offset_mm, slab)
        return self.wide_axes.carried_on(own, self.wide, inclusion, near, slab)


def nearest(inclusion: Inclusion, table: SurfaceTable | OffAxisTable, slab: Slab) -> Inclusion:
    """Return the inclusion of the probe's own table that is nearest in size and depth, and lies above the base."""
    size_mm, depth_mm = (
        float(np.clip(value, ends[0], ends[-1]))
        for value, ends in ((inclusion.size_mm, table.size_mm), (inclusion.depth_mm, table.depth_mm))
    )
    if depth_mm > inclusion.depth_mm:
        size_mm = min(size_mm, slab.thickness_mm - ABOVE_BASE_MM - ROUNDING_MM - depth_mm)
    return replace(inclusion, size_mm=size_mm, depth_mm=depth_mm)


@dataclass(frozen=True)
class WideTable:
    """`centred` [2, S, D, M, F, R] and `aside` [2, S', D', M', K, R'] over force, strength and mismatch; w, then p."""

    centred: Array
    aside: Array

    def around(self, tables: ProbeTables) -> ProbeTables:
        """Return the probe's tables, carried on around the trained ranges."""
        centred = {name: getattr(tables.centred, name) for name in SurfaceTable.__dataclass_fields__}
        aside = {name: getattr(tables.off_axis, name) for name in OffAxisTable.__dataclass_fields__}
        return replace(
            tables,
            centred=WideSurfaceTable(**centred, wide_axes=axes(POINTS, SIZES_MM[0]), wide=self.centred),
            off_axis=WideOffAxisTable(**aside, wide_axes=axes(ASIDE_POINTS, SMALLEST_ASIDE_MM), wide=self.aside),
        )

    def save(self, folder: Path) -> None:
        """Write wide_table.npz and its description with the hash."""
        arrays = {name: getattr(self, name).astype(np.float32) for name in ARRAYS}
        save_table(folder, NAME, arrays, {"schema": SCHEMA, "command": "host_tools table --part wide", **made_for()})


ARRAYS = tuple(WideTable.__dataclass_fields__)


def made_for() -> dict[str, Any]:
    """Return for which inclusions and surroundings a table is made: one for others is refused."""
    inclusions = [
        [*place, depth_at(*place[:2]), mismatch]
        for points, smallest_mm in ((POINTS, SIZES_MM[0]), (ASIDE_POINTS, SMALLEST_ASIDE_MM))
        for *place, mismatch in product(*(map(float, one) for one in axes(points, smallest_mm)))
    ]
    return {
        "inclusions_sha256": hashlib.sha256(np.round(inclusions, 6).tobytes()).hexdigest(),
        "aside_mm": ASIDE_MM,
        "scene_defaults": Scene(None, Press(force_n=1.0)).surroundings(),
        "strain": "finite, small beside",
    }


def load_wide_table(folder: Path) -> WideTable:
    """Read a table; raise `InvalidQuantity` when it is missing, not what it says, or made for others."""
    arrays, record = load_table(folder, NAME, SCHEMA, ARRAYS, ACTION)
    for name, wanted in json.loads(json.dumps(made_for())).items():
        if record.get(name) != wanted:
            raise InvalidQuantity(f"wide table's {name}", record.get(name), str(wanted), ACTION)
    return WideTable(**{name: values.astype(np.float64) for name, values in arrays.items()})


def axes(points: tuple[int, int, int], smallest_size_mm: float) -> WideAxes:
    """Return Chebyshev points over the wide sizes and depths and over the mismatches of the probe's own table."""
    return WideAxes(
        points_with_ends(smallest_size_mm, SIZES_MM[1], points[0]),
        points_with_ends(0.0, 1.0, points[1]),
        points_with_ends(*ELASTIC_MISMATCHES, points[2]),
    )


def build_wide_table(
    *,
    points: tuple[int, int, int] = POINTS,
    aside_points: tuple[int, int, int] = ASIDE_POINTS,
    jobs: int = -1,
    on_point: Callable[[int, int], None] = lambda done, n: None,
) -> WideTable:
    """Solve every point of the table (some sixteen minutes of one core); `on_point` hears done and total."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    centred, aside = axes(points, SIZES_MM[0]), axes(aside_points, SMALLEST_ASIDE_MM)
    work = [delayed(_centred)(*place, centred.elastic_mismatch) for place in product(*centred[:2])]
    work += [delayed(_aside)(*place, aside.elastic_mismatch) for place in product(*aside[:2])]
    fields = []
    for field in Parallel(n_jobs=jobs, return_as="generator")(work):
        fields.append(field)
        on_point(len(fields), len(work))
    places = int(np.prod(points[:2]))
    first, second = np.array(fields[:places]), np.array(fields[places:])
    return WideTable(
        np.moveaxis(first.reshape(*points, *first.shape[2:]), 3, 0),
        np.moveaxis(second.reshape(*aside_points, *second.shape[2:]), 3, 0),
    )


def _centred(size_mm: float, share: float, mismatches: Array) -> Array:
    """Return what an inclusion adds at all mismatches [M, 2, F, R] over force, strength and mismatch."""
    place = float(size_mm), depth_at(size_mm, share)
    return centred_per_n_mm3(scene_in, NOMINAL, INCLUSIONS, *place, mismatches) * _volume_over_strength(*place)


def _aside(size_mm: float, share: float, mismatches: Array) -> Array:
    """Return the modes [M, 2, K, R] of inclusions `ASIDE_MM` beside the axis, over strength and mismatch."""
    place = float(size_mm), depth_at(size_mm, share)
    return inclusions_per_n_mm3(*place, ASIDE_MM, mismatches) * _volume_over_strength(*place)


def depth_at(size_mm: float, share: float) -> float:
    """Return the depth at a share of the way from the shallowest to the deepest inclusion."""
    return SHALLOWEST_MM + float(share) * (deepest_mm(size_mm) - SHALLOWEST_MM)


def _volume_over_strength(size_mm: float, depth_mm: float) -> float:
    return size_mm**3 / far_field_strength(size_mm, depth_mm)
