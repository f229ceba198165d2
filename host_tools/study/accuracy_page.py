"""The map of bounds to the first part of docs/accuracy.md and its figure: what no method can beat, in plain words.

Every number is of the map it is given. The text ends before anything measured: what estimates really miss by is
another part.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.colors import LogNorm

from host_tools.inverse.information import Array
from host_tools.inverse.limits import BOX_STD
from host_tools.study.accuracy_map import (
    DEPTHS_MM,
    MODULI_KPA,
    PRECISE,
    SIZES_MM,
    STANDARD,
    MappedScene,
    deepest_mm,
    is_identifiable,
    stds,
    ways,
)

FIGURE = "accuracy_map.png"
NAMES = ("size", "depth", "modulus")
WELL, ROUGHLY = 0.1, 0.3
"""Known well and roughly: standard deviations of the logarithm."""
MOST = 10.0
"""Bounds beyond 1000 % are not written out."""
SHOWN_MODULI = slice(1, None)
"""The paper's box begins at 40 kPa; the softer lump is shown beside it."""


def limits_markdown(scenes: list[MappedScene], command: str) -> str:
    """Return the part of the page about limits, its title first; the figure lies in figures/."""
    return "\n".join([*_opening(scenes, command), *_where(scenes), *_ways(scenes), *_tables(scenes), *_closing()])


def _opening(scenes: list[MappedScene], command: str) -> Iterator[str]:
    standard = ways()[STANDARD]
    forces = ", ".join(f"{force:g}" for force in standard.forces_n)
    yield from (
        "# How well a lump can be known",
        "",
        "## Limits: what no method can beat",
        "",
        "The Cramer-Rao bound is the least standard deviation that any unbiased estimate can have, whatever network or "
        "fit makes it. It is computed here from derivatives of the forward model in finite strain with true sliding, "
        "through the simulated light to the contrast on rings of the image. Everything here is simulated.",
        "",
        f"Written by `{command}`: do not edit.",
        "",
        f"*Standard* takes {standard.frames} frames at {forces} N and as many beside the lump, *precise* "
        f"{ways()[PRECISE].frames}. Not known, beside size, depth and modulus: the tissue's modulus "
        f"({_percent(standard.tissue_modulus_spread_ratio)} %) and thickness "
        f"({_percent(standard.thickness_spread_ratio)} %), the skin's law of contact "
        f"({_percent(standard.contact_law_spread_ratio)} %), gain ({_percent(standard.gain_spread_ratio)} %), force "
        f"({_percent(standard.force_scale_spread_ratio)} %). To the camera's noise comes a smooth error of "
        f"{_percent(standard.systematic_ratio)} % that no frame takes away (light or model). All numbers are standard "
        "deviations in per cent, of the logarithm. Above some 50 % they only say: not known.",
        "",
        f"![bounds over the box](figures/{FIGURE})",
        "",
    )


def _where(scenes: list[MappedScene]) -> Iterator[str]:
    found, boxed = stds(scenes, STANDARD), stds(scenes, STANDARD, with_box=True)
    yield from ("### Where size, depth and modulus can be known", "")
    for i, name in enumerate(NAMES):
        well, roughly = (int(np.sum(found[..., i] <= level)) for level in (WELL, ROUGHLY))
        yield (
            f"- **{name.capitalize()}**: to 10 % in {well} of {len(scenes)} scenes, to 30 % in {roughly}, "
            f"not to 30 % in {len(scenes) - roughly}."
        )
    worst = [limit.quoted.alone for limit in (scene.limits[STANDARD] for scene in scenes)]
    toward = np.median([np.abs(bound.worst_direction) for bound in worst], axis=0)
    yield from (
        f"- The direction known worst is nearly the modulus alone: (ln d, ln h, ln E) = "
        f"({toward[0]:.2f}, {toward[1]:.2f}, {toward[2]:.2f}), median of the absolute values. A harder lump looks like "
        "a slightly larger and shallower one.",
        "- **Knowing the box helps size and depth through the modulus**: if E is known to come from 40 to 120 kPa, "
        f"size is known to {_percent(float(np.median(boxed[..., 0])))} % and depth to "
        f"{_percent(float(np.median(boxed[..., 1])))} % in the median scene "
        f"({_percent(float(np.median(found[..., 0])))} and {_percent(float(np.median(found[..., 1])))} % without); "
        f"the modulus itself stays at {_percent(float(np.median(boxed[..., 2])))} %, and the box alone gives "
        f"{_percent(BOX_STD[2])} %.",
        "",
        "Largest depth (mm) down to which it is known for every modulus from 40 to 120 kPa, standard protocol:",
        "",
        "| size | size to 10 % | to 30 % | depth to 10 % | to 30 % | modulus to 10 % | to 30 % |",
        "|---|---|---|---|---|---|---|",
    )
    for i, size_mm in enumerate(SIZES_MM):
        worst_std = found[i, :, SHOWN_MODULI].max(axis=1)
        cells = [_depth(deepest_mm(worst_std[:, k] <= level)) for k in range(3) for level in (WELL, ROUGHLY)]
        yield f"| {size_mm:g} mm | " + " | ".join(cells) + " |"
    yield ""


