"""The light of one LED inside an empty block: the vector irradiance through planes at several heights.

No face is in the way, so one ray serves all depths of the face. Light on its way up from the LED and light that came up
again from the bottom are kept apart, because each arrives nearly as one beam. Source: Gershun, The Light Field, 1939.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from device.simulation.skin import Skin
from host_tools.optics.block_events import add, at_bottom, distance_to_wall, emit
from host_tools.optics.compiled import compiled
from host_tools.optics.light_block import LightBlock
from host_tools.optics.ray import BOOKS, COUNTERS, Medium, Ray, medium, moved

Array = NDArray[np.float64]
MOMENTS = 5
CLASSES = 2
"""Light of the LED itself, and of its image in the bottom."""


@compiled
def _cross(ray: Ray, before: float, reach: float, m: Medium, depths: Array, tallies: Array) -> None:
    """Add a rising ray to every plane it crosses, tallies [depth, moment, y, x].

    Moments of its radiance, per area: direction x, y, z; 1; square of direction z. `before` is the way (mm) it has
    come, `reach` the way it can go; haze takes its share of both.
    """
    for level in range(len(depths)):
        t = (m.thickness - depths[level] - ray.z) / ray.dz
        if 0.0 < t < reach:
            x, y = ray.x + t * ray.dx, ray.y + t * ray.dy
            weight = ray.weight * math.exp(-m.haze * (before + t))
            add(tallies[level, 0], x, y, weight * ray.dx / ray.dz, m)
            add(tallies[level, 1], x, y, weight * ray.dy / ray.dz, m)
            add(tallies[level, 2], x, y, weight, m)
            add(tallies[level, 3], x, y, weight / ray.dz, m)
            add(tallies[level, 4], x, y, weight * ray.dz, m)


@compiled
def _fill(rays: int, seed: int, m: Medium, depths: Array, tallies: Array, ledger: Array) -> None:
    """Add rays of the LED at +x, risen straight or after the bottom, to tallies [class, depth, moment, y, x]."""
    np.random.seed(seed)  # noqa: NPY002
    for _ in range(rays):
        ray = emit(m, 0, ledger)
        if ray.dz < 0.0:
            to_bottom = -ray.z / ray.dz
            if to_bottom >= distance_to_wall(ray, m.half):
                continue
            landed = moved(ray, ray.x + to_bottom * ray.dx, ray.y + to_bottom * ray.dy, 0.0)
            ray = at_bottom(landed, m, ledger)
            if ray.weight > 0.0:
                _cross(ray, to_bottom, distance_to_wall(ray, m.half), m, depths, tallies[1])
        elif ray.dz > 0.0:
            _cross(ray, 0.0, distance_to_wall(ray, m.half), m, depths, tallies[0])


def light_field(block: LightBlock, depths_mm: Array, cells: int, rays: int, seed: int) -> tuple[Array, Array]:
    """Return the light of the LED at +x per unit of its light, on planes `depths_mm` below the undeformed face.

    First its vector irradiance [class, depth, 3, n, n] in 1/mm2; then half the angle (rad) it is seen under
    [class, depth, n, n], measured upwards, as if it were an evenly bright disc. The block's mirror symmetry (y to -y)
    halves the noise's square.
    """
    m = medium(block, Skin(), True, 2 * block.half_width_mm / cells)
    tallies, ledger = np.zeros((CLASSES, len(depths_mm), MOMENTS, cells, cells)), np.zeros(len(BOOKS + COUNTERS))
    _fill(rays, seed, m, np.asarray(depths_mm, dtype=np.float64), tallies, ledger)
    mirrored = tallies[..., ::-1, :] * np.array([1.0, -1.0, 1.0, 1.0, 1.0])[:, None, None]
    even = (tallies + mirrored) / (2 * rays)
    return even[:, :, :3], _half_angle(even)


def _half_angle(moments: Array) -> Array:
    """Return twice the standard deviation of direction z, turned into the angle that a source's height causes.

    A disc of radius R at distance r has the standard deviation R / 2; raising a source by h turns direction z by
    h (1 - z^2) / r.
    """
    rise, all_light, squares = moments[:, :, 2], moments[:, :, 3], moments[:, :, 4]
    lit = np.maximum(all_light, 1e-12)
    mean = rise / lit
    deviation = np.sqrt(np.maximum(squares / lit - mean**2, 0.0))
    return np.asarray(2 * deviation / np.maximum(1 - mean**2, 0.05))
