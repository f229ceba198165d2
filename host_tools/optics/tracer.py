"""Reference light: rays from the LEDs through the block to skin and camera, by Monte Carlo.

It turns a deformed face and its contact ratio into what the camera sees, with the statistical noise beside it. The
camera is telecentric: it looks straight up at every place of the face. Slow and without shortcuts; the fast model of
the virtual probe is judged by it. Source: Pharr, Jakob & Humphreys, Physically Based Rendering, 3rd ed., chapter 14.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from device.measurement.arrays import Array
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.simulation.physics.skin import Skin
from host_tools.optics.block_events import at_bottom, at_wall, distance_to_wall, emit, in_haze
from host_tools.optics.compiled import compiled
from host_tools.optics.face_events import at_face
from host_tools.optics.height_field import HeightField, distance_to_face
from host_tools.optics.ray import BOOKS, COUNTERS, CUT, ROULETTE, TALLIES, Medium, Ray, medium, moved, weighing
from host_tools.optics.traced import Traced, TracedFace, summed_up
from host_tools.scenes.light_block import LightBlock

__all__ = ["Traced", "TracedFace", "trace"]

BATCHES = 20
LONGEST_PATH = 2000
FAINT = 0.2
"""Below this weight a ray survives with the probability weight / FAINT, and then has the weight FAINT again."""


@compiled
def _advance(ray: Ray, t: float) -> Ray:
    return moved(ray, ray.x + t * ray.dx, ray.y + t * ray.dy, ray.z + t * ray.dz)


@compiled
def _roulette(ray: Ray, ledger: Array) -> Ray:
    """Return a faint ray strengthened or ended; the mean energy is kept and the difference booked."""
    kept = FAINT if np.random.random() * FAINT < ray.weight else 0.0  # noqa: NPY002
    ledger[ROULETTE] += ray.weight - kept
    return weighing(ray, kept)


@compiled
def _event(ray: Ray, m: Medium, field: HeightField, contact: Array, tallies: Array, ledger: Array) -> Ray:
    """Return the ray after the next thing it meets: face, wall, bottom or haze."""
    to_wall = distance_to_wall(ray, m.half)
    to_bottom = -ray.z / ray.dz if ray.dz < 0.0 else 1e30
    nearest = min(to_wall, to_bottom)
    to_face = distance_to_face(field, ray.x, ray.y, ray.z, ray.dx, ray.dy, ray.dz, nearest)
    nearest = min(nearest, to_face)
    if m.haze > 0.0:
        free = -math.log(1.0 - np.random.random()) / m.haze  # noqa: NPY002
        if free < nearest:
            return in_haze(_advance(ray, free), m, tallies)
    ray = _advance(ray, nearest)
    if nearest == to_face:
        return at_face(ray, m, field, contact, tallies, ledger)
    return at_bottom(ray, m, ledger) if nearest == to_bottom else at_wall(ray, m, ledger)


@compiled
def _batch(
    rays: int, seed: int, share: Array, m: Medium, field: HeightField, contact: Array, tallies: Array, ledger: Array
) -> None:
    """Trace rays and add them to the tallies [kind, ny, nx] and the ledger; LEDs in exact shares (cumulative)."""
    np.random.seed(seed)  # noqa: NPY002
    for number in range(rays):
        led = int(np.searchsorted(share, (number + 0.5) / rays))
        ray = emit(m, led, ledger)
        for _ in range(LONGEST_PATH):
            ray = _event(ray, m, field, contact, tallies, ledger)
            if 0.0 < ray.weight < FAINT:
                ray = _roulette(ray, ledger)
            if ray.weight <= 0.0:
                break
        ledger[CUT] += ray.weight


def trace(
    block: LightBlock,
    face: TracedFace,
    skin: Skin,
    *,
    led_ratio: Sequence[float] = (1.0, 1.0, 1.0, 1.0),
    rays: int = 2_000_000,
    seed: int = 1,
    cell_mm: float = 0.5,
) -> Traced:
    """Return what the camera sees per unit of LED light, the mean over the LEDs lit; one seed, one answer.

    `led_ratio`: brightness of the sides +x, +y, -x, -y. `rays` are split into 20 independent batches; the noise is
    the spread between them. `cell_mm` divides the block's width into the tally's cells.
    Raises `InvalidQuantity` for no light, too few rays, a cell that does not fit, or a face that reaches the LEDs.
    """
    require("rays", rays, Bound(BATCHES, 1e12, ""), "give every batch a ray")
    lit = np.array([require("led_ratio", float(r), Bound(0.0, 1e3, ""), "give four sides") for r in led_ratio])
    if lit.shape != (4,) or not lit.any():
        raise InvalidQuantity("led_ratio", tuple(led_ratio), "four ratios, not all 0", "switch an LED on")
    cells = round(
        2 * block.half_width_mm / require("cell_mm", cell_mm, Bound(1e-3, block.half_width_mm, "mm"), "divide")
    )
    clear = block.thickness_mm - block.led_height_mm - block.led_radius_mm
    require("w_mm", float(face.w_mm.max()), Bound(-1e3, clear, "mm", high_included=False), "keep the LEDs in the block")
    numbers = medium(block, skin, face.skin_behind, 2 * block.half_width_mm / cells)
    field, contact = face.height_field(block.thickness_mm), np.ascontiguousarray(face.contact_ratio, dtype=np.float64)
    tallies = np.zeros((BATCHES, len(TALLIES), cells, cells))
    ledgers = np.zeros((BATCHES, len(BOOKS + COUNTERS)))
    sizes = np.diff(np.linspace(0, rays, BATCHES + 1).astype(int))
    seeds = np.random.SeedSequence(seed).generate_state(BATCHES)
    share = np.cumsum(lit) / lit.sum()
    for size, batch_seed, tally, ledger in zip(sizes, seeds, tallies, ledgers, strict=True):
        _batch(int(size), int(batch_seed), share, numbers, field, contact, tally, ledger)
        tally /= size
        ledger /= size
    return summed_up(tallies, ledgers, block.half_width_mm)
