"""The deformed face z = thickness - w(x, y): its height, its slope, and where a ray meets it.

The face is bilinear between the grid points (facets, not a smooth surface: 0.15 mm spacing keeps their kinks below
what the camera resolves); beyond the grid it goes on flat. A ray advances by steps that the steepest slope makes safe
(sphere tracing: Hart, The Visual Computer 12, 527 (1996)) and ends by false position.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from host_tools.optics.compiled import compiled

NO_HIT = 1e30
NEAR_MM = 1e-7
"""Gap below which a ray is on the face."""
MOST_STEPS = 60


class HeightField(NamedTuple):
    """Grid of `w` [ny, nx] from (x0, y0) in steps of dx, dy (mm), whose inverses are per_dx, per_dy.

    With the block's thickness, the extremes of w (mm) and its steepest slope.
    """

    w: NDArray[np.float64]
    x0: float
    y0: float
    dx: float
    dy: float
    per_dx: float
    per_dy: float
    thickness: float
    highest_w: float
    lowest_w: float
    steepest: float


@compiled
def _cell(at: float, start: float, per_step: float, count: int) -> tuple[int, float]:
    """Return the grid interval of a coordinate and the place 0..1 in it, clamped to the grid."""
    place = (at - start) * per_step
    if place <= 0.0:
        return 0, 0.0
    if place >= count - 1:
        return count - 2, 1.0
    index = int(place)
    return index, place - index


@compiled
def bilinear(grid: NDArray[np.float64], field: HeightField, x: float, y: float) -> float:
    """Return the value of a grid laid out like the field at a point (mm)."""
    i, u = _cell(x, field.x0, field.per_dx, grid.shape[1])
    j, v = _cell(y, field.y0, field.per_dy, grid.shape[0])
    low: float = grid[j, i] + u * (grid[j, i + 1] - grid[j, i])
    high: float = grid[j + 1, i] + u * (grid[j + 1, i + 1] - grid[j + 1, i])
    return low + v * (high - low)


@compiled
def slope(field: HeightField, x: float, y: float) -> tuple[float, float]:
    """Return (dw/dx, dw/dy) of the facet at a point; the outward normal is (dw/dx, dw/dy, 1), not normalised."""
    w = field.w
    i, u = _cell(x, field.x0, field.per_dx, w.shape[1])
    j, v = _cell(y, field.y0, field.per_dy, w.shape[0])
    in_x = (1 - v) * (w[j, i + 1] - w[j, i]) + v * (w[j + 1, i + 1] - w[j + 1, i])
    in_y = (1 - u) * (w[j + 1, i] - w[j, i]) + u * (w[j + 1, i + 1] - w[j, i + 1])
    last_x, last_y = field.x0 + field.dx * (w.shape[1] - 1), field.y0 + field.dy * (w.shape[0] - 1)
    in_x = in_x / field.dx if field.x0 < x < last_x else 0.0
    in_y = in_y / field.dy if field.y0 < y < last_y else 0.0
    return in_x, in_y


@compiled
def _gap(field: HeightField, x: float, y: float, z: float, dx: float, dy: float, dz: float, t: float) -> float:
    """Return how far (mm) the ray at distance t is below the face."""
    return field.thickness - bilinear(field.w, field, x + t * dx, y + t * dy) - (z + t * dz)


@compiled
def distance_to_face(
    field: HeightField, x: float, y: float, z: float, dx: float, dy: float, dz: float, furthest: float
) -> float:
    """Return how far (mm) a ray from inside the block travels to the face, or NO_HIT within `furthest`."""
    low, high = field.thickness - field.highest_w, field.thickness - field.lowest_w
    if dz <= 0.0 and z <= low:
        return NO_HIT
    if high - low < 1e-9:
        t = (low - z) / dz if dz > 0.0 else NO_HIT
        return max(t, 0.0) if t < furthest else NO_HIT
    t = max((low - z) / dz, 0.0) if dz > 0.0 else 0.0
    last = min(furthest, (high - z) / dz if dz > 0.0 else (low - z) / dz if dz < 0.0 else furthest) + 1e-9
    closing = dz + field.steepest * math.sqrt(dx * dx + dy * dy)
    if closing <= 0.0:
        return NO_HIT
    smallest = 0.25 * min(field.dx, field.dy)
    before = t
    while t < last:
        gap = _gap(field, x, y, z, dx, dy, dz, t)
        if gap < 0.0:
            return _closing_in(field, x, y, z, dx, dy, dz, before, t) if t > before else t
        before = t
        t = min(t + max(gap / closing, smallest), last + 1e-6)
    gap = _gap(field, x, y, z, dx, dy, dz, last)
    return _closing_in(field, x, y, z, dx, dy, dz, before, last) if gap < 0.0 and last < furthest else NO_HIT


@compiled
def _closing_in(
    field: HeightField,
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    dz: float,
    inside: float,
    outside: float,
) -> float:
    """Return the distance where the ray leaves the block, between one inside and one outside; stays inside.

    False position with halving of the end that stays (Illinois): Dowell & Jarratt, BIT 11, 168 (1971).
    """
    gap_in = _gap(field, x, y, z, dx, dy, dz, inside)
    gap_out = _gap(field, x, y, z, dx, dy, dz, outside)
    true_in, last = gap_in, 0
    for _ in range(MOST_STEPS):
        if true_in < NEAR_MM or gap_in <= 0.0:
            break
        t = inside + (outside - inside) * gap_in / (gap_in - gap_out)
        gap = _gap(field, x, y, z, dx, dy, dz, t)
        if gap < 0.0:
            outside, gap_out = t, gap
            gap_in = 0.5 * gap_in if last == -1 else gap_in
            last = -1
        else:
            inside, gap_in, true_in = t, gap, gap
            gap_out = 0.5 * gap_out if last == 1 else gap_out
            last = 1
    return inside
