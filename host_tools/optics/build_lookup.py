"""Writes the table that the virtual probe's optics run on: the light of one LED, traced once.

Direct and once-reflected light is counted without a face in the way, so one run serves every depth; what walls and haze
add, and what comes back from the skin, are measured on flat faces. Only the LED at +x is traced: the block's symmetry
gives the others and halves the rest. It holds for dark walls: with white ones the light depends on what the skin takes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.simulation.light_table import LightTable
from device.simulation.skin import Skin
from host_tools.optics.light_block import LightBlock
from host_tools.optics.light_field import light_field
from host_tools.optics.traced import Face, Traced
from host_tools.optics.tracer import trace

Array = NDArray[np.float64]
CELLS = 80
"""Cells across the block: 0.3 mm, less than skin spreads light."""
STRAY_CELLS = 20
"""Stray light is faint and smooth: fewer cells, less noise."""
DEPTHS_MM = np.arange(-0.5, 2.51, 0.5)
LED_X = (1.0, 0.0, 0.0, 0.0)
STEPS = ("light of an LED", "stray light", "light from wet skin", "light from dry skin")
WHITEST_WALL = 0.2
"""Wall reflectance up to which the table is right: there the sum is 2 % too large, at 0.9 by 23 %."""


def write_light_table(
    folder: Path,
    rays: int = 100_000_000,
    seed: int = 1,
    on_step: Callable[[str], None] = lambda step: None,
    block: LightBlock | None = None,
) -> LightTable:
    """Trace the light of a block (the default one unless given), write light_table.npz and .json, return the table.

    `rays` for the light of the LED; the three smaller parts take a tenth each. `on_step` is told each of `STEPS` as it
    begins. The same rays and seed give the same table.
    """
    require("rays", rays, Bound(1000, 1e12, ""), "trace enough rays to fill the table")
    block = block or LightBlock()
    walls = Bound(0.0, WHITEST_WALL, ": beyond it the stray light depends on the press, which no table holds")
    require("wall_reflectance", block.wall_reflectance, walls, "blacken the walls, or trace each scene")
    table = make_light_table(block, rays, seed, on_step)
    table.save(folder, {"rays": rays, "seed": seed})
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


def _flat(block: LightBlock, contact: float, skin_behind: bool) -> Face:
    edge = np.array([-block.half_width_mm, block.half_width_mm])
    return Face(edge, edge, np.zeros((2, 2)), np.full((2, 2), contact), skin_behind)


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
