"""Writes the table that the virtual probe's optics run on: the light of one LED, traced once.

Direct and once-reflected light is counted without a face in the way, so one run serves every depth; what walls and haze
add, and what comes back from the skin, are measured on flat faces. Only the LED at +x is traced: the block's symmetry
gives the others and halves the rest. It holds for dark walls: with white ones the light depends on what the skin takes.

What is counted is the vector irradiance through planes at several heights of the empty block. Light on its way up from
the LED and light that came up again from the bottom are kept apart, because each arrives nearly as one beam. Source:
Gershun, The Light Field, 1939.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, require
from device.simulation.physics.light_table import LightTable
from device.simulation.physics.skin import Skin
from host_tools.optics.block_events import add, at_bottom, distance_to_wall, emit
from host_tools.optics.compiled import compiled
from host_tools.optics.ray import BOOKS, COUNTERS, Medium, Ray, medium, moved
from host_tools.optics.traced import Traced, TracedFace
from host_tools.optics.tracer import trace
from host_tools.scenes.light_block import LightBlock
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe

MOMENTS = 5
CLASSES = 2
"""Light of the LED itself, and of its image in the bottom."""
CELLS = 80
"""Cells across the block: 0.3 mm, less than skin spreads light."""
STRAY_CELLS = 20
"""Stray light is faint and smooth: fewer cells, less noise."""
DEPTHS_MM = np.arange(-0.5, 2.51, 0.5)
LED_X = (1.0, 0.0, 0.0, 0.0)
STEPS = ("light of an LED", "stray light", "light from wet skin", "light from dry skin")
WHITEST_WALL = 0.2
"""Wall reflectance up to which the table is right: there the sum is 2 % too large, at 0.9 by 23 %."""


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


def write_light_table(
    folder: Path,
    rays: int = 100_000_000,
    seed: int = 1,
    on_step: Callable[[str], None] = lambda step: None,
    probe: Probe | None = None,
) -> LightTable:
    """Trace the light of a probe (the simulated one unless given), write light_table.npz and .json, return the table.

    `rays` for the light of the LED; the three smaller parts take a tenth each. `on_step` is told each of `STEPS` as it
    begins. The same rays and seed give the same table.
    """
    require("rays", rays, Bound(1000, 1e12, ""), "trace enough rays to fill the table")
    probe = probe or simulated_probe()
    block = probe.light_block
    walls = Bound(0.0, WHITEST_WALL, ": beyond it the stray light depends on the press, which no table holds")
    require("wall_reflectance", block.wall_reflectance, walls, "blacken the walls, or trace each scene")
    table = make_light_table(block, rays, seed, on_step)
    table.save(folder, {"rays": rays, "seed": seed, **probe.origin()})
    return table


def make_light_table(block: LightBlock, rays: int, seed: int, on_step: Callable[[str], None]) -> LightTable:
    """Return the table of a block without writing it."""
    on_step(STEPS[0])
    levels, half_angle = light_field(block, DEPTHS_MM, CELLS, rays, seed)
    on_step(STEPS[1])
    dark = trace(
        block, _flat(block, 0.0, False), Skin(), led_ratio=LED_X, rays=rays // 10, seed=seed, cell_mm=_stray_cell(block)
    )
    stray = np.stack([_smooth(dark.scattered[kind]) for kind in ("stray_wet", "stray_dry")])
    relative = np.moveaxis(levels, 1, 2) * (2 * block.half_width_mm) ** 2
    return LightTable(
        block=asdict(block),
        depths_mm=DEPTHS_MM.astype(np.float32),
        relative_irradiance=relative.astype(np.float16),
        half_angle=half_angle.astype(np.float16),
        stray=stray.astype(np.float32),
        background=_smooth(dark.radiance).astype(np.float32),
        returned_ratio=_returned_ratio(block, rays // 10, seed, on_step).astype(np.float32),
    )


def _flat(block: LightBlock, contact: float, skin_behind: bool) -> TracedFace:
    edge = np.array([-block.half_width_mm, block.half_width_mm])
    return TracedFace(edge, edge, np.zeros((2, 2)), np.full((2, 2), contact), skin_behind)


def _stray_cell(block: LightBlock) -> float:
    return 2 * block.half_width_mm / STRAY_CELLS


def _smooth(coarse: Array) -> Array:
    """Return a map of the LED at +x, made symmetric in y, on the table's cells (bilinear between centres)."""
    even = (coarse + coarse[::-1]) / 2
    at = (np.arange(CELLS) + 0.5) * STRAY_CELLS / CELLS - 0.5
    hats = np.maximum(0.0, 1 - np.abs(np.clip(at, 0, STRAY_CELLS - 1)[:, None] - np.arange(STRAY_CELLS)))
    return np.asarray(hats @ even @ hats.T)


def _returned_ratio(block: LightBlock, rays: int, seed: int, on_step: Callable[[str], None]) -> Array:
    """Return [given back wet or dry, taken in wet or dry] the share of the skin's light that meets the face again."""
    share = 0.3
    on_step(STEPS[2])
    wet = _returned(trace(block, _flat(block, 1.0, True), Skin(), rays=rays, seed=seed))
    on_step(STEPS[3])
    mixed = _returned(trace(block, _flat(block, share, True), Skin(), rays=rays, seed=seed))
    return np.stack([wet, (mixed - share * wet) / (1 - share)])


def _returned(traced: Traced) -> Array:
    area = (traced.x_mm[1] - traced.x_mm[0]) ** 2
    kinds = ("returned_wet", "returned_dry")
    return np.array([traced.scattered[kind].sum() * area / traced.reemitted for kind in kinds])
