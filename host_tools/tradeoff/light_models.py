"""Images of the pressed face: traced with so many rays, or looked up in tables of so many cells; and what tables cost.

Truth is traced with many more rays, from another seed; its own noise is taken off in quadrature. A coarser table is the
committed one averaged over its cells, or with every other height of the face left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array, Single
from device.simulation.physics.light_table import LightTable
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.surface_table import SurfaceTable
from host_tools.optics.build_lookup import make_light_table
from host_tools.optics.traced import Traced, TracedFace
from host_tools.optics.tracer import trace
from host_tools.pages.benchmark import Chapter
from host_tools.scenes.light_block import LightBlock
from host_tools.tradeoff.fronts import Panel, front_figure, front_table
from host_tools.tradeoff.pareto import Choice, needless_everywhere
from host_tools.tradeoff.yardstick import cost, timed
from host_tools.verification.light.lookup import CELL_MM, HeldOutScene, cell_means, dimple_scenes, pressed_scenes

COARSER = (8, 4, 2, 1)
"""Cells of the committed table put together along each side."""
LEAST_ERROR = 1e-4
COMMITTED_RAYS, FEWEST_RAYS = 100_000_000, 1_000
"""Rays of the table in models/simulated_probe; and so few that only compiling takes time."""
SEED, TRUTH_SEED = 5, 50


class ImageBudget(NamedTuple):
    """Rays of the truth, of the images that compete, and of the tables that are made; dimples and presses looked at."""

    truth_rays: int = 4_000_000
    rays: tuple[int, ...] = (10_000, 100_000, 1_000_000)
    table_rays: tuple[int, ...] = (100_000, 1_000_000, 10_000_000)
    scenes: int = 2


SHORT = ImageBudget(truth_rays=20_000, rays=(1_000, 4_000), table_rays=(2_000, 20_000), scenes=1)
"""Enough to try the chain."""


class SeenFace(NamedTuple):
    """A face with the image [y, x] that it truly gives, over cells of half a millimetre."""

    scene: HeldOutScene
    truth: Traced


def light_chapter(table: LightTable, faces: SurfaceTable, budget: ImageBudget | None = None) -> Chapter:
    """Return the fronts of one image and of the table behind it."""
    asked = budget or ImageBudget()
    block, lookup = LightBlock(**table.block), LookupOptics(table)  # type: ignore[arg-type]
    some = [
        *islice(dimple_scenes(lookup), asked.scenes),
        *islice(pressed_scenes(lookup, faces), 1, 1 + asked.scenes),
    ]
    scenes = [SeenFace(one, _traced(block, one, asked.truth_rays, TRUTH_SEED + k)) for k, one in enumerate(some)]
    panels = [_images(table, block, scenes, asked), _tables(table, block, scenes, asked)]
    return Chapter(
        "Light",
        f"Images of {len(scenes)} pressed faces, traced or looked up, and the tables that they are looked up in.",
        f"host_tools/tradeoff/light_models.py; truth: {_spoken(asked.truth_rays)} of another seed",
        tables=(front_table("Every way to an image, and to a table", panels),),
        figures=(
            front_figure("tradeoff_light.svg", "Time and error of an image, and of the table behind it", panels, 2),
        ),
        facts={"needless": needless_everywhere(_with_families(panels))},
    )


def _with_families(panels: Sequence[Panel]) -> list[list[Choice]]:
    return [[replace(one, name=f"{one.family}: {one.name}") for one in panel.choices] for panel in panels]


def _images(table: LightTable, block: LightBlock, scenes: Sequence[SeenFace], asked: ImageBudget) -> Panel:
    points = [_point(_spoken(rays), "ray tracer", _tracing(block, scenes, rays), scenes) for rays in asked.rays]
    for times in COARSER:
        coarse = coarser(table, times)
        name = f"{coarse.stray.shape[-1]} cells"
        points.append(_point(name, "table", _looking_up(coarse, scenes), scenes, chosen=times == 1))
    for step in (2, 3):
        few = fewer_heights(table, step)
        points.append(
            _point(f"{len(few.depths_mm)} heights", "table of fewer heights", _looking_up(few, scenes), scenes)
        )
    return Panel("One image", "rms error / peak", tuple(points))


def _tables(table: LightTable, block: LightBlock, scenes: Sequence[SeenFace], asked: ImageBudget) -> Panel:
    """Return the cost of a table by the rays it is made of; the committed one's is that of the same rays a piece."""
    make_light_table(block, FEWEST_RAYS, SEED, lambda step: None)  # compiles
    points, dearest = [], 0.0
    for rays in asked.table_rays:
        made, takes = timed(lambda rays=rays: make_light_table(block, rays, SEED, lambda step: None))  # type: ignore[misc]
        points.append(
            Choice(_spoken(rays), "table made of", takes.yardsticks, _error(_looking_up(made, scenes)[1], scenes))
        )
        dearest = takes.yardsticks / rays
    committed = _error(_looking_up(table, scenes)[1], scenes)
    points.append(
        Choice(
            _spoken(COMMITTED_RAYS),
            "committed table, time by its rays",
            dearest * COMMITTED_RAYS,
            committed,
            chosen=True,
        )
    )
    return Panel("The table behind it", "rms error / peak of an image", tuple(points))


