"""How far the fast lookup model is from the traced light, on scenes that no part of it was fitted to.

Two families: smooth dimples of random depth, width, place, contact and light, and faces as finite elements give them
for a round probe, with and without an inclusion. The tracer's own noise is part of every error and stands beside it; it
is taken off in quadrature before the bound is asked.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from device.files.shipped import SIMULATED_PROBE
from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.simulation.physics.light_table import load_light_table
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.pressed_face import RadialProfiles
from device.simulation.physics.skin import Skin
from device.simulation.physics.surface_table import SurfaceTable, load_surface_table
from host_tools.optics.traced import TracedFace
from host_tools.optics.tracer import trace
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table, at_most
from host_tools.scenes.light_block import LightBlock
from host_tools.verification.light.pictures import LINES

CELL_MM = 0.5
PRESS_N = 0.5
TITLE = "The virtual probe's fast model"
CLAIM = "The simulated probe looks its light up in a table instead of tracing it."
SOURCE = "The ray tracer; no scene was used to make the table."
MEAN_BOUND, WORST_BOUND, SUM_BOUND = 0.03, 0.05, 0.05


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
        around, inclusion = -2.0 * np.log(1 - random.uniform(0.13, 0.26)), random.uniform(0.5, 4.0)
        leds = tuple(random.uniform(0.5, 1.0, 4).tolist())
        slope_deg = float(np.degrees(np.arctan(depth / width * np.exp(-0.5))))
        name = f"dimple {number + 1}: {depth:.2f} mm deep, {width:.1f} mm wide, slope {slope_deg:.0f} deg"
        yield HeldOutScene(name, np.asarray(depth * bump), np.asarray(around + inclusion * bump), leds, Skin())


def pressed_scenes(lookup: LookupOptics, table: SurfaceTable, seed: int = 21) -> Iterator[HeldOutScene]:
    """Yield faces of a round probe pressed with 0.5 N: without an inclusion, and over several.

    Deformation and pressure are the finite-element table's; what an inclusion adds is moved off the middle.
    """
    random = np.random.default_rng(seed)
    x, y = np.meshgrid(lookup.x_mm.astype(float), lookup.y_mm.astype(float))
    round_the_middle = RadialProfiles(table.r_mm, np.hypot(x, y))
    baseline = table.ramps(Inclusion(0.0, 6.0, 80.0)).baseline.at(PRESS_N)
    w_baseline, p_baseline = (round_the_middle(field) for field in baseline)
    p_baseline = p_baseline * round_the_middle.inside
    yield HeldOutScene("press, no inclusion", w_baseline, p_baseline, (1.0, 1.0, 1.0, 1.0), Skin())
    for size, depth, modulus in ((15.0, 4.0, 120.0), (8.0, 4.0, 80.0), (10.0, 8.0, 60.0), (15.0, 5.0, 40.0)):
        at_x, at_y = random.uniform(-3.5, 3.5, 2)
        round_the_inclusion = RadialProfiles(table.r_mm, np.hypot(x - at_x, y - at_y))
        inclusion = table.inclusion_field(Inclusion(size, depth, modulus)).at(PRESS_N)
        w_inclusion, p_inclusion = (round_the_inclusion(field) for field in inclusion)
        p = np.maximum(p_baseline + p_inclusion * round_the_middle.inside, 0)
        leds = tuple(random.uniform(0.6, 1.0, 4).tolist())
        name = f"press, inclusion {size:g} mm, {depth:g} mm deep, {modulus:g} kPa"
        yield HeldOutScene(name, w_baseline + w_inclusion, p, leds, Skin())


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
    face = TracedFace(x, y, scene.w_mm.astype(float), scene.skin.contact_ratio(scene.p_kpa).astype(float))
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


def model_error(row: HeldOutRow) -> float:
    """Return the rms error over the peak without the tracer's share in it; 0 where noise explains it all."""
    return sqrt(max(0.0, row.rms_of_peak_ratio**2 - row.noise_ratio**2))


