"""How far the fast lookup model is from the traced light, on scenes that no part of it was fitted to.

Two families: smooth dimples of random depth, width, place, contact and light, and faces as finite elements give them
for a round probe, with and without an inclusion. The tracer's own noise stands beside every error: it is part of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Inclusion
from device.simulation.lookup_optics import LookupOptics
from device.simulation.pressed_face import RadialProfiles
from device.simulation.skin import Skin
from device.simulation.surface_table import SurfaceTable
from host_tools.optics.light_block import LightBlock
from host_tools.optics.traced import Face
from host_tools.optics.tracer import trace

Array = NDArray[np.float64]
CELL_MM = 0.5
PRESS_N = 0.5


@dataclass(frozen=True)
class HeldOutScene:
    """A face to compare on: `w_mm` and `p_kpa` [ny, nx] on the lookup's render grid, LEDs and skin."""

    name: str
    w_mm: NDArray[np.floating]
    p_kpa: NDArray[np.floating]
    led_ratio: tuple[float, float, float, float]
    skin: Skin


@dataclass(frozen=True)
class HeldOutRow:
    """Errors of the lookup model on one scene, as ratios; `noise_ratio` is the tracer's share in the first.

    `rms_of_peak_ratio`: over 0.5 mm cells, per brightest traced cell. `sum_error_ratio` and `peak_error_ratio` are
    signed; the peak is that of means over 1.5 mm, which noise does not lift.
    """

    name: str
    rms_of_peak_ratio: float
    sum_error_ratio: float
    peak_error_ratio: float
    noise_ratio: float


def dimple_scenes(lookup: LookupOptics, count: int = 7, seed: int = 20) -> Iterator[HeldOutScene]:
    """Yield random Gaussian dimples: depth 0.26-1.28 mm, width 2.1-3.9 mm, off centre by up to 3.5 mm, LEDs unequal.

    The last one is the steepest of all that range: deepest and narrowest.
    """
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(lookup.x_mm.astype(float), lookup.y_mm.astype(float))
    for number in range(count):
        depth, width = random.uniform(0.26, 1.28), random.uniform(2.1, 3.9)
        if number == count - 1:
            depth, width = 1.28, 2.1
        at_x, at_y = random.uniform(-3.5, 3.5, 2)
        bump = np.exp(-((x - at_x) ** 2 + (y - at_y) ** 2) / (2 * width**2))
        around, lump = -2.0 * np.log(1 - random.uniform(0.13, 0.26)), random.uniform(0.5, 4.0)
        leds = tuple(random.uniform(0.5, 1.0, 4).tolist())
        slope_deg = float(np.degrees(np.arctan(depth / width * np.exp(-0.5))))
        name = f"dimple {number + 1}: {depth:.2f} mm deep, {width:.1f} mm wide, slope {slope_deg:.0f} deg"
        yield HeldOutScene(name, np.asarray(depth * bump), np.asarray(around + lump * bump), leds, Skin())


def pressed_scenes(lookup: LookupOptics, table: SurfaceTable, seed: int = 21) -> Iterator[HeldOutScene]:
    """Yield faces of a round probe pressed with 0.5 N: without a lump, and over lumps of several sizes and depths.

    Deformation and pressure are the finite-element table's; what a lump adds is moved off the middle.
    """
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(lookup.x_mm.astype(float), lookup.y_mm.astype(float))
    round_the_middle = RadialProfiles(table.r_mm, np.hypot(x, y))
    bare = table.ramps(Inclusion(0.0, 6.0, 80.0)).bare.at(PRESS_N)
    w_bare, p_bare = (round_the_middle(field) for field in bare)
    p_bare = p_bare * round_the_middle.inside
    yield HeldOutScene("press, no inclusion", w_bare, p_bare, (1.0, 1.0, 1.0, 1.0), Skin())
    for size, depth, modulus in ((15.0, 4.0, 120.0), (8.0, 4.0, 80.0), (10.0, 8.0, 60.0), (15.0, 5.0, 40.0)):
        at_x, at_y = random.uniform(-3.5, 3.5, 2)
        round_the_lump = RadialProfiles(table.r_mm, np.hypot(x - at_x, y - at_y))
        lump = table.lump(Inclusion(size, depth, modulus)).at(PRESS_N)
        w_lump, p_lump = (round_the_lump(field) for field in lump)
        p = np.maximum(p_bare + p_lump * round_the_middle.inside, 0)
        leds = tuple(random.uniform(0.6, 1.0, 4).tolist())
        name = f"press, inclusion {size:g} mm, {depth:g} mm deep, {modulus:g} kPa"
        yield HeldOutScene(name, w_bare + w_lump, p, leds, Skin())


def cell_means(fine_mm: Array, half_width_mm: float, cells: int) -> Array:
    """Return the matrix [cells, n] that averages values at evenly spaced centres `fine_mm` over coarser cells."""
    step = fine_mm[1] - fine_mm[0]
    edges = np.linspace(-half_width_mm, half_width_mm, cells + 1)
    low = np.maximum(edges[:-1, None], fine_mm[None, :] - step / 2)
    high = np.minimum(edges[1:, None], fine_mm[None, :] + step / 2)
    overlap = np.maximum(high - low, 0.0)
    return np.asarray(overlap / overlap.sum(axis=1, keepdims=True))


def held_out_errors(
    lookup: LookupOptics, block: LightBlock, scenes: Sequence[HeldOutScene], rays: int, seed: int = 5
) -> list[HeldOutRow]:
    """Return the errors of the lookup model against `rays` traced rays, one row per scene."""
    return [_compare(lookup, block, scene, rays, seed + number) for number, scene in enumerate(scenes)]


def _compare(lookup: LookupOptics, block: LightBlock, scene: HeldOutScene, rays: int, seed: int) -> HeldOutRow:
    x, y = lookup.x_mm.astype(float), lookup.y_mm.astype(float)
    face = Face(x, y, scene.w_mm.astype(float), scene.skin.contact_ratio(scene.p_kpa).astype(float))
    traced = trace(block, face, scene.skin, led_ratio=scene.led_ratio, rays=rays, seed=seed, cell_mm=CELL_MM)
    true = traced.radiance * (sum(scene.led_ratio) / 4)
    means = cell_means(x, block.half_width_mm, true.shape[0])
    w, p = scene.w_mm.astype(np.float32), scene.p_kpa.astype(np.float32)
    model = means @ lookup.radiance(w, p, scene.led_ratio, scene.skin, touching=True) @ means.T
    rms = float(np.sqrt(np.mean((model - true) ** 2)))
    wide = cell_means(traced.x_mm, block.half_width_mm, true.shape[0] // 3)
    model_peak, true_peak = (float((wide @ image @ wide.T).max()) for image in (model, true))
    return HeldOutRow(
        name=scene.name,
        rms_of_peak_ratio=rms / float(true.max()),
        sum_error_ratio=float(model.sum() / true.sum()) - 1,
        peak_error_ratio=model_peak / true_peak - 1,
        noise_ratio=traced.noise_ratio,
    )