def _ways(scenes: list[MappedScene]) -> Iterator[str]:
    yield from (
        "### Ways to measure, compared",
        "",
        "Bounds over those of the standard protocol: geometric means over all scenes, so 2 means twice as uncertain. "
        "Pressure and displacement stand for ideal sensors that show nothing else, with the same camera.",
        "",
        "| way | size | depth | modulus | scenes with size to 30 % | depth to 30 % | modulus to 30 % |",
        "|---|---|---|---|---|---|---|",
    )
    standard = stds(scenes, STANDARD)
    for name in ways():
        found = stds(scenes, name)
        both = np.isfinite(found).all(axis=-1)
        factor = np.exp(np.log(found[both] / standard[both]).mean(axis=0)) if both.any() else np.full(3, np.inf)
        counts = (found <= ROUGHLY).sum(axis=(0, 1, 2))
        yield (
            f"| {name} | " + " | ".join(f"{x:.2g}" for x in factor) + " | " + " | ".join(str(n) for n in counts) + " |"
        )
    yield ""


def _tables(scenes: list[MappedScene]) -> Iterator[str]:
    yield from (
        "### All scenes",
        "",
        "Size / depth / modulus in per cent, of the measurement alone. Computed with elements of order 3 and "
        "of order 4; the larger is shown, with ~ where they differ by more than 20 %: such a bound is known to that "
        "factor only.",
        "",
    )
    for way in (STANDARD, PRECISE):
        yield from _table(scenes, way, with_box=False)
    yield from (
        "With the box as prior (sizes 2-15 mm, depths 4-12 mm, moduli 40-120 kPa, evenly in the logarithm; alone it "
        f"gives {' / '.join(_percent(std) for std in BOX_STD)}). **Bold** where the probe would call an estimate as "
        "good as this `identifiable`: under half of the box's own spread ([measurement](measurement.md#intervals)). "
        "What is not bold here can honestly only be answered with 'not determined', by any method. A lump of 15 kPa "
        "lies outside the box.",
        "",
    )
    yield from _table(scenes, STANDARD, with_box=True)


def _table(scenes: list[MappedScene], way: str, *, with_box: bool) -> Iterator[str]:
    title = way.capitalize() + (", with the box as prior" if with_box else ", measurement alone")
    yield f"| {title} | " + " | ".join(f"{modulus:g} kPa" for modulus in MODULI_KPA) + " |"
    yield "|---" * (len(MODULI_KPA) + 1) + "|"
    for i in range(0, len(scenes), len(MODULI_KPA)):
        row = scenes[i : i + len(MODULI_KPA)]
        size_mm, depth_mm, _ = row[0].lump
        yield f"| {size_mm:g} mm, {depth_mm:g} mm deep | " + " | ".join(_cell(s, way, with_box) for s in row) + " |"
    yield ""


def _cell(scene: MappedScene, way: str, with_box: bool) -> str:
    found = scene.limits[way]
    if with_box:
        pairs = zip(found.std_with_box, is_identifiable(found), strict=True)
        return " / ".join(f"**{_percent(std)}**" if narrow else _percent(std) for std, narrow in pairs)
    return " / ".join(_percent(std) for std in found.std) + (" ~" if found.not_converged else "")


def _closing() -> Iterator[str]:
    yield from (
        "### What the limits leave out",
        "",
        "- They hold for small errors about one scene, and for unbiased estimates; a bound of 200 % is no prediction "
        "of an error, only of ignorance. With the box as prior no error exceeds the box.",
        "- The law of the material (neo-Hookean), Poisson ratios, the probe's layers, the sphere's shape, and a "
        "lump on the axis are taken as known. Not knowing them makes everything worse.",
        "- The smooth error is assumed, not measured: 0.2 % of the light, correlated over 2 mm and alike at all loads, "
        "and again over 3 mm for each load by itself.",
        "- Deformation bends the light too, but by a hundredth of what pressure does; with the traced tables of the "
        "simulated probe its noise would pass for information (bounds 2 to 10 times too small), so it is left out.",
        "- Size and depth move the mesh. What only the elements make of that cancels against the same press without "
        "the lump on the same mesh; two meshes would make bounds up to 10 times too small.",
        "",
    )


def draw_map(scenes: list[MappedScene], path: Path) -> None:
    """Write the figure: the standard protocol's bounds, one panel for each unknown and modulus."""
    found = 100 * stds(scenes, STANDARD)
    figure, panels = plt.subplots(3, len(MODULI_KPA), figsize=(11, 7.6), sharex=True, sharey=True, layout="constrained")
    for k, j in np.ndindex(3, len(MODULI_KPA)):
        panel = panels[k, j]
        image = _draw_panel(panel, found[:, :, j, k].T)
        if k == 0:
            panel.set_title(f"E = {MODULI_KPA[j]:g} kPa")
        if j == 0:
            panel.set_ylabel(f"{NAMES[k]} known to (%)\n\ndepth (mm)")
        if k == 2:
            panel.set_xlabel("size (mm)")
    figure.colorbar(image, ax=panels, label="standard deviation (%)", extend="both", shrink=0.6)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _draw_panel(panel: Any, percent: Array) -> Any:
    """Draw one unknown and modulus, depth downwards over size."""
    image = panel.imshow(percent, norm=LogNorm(1, 300), cmap="RdYlGn_r", aspect="auto")
    for (row, column), value in np.ndenumerate(percent):
        weight = "bold" if value <= 100 * ROUGHLY else "normal"
        panel.text(column, row, _percent(value / 100), ha="center", va="center", fontsize=9, weight=weight)
    panel.set_xticks(range(len(SIZES_MM)), [f"{size:g}" for size in SIZES_MM])
    panel.set_yticks(range(len(DEPTHS_MM)), [f"{depth:g}" for depth in DEPTHS_MM])
    return image


def _percent(ratio: float) -> str:
    return f"{100 * ratio:.2g}" if ratio < 1 else f"{100 * ratio:.0f}" if ratio <= MOST else ">1000"


def _depth(depth_mm: float | None) -> str:
    return "nowhere" if depth_mm is None else f"{depth_mm:g}"
