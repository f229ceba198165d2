"""The virtual probe's fast image model against the tracer, on scenes that no part of its table was made from.

The tracer's own noise is part of every difference; it is taken off in quadrature before the bound is asked.
Source: `host_tools/optics/held_out.py`.
"""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from device.simulation.light_table import load_light_table
from device.simulation.lookup_optics import LookupOptics
from device.simulation.surface_table import load_surface_table
from host_tools.optics.held_out import (
    CELL_MM,
    HeldOutRow,
    HeldOutScene,
    cell_means,
    dimple_scenes,
    held_out_errors,
    pressed_scenes,
)
from host_tools.optics.light_block import LightBlock
from host_tools.optics.traced import Face
from host_tools.optics.tracer import trace
from host_tools.study.benchmark import Benchmark, Chapter, Figure, Table, at_most
from host_tools.study.optics_pictures import LINES

TABLES = Path(__file__).resolve().parents[2] / "models" / "simulated_probe"
TITLE = "The virtual probe's fast model"
CLAIM = (
    "The simulated probe looks its light up in a table instead of tracing it. Random dimples, and faces of a pressed "
    "probe with and without an inclusion, at 0.5 mm cells."
)
SOURCE = "The ray tracer; no scene was used to make the table."
MEAN_BOUND, WORST_BOUND, SUM_BOUND = 0.03, 0.05, 0.05


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
        face = Face(lookup.x_mm.astype(float), lookup.y_mm.astype(float), scene.w_mm.astype(float), _contact(scene))
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


def chapter(rays: int, folder: Path = TABLES) -> Chapter:
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
