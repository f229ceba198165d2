"""Curvilinear blocks of points to one mesh of eight-node quadrilaterals.

A block is a grid of twice as many points as elements, since middles of sides are points too: they lie on the block's
own curves (the arcs of a sphere), not half way between corners. Source: Coons, MIT MAC-TR-41, 1967, for the filling.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array

Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class QuadSection:
    """Points (n, 2) as (r, z) in mm; quadrilaterals (m, 8), four corners counter-clockwise, then the sides' middles."""

    points_mm: Array
    quadrilaterals: Indices
    materials: tuple[str, ...]

    def __add__(self, other: QuadSection) -> QuadSection:
        """Return both sections side by side; no point is shared."""
        return QuadSection(
            np.vstack([self.points_mm, other.points_mm]),
            np.vstack([self.quadrilaterals, other.quadrilaterals + len(self.points_mm)]),
            self.materials + other.materials,
        )


@dataclass(frozen=True)
class Block:
    """A grid (2n+1, 2m+1, 2) of points: corners at even indices, middles at odd ones."""

    grid_mm: Array
    material: str


def stations(start: float, stop: float, size_at: Callable[[Array], Array], least: int = 1) -> Array:
    """Divide a line into at least `least` elements of about the size wanted at each place, each of them halved.

    Returns the ends and middles of the elements, an odd number of values from start to stop.
    """
    fine = np.linspace(start, stop, 2001)
    density = 1 / size_at(fine)
    elements = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2 * abs(stop - start) / 2000)])
    n = max(least, int(np.ceil(elements[-1] - 1e-9)))
    ends = np.interp(np.linspace(0, elements[-1], n + 1), elements, fine)
    ends[0], ends[-1] = start, stop
    return with_middles(ends)


def with_middles(ends: Array) -> Array:
    """Put a point half way between each two."""
    points = np.empty(2 * len(ends) - 1)
    points[::2], points[1::2] = ends, (ends[1:] + ends[:-1]) / 2
    return points


def line(start: tuple[float, float], stop: tuple[float, float], fractions: Array) -> Array:
    """Return the points (n, 2) at these fractions of the way from start to stop."""
    points: Array = np.array(start) + fractions[:, None] * np.subtract(stop, start)
    return points


def patch(south: Array, north: Array, west: Array, east: Array) -> Array:
    """Fill a block between its four sides (Coons): south and north run eastwards, west and east northwards."""

    def chord(side: Array) -> Array:
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(side, axis=0), axis=1))])
        return np.asarray(along / along[-1])

    x = ((chord(south) + chord(north)) / 2)[:, None, None]
    y = ((chord(west) + chord(east)) / 2)[None, :, None]
    corners = (1 - x) * (1 - y) * south[0] + x * (1 - y) * south[-1] + (1 - x) * y * north[0] + x * y * north[-1]
    return np.asarray((1 - y) * south[:, None] + y * north[:, None] + (1 - x) * west + x * east - corners)


def rectangle(r_mm: Array, z_mm: Array) -> Array:
    """Return the grid (len(r), len(z), 2) of all pairs."""
    return np.stack(np.meshgrid(r_mm, z_mm, indexing="ij"), axis=-1)


def joined(blocks: Sequence[Block]) -> QuadSection:
    """Join blocks where their points coincide, and orient every element counter-clockwise."""
    points, elements, materials = [], [], []
    offset = 0
    for block in blocks:
        rows, columns, _ = block.grid_mm.shape
        index = offset + np.arange(rows * columns).reshape(rows, columns)
        i, j = (k.ravel() for k in np.mgrid[0 : rows - 1 : 2, 0 : columns - 1 : 2])
        elements.append(np.stack([index[i + di, j + dj] for di, dj in _AROUND], axis=-1))
        points.append(block.grid_mm.reshape(-1, 2))
        materials += [block.material] * len(i)
        offset += rows * columns
    return _without_duplicates(np.vstack(points), np.vstack(elements), tuple(materials))


_AROUND = ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1))
"""Steps in a block's grid from an element's first corner to its corners and middles."""
_MIRRORED = [0, 3, 2, 1, 7, 6, 5, 4]


def _without_duplicates(points: Array, elements: Indices, materials: tuple[str, ...]) -> QuadSection:
    used, elements = np.unique(elements, return_inverse=True)
    elements = elements.reshape(-1, 8)
    _, first, new = np.unique(np.round(points[used], 7), axis=0, return_index=True, return_inverse=True)
    points, elements = points[used][first], new.reshape(-1)[elements]
    u, v = (points[elements[:, k]] - points[elements[:, 0]] for k in (1, 3))
    clockwise = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0] < 0
    elements[clockwise] = elements[clockwise][:, _MIRRORED]
    return QuadSection(points, elements, materials)