def _spoken(rays: int) -> str:
    return f"{rays:.0e} rays".replace("e+0", "e")


Imaging = tuple[float, list[Array]]
"""Cost of one image in yardsticks, and the image of each scene."""


def _tracing(block: LightBlock, scenes: Sequence[SeenFace], rays: int) -> Imaging:
    found: list[Traced] = []
    takes = cost(lambda: found.append(_traced(block, scenes[0].scene, rays, SEED)), 1)
    found[1:] = [_traced(block, one.scene, rays, SEED + k) for k, one in enumerate(scenes[1:], 1)]
    return takes.yardsticks, [one.radiance * _lit(of.scene) for one, of in zip(found, scenes, strict=True)]


def _looking_up(table: LightTable, scenes: Sequence[SeenFace]) -> Imaging:
    lookup, half = LookupOptics(table), table.number("half_width_mm")
    means = cell_means(lookup.x_mm.astype(float), half, round(2 * half / CELL_MM))

    def image(one: SeenFace) -> Single:
        w, p = (_on_grid(field, len(lookup.x_mm)) for field in (one.scene.w_mm, one.scene.p_kpa))
        return lookup.radiance(w, p, one.scene.led_ratio, one.scene.skin, touching=True)

    images = [np.asarray(means @ image(one) @ means.T) for one in scenes]
    return cost(lambda: image(scenes[0])).yardsticks, images


def _point(name: str, family: str, imaging: Imaging, scenes: Sequence[SeenFace], *, chosen: bool = False) -> Choice:
    return Choice(name, family, imaging[0], _error(imaging[1], scenes), chosen=chosen)


def _error(images: Sequence[Array], scenes: Sequence[SeenFace]) -> float:
    """Return the mean over the scenes of the rms error over the peak, without the truth's own noise."""
    errors = []
    for image, (scene, traced) in zip(images, scenes, strict=True):
        true = traced.radiance * _lit(scene)
        rms = float(np.sqrt(np.mean((image - true) ** 2))) / float(true.max())
        errors.append(sqrt(max(rms**2 - traced.noise_ratio**2, LEAST_ERROR**2)))
    return float(np.mean(errors))


def _lit(scene: HeldOutScene) -> float:
    return sum(scene.led_ratio) / 4


def _traced(block: LightBlock, scene: HeldOutScene, rays: int, seed: int) -> Traced:
    step_mm = 2 * block.half_width_mm / len(scene.w_mm)
    at_mm: Array = (np.arange(len(scene.w_mm), dtype=np.float64) + 0.5) * step_mm - block.half_width_mm
    contact = np.asarray(scene.skin.contact_ratio(scene.p_kpa), dtype=np.float64)
    face = TracedFace(at_mm, at_mm, np.asarray(scene.w_mm, dtype=np.float64), contact)
    return trace(block, face, scene.skin, led_ratio=scene.led_ratio, rays=rays, seed=seed, cell_mm=CELL_MM)


def _on_grid(field: NDArray[np.floating], cells: int) -> Single:
    """Return the means [cells, cells] of a field over blocks of its own cells."""
    return np.asarray(_blocks(field, len(field) // cells), dtype=np.float32)


def _blocks(field: NDArray[np.floating], times: int) -> NDArray[np.floating]:
    """Return the means of a field [..., n, n] over blocks of so many cells along each side."""
    n = field.shape[-1] // times
    blocks = field.astype(np.float32).reshape(*field.shape[:-2], n, times, n, times)
    return np.asarray(blocks.mean(axis=(-3, -1)))


def coarser(table: LightTable, times: int) -> LightTable:
    """Return the table with so many cells along each side averaged."""
    return replace(
        table,
        relative_irradiance=_blocks(table.relative_irradiance, times).astype(np.float16),
        half_angle=_blocks(table.half_angle, times).astype(np.float16),
        stray=_blocks(table.stray, times).astype(np.float32),
        background=_blocks(table.background, times).astype(np.float32),
    )


def fewer_heights(table: LightTable, step: int) -> LightTable:
    """Return the table with every so many of its heights."""
    return replace(
        table,
        depths_mm=table.depths_mm[::step],
        relative_irradiance=table.relative_irradiance[:, :, ::step],
        half_angle=table.half_angle[:, ::step],
    )