def benchmarks(rows: list[HeldOutRow]) -> tuple[Benchmark, ...]:
    """Return mean and worst error of the images, and the worst error of their sums."""
    errors = [model_error(row) for row in rows]
    scenes = f"{len(rows)} scenes"
    return (
        at_most(scenes, "mean rms error / peak, without noise", float(np.mean(errors)), MEAN_BOUND),
        at_most(scenes, "worst rms error / peak, without noise", max(errors), WORST_BOUND),
        at_most(scenes, "worst error of the image's sum", max(abs(row.sum_error_ratio) for row in rows), SUM_BOUND),
    )


def _row(row: HeldOutRow) -> tuple[str, ...]:
    sizes = (f"{100 * value:.1f}" for value in (row.rms_of_peak_ratio, row.noise_ratio))
    return row.name, *sizes, f"{100 * row.sum_error_ratio:+.1f}", f"{100 * row.peak_error_ratio:+.1f}"


def _draw(figure: Any, lookup: LookupOptics, block: LightBlock, scenes: tuple[HeldOutScene, ...], rays: int) -> None:
    """Draw the middle profiles of a few scenes, looked up and traced."""
    for panel, scene in zip(figure.subplots(1, len(scenes), sharey=True, squeeze=False)[0], scenes, strict=True):
        face = TracedFace(
            lookup.x_mm.astype(float), lookup.y_mm.astype(float), scene.w_mm.astype(float), _contact(scene)
        )
        traced = trace(block, face, scene.skin, led_ratio=scene.led_ratio, rays=rays, cell_mm=CELL_MM)
        w, p = scene.w_mm.astype(np.float32), scene.p_kpa.astype(np.float32)
        means = cell_means(lookup.x_mm.astype(float), block.half_width_mm, len(traced.x_mm))
        looked_up = means @ lookup.radiance(w, p, scene.led_ratio, scene.skin, touching=True) @ means.T
        band = np.abs(traced.y_mm) < 1.0
        lit = sum(scene.led_ratio) / 4
        panel.plot(traced.x_mm, 1e5 * lit * traced.radiance[band].mean(axis=0), ".", color=LINES[0], label="traced")
        panel.plot(traced.x_mm, 1e5 * looked_up[band].mean(axis=0), "-", color=LINES[2], label="looked up")
        panel.set_title(scene.name.split(": ")[-1], fontsize=8)
        panel.set_xlabel("x (mm)")
        panel.grid(alpha=0.3)
    figure.axes[0].set_ylabel("radiance (10⁻⁵ / (sr mm²))")
    figure.axes[0].legend(fontsize=8)


def _contact(scene: HeldOutScene) -> np.ndarray[Any, np.dtype[np.float64]]:
    return np.asarray(scene.skin.contact_ratio(scene.p_kpa), dtype=np.float64)


def chapter(rays: int, folder: Path = SIMULATED_PROBE) -> Chapter:
    """Return the chapter; skipped where there is no table. Raises `InvalidQuantity` for a broken one."""
    if not (folder / "light_table.json").exists():
        missing = "there is no light table in models/simulated_probe; `host_tools optics build` makes it"
        return Chapter(TITLE, CLAIM, SOURCE, skipped=missing)
    table = load_light_table(folder)
    lookup, block = LookupOptics(table), LightBlock(**table.block)  # type: ignore[arg-type]
    scenes = (*dimple_scenes(lookup), *pressed_scenes(lookup, load_surface_table(folder)))
    rows = held_out_errors(lookup, block, scenes, rays)
    header = ("scene", "rms error / peak", "of it the tracer's noise", "error of the sum", "error of the peak")
    cells = [_row(row) for row in rows]
    shown = tuple(scenes[k] for k in (0, 6, -1))
    caption = "Profiles through the middle of three held-out scenes, looked up and traced"
    figure = Figure("optics_lookup.svg", caption, lambda canvas: _draw(canvas, lookup, block, shown, rays))
    return Chapter(
        TITLE, CLAIM, SOURCE, benchmarks(rows), (Table("Every scene, errors in %", header, tuple(cells)),), (figure,)
    )
