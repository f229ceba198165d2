"""The map of bounds to the first part of docs/accuracy.md and its figure: what no method can beat, in plain words.

Every number is of the map it is given. The text ends before anything measured: what estimates really miss by is
another part.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from device.measurement.press_parameters import RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.forward.sensitive_ramp import ORDERS
from host_tools.inverse.information import Array
from host_tools.study.accuracy_map import (
    MODULI_KPA,
    NOT_SMOOTH,
    PRECISE,
    SIZES_MM,
    STANDARD,
    MappedScene,
    deepest_mm,
    factors,
    stds,
    ways,
)

FIGURE = "accuracy_map.png"
NAMES = ("size", "depth", "modulus")
WELL, ROUGHLY = 0.1, 0.3
"""Known well and roughly: standard deviations of the logarithm."""
MOST = 10.0
"""Bounds beyond 1000 % are not written out."""


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
        "through the simulated light to the contrast on rings of the image, and to how the light of the press beside "
        "the lump grows with the force. Everything here is simulated.",
        "",
        f"Written by `{command}`: do not edit. One scene: `host_tools limits scene.toml --protocol "
        "protocols/precise.toml` (what a protocol may say: `host_tools/inverse/protocol.py`).",
        "",
        f"*Standard* takes {standard.frames} frames at {forces} N and as many beside the lump, *precise* "
        f"{ways()[PRECISE].frames}. Not known, beside size, depth and modulus: the tissue's modulus "
        f"({percent(standard.tissue_modulus_spread_ratio)} %) and thickness "
        f"({percent(standard.thickness_spread_ratio)} %); of the skin its law of contact "
        f"({percent(standard.contact_law_spread_ratio)} %), the light it gives back "
        f"({percent(standard.albedo_spread_ratio)} %) and how far that spreads "
        f"({percent(standard.scattering_spread_ratio)} %); gain ({percent(standard.gain_spread_ratio)} %), force "
        f"({percent(standard.force_scale_spread_ratio)} %, and {percent(standard.force_error_ratio)} % of each press "
        f"by itself) and the cell's zero ({1e3 * standard.zero_spread_n:g} mN). To the camera's noise comes a smooth "
        f"error of {percent(standard.systematic_ratio)} % that no frame takes away (light or model). All numbers are "
        "standard deviations in per cent, of the logarithm. Above some 50 % they only say: not known.",
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
    yield from (
        _what_decides(scenes),
        _worst_direction(scenes),
        _with_box(found, boxed, scenes),
        _called_identifiable(scenes),
        "",
    )
    yield from _deepest(found)


def _what_decides(scenes: list[MappedScene]) -> str:
    """Say by how much the smooth error and the number of frames change the bounds."""
    smooth, frames = (" / ".join(f"{1 / x:.2g}" for x in factors(scenes, way)) for way in (NOT_SMOOTH, PRECISE))
    return (
        f"- The smooth error decides, not the camera: without it the bounds of size / depth / modulus would be "
        f"{smooth} times smaller; with four times the frames they are {frames} times smaller."
    )


def _worst_direction(scenes: list[MappedScene]) -> str:
    worst = [scene.limits[STANDARD].quoted.alone.worst_direction for scene in scenes]
    size, depth, modulus = np.median(worst, axis=0)
    return (
        f"- The direction known worst is nearly the modulus alone: (ln d, ln h, ln E) = ({size:+.2f}, {depth:+.2f}, "
        f"{modulus:+.2f}) in the median. A harder lump looks like a slightly larger and shallower one."
    )


def _with_box(found: Array, boxed: Array, scenes: list[MappedScene]) -> str:
    alone, together = (np.median(stds.reshape(-1, 3), axis=0) for stds in (found, boxed))
    box = np.median([scene.limits[STANDARD].box_std for scene in scenes], axis=0)
    return (
        f"- **Knowing the box helps size and depth, through the modulus**: if lumps come from {_box()}, the median "
        f"scene's size is known to {percent(together[0])} % and its depth to {percent(together[1])} % "
        f"({percent(alone[0])} and {percent(alone[1])} % without). The modulus is then known to "
        f"{percent(together[2])} %, where the box alone says {percent(box[2])} %."
    )


def _called_identifiable(scenes: list[MappedScene]) -> str:
    called = np.array([scene.limits[STANDARD].identifiable for scene in scenes])
    counts, always = called.sum(axis=0), np.all(called.reshape(-1, len(MODULI_KPA), 3), axis=1)
    return (
        "- The probe calls an unknown `identifiable` when its spread is under half of what the box alone leaves "
        "(`device/measurement/confidence.py`). An estimate as good as the bound with the box would be called so for "
        f"size in {counts[0]}, depth in {counts[1]} and modulus in {counts[2]} of {len(scenes)} scenes; whatever the "
        "modulus, for {} / {} / {} of {} pairs of size and depth.".format(*always.sum(axis=0), len(always))
    )


def _deepest(found: Array) -> Iterator[str]:
    yield from (
        f"Largest depth (mm) down to which it is known, whatever the modulus from {MODULI_KPA[0]:g} to "
        f"{MODULI_KPA[-1]:g} kPa, standard protocol, without the box:",
        "",
        "| size | size to 10 % | to 30 % | depth to 10 % | to 30 % | modulus to 10 % | to 30 % |",
        "|---|---|---|---|---|---|---|",
    )
    for i, size_mm in enumerate(SIZES_MM):
        worst_std = found[i].max(axis=1)
        cells = [_depth(deepest_mm(worst_std[:, k] <= level)) for k in range(3) for level in (WELL, ROUGHLY)]
        yield f"| {size_mm:g} mm | " + " | ".join(cells) + " |"
    yield ""


def _box() -> str:
    (d, h, E) = (RANGES[name] for name in UNKNOWNS)
    return f"{d.low:g}-{d.high:g} mm, {h.low:g}-{h.high:g} mm deep, {E.low:g}-{E.high:g} kPa"


def _ways(scenes: list[MappedScene]) -> Iterator[str]:
    yield from (
        "### Ways to measure, compared",
        "",
        "Bounds over those of the standard protocol: medians over all scenes, so 2 means twice as uncertain. "
        "Pressure and displacement stand for ideal sensors that show nothing else, with the same camera. The last "
        "column counts scenes in which the bounds of the two orders of elements differ by more than 20 %.",
        "",
        "| way | size | depth | modulus | scenes with size to 30 % | depth to 30 % | modulus to 30 % | orders apart |",
        "|---|---|---|---|---|---|---|---|",
    )
    for name in ways():
        found, apart = stds(scenes, name), sum(bool(scene.limits[name].not_converged) for scene in scenes)
        cells = [f"{factor:.2g}" for factor in factors(scenes, name)]
        cells += [str(count) for count in (found <= ROUGHLY).sum(axis=(0, 1, 2))]
        yield f"| {name} | " + " | ".join(cells) + f" | {apart} |"
    yield ""


def _tables(scenes: list[MappedScene]) -> Iterator[str]:
    both = np.array([[limit.alone.std for limit in s.limits[STANDARD].by_order.values()] for s in scenes])
    apart = both.max(axis=1) / both.min(axis=1) - 1
    yield from (
        "### All scenes",
        "",
        "Size / depth / modulus in per cent, of the measurement alone. Computed with elements of order "
        f"{' and of order '.join(map(str, ORDERS))} on the same mesh; the larger is shown, with ~ where they differ by "
        "more than 20 %: such a bound is known to that factor only. In the median they differ by "
        f"{percent(float(np.median(apart)))} %, at most by {percent(float(apart.max()))} %.",
        "",
    )
    for way in (STANDARD, PRECISE):
        yield from _table(scenes, way, with_box=False)
    yield from (
        f"With the box as prior ({_box()}, spread as in `device/measurement/press_parameters.py`). **Bold** where the "
        "probe would call an estimate as good as this `identifiable`. What is not bold here can honestly only be "
        "answered with 'not determined', by any method.",
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
        pairs = zip(found.std_with_box, found.identifiable, strict=True)
        return " / ".join(f"**{percent(std)}**" if narrow else percent(std) for std, narrow in pairs)
    return " / ".join(percent(std) for std in found.std) + (" ~" if found.not_converged else "")


def _closing() -> Iterator[str]:
    yield from (
        "### What the limits leave out",
        "",
        "- They hold for small errors about one scene, and for unbiased estimates; a bound of 200 % is no prediction "
        "of an error, only of ignorance.",
        "- The box enters as a Gaussian of the same spread about the lump itself. An estimate that also knows where "
        "the box ends errs less there.",
        "- With the box it is assumed that the image is a straight line over all of the box's moduli. It is not: a "
        "press that cannot tell 15 from 80 kPa cannot know which of these columns it is in, so the largest number of a "
        "row counts.",
        "- The law of the material (neo-Hookean), Poisson ratios, the probe's layers, the sphere's shape, and a "
        "lump on the axis are taken as known. Not knowing them makes everything worse.",
        "- The smooth error is assumed, not measured: 0.2 % of the light, correlated over 2 mm and alike at all loads, "
        "and again over 3 mm for each load by itself.",
        "- Deformation bends the light too, but by a hundredth of what pressure does, which cannot be told from the "
        "noise of the simulated probe's traced tables. It is left out; counted, it makes bounds up to twice smaller.",
        "- Size and depth move the mesh. What only the elements make of that cancels against the same press without "
        "the lump on the same mesh; without that, bounds came out up to 10 times too small.",
        "",
    )


def percent(ratio: float) -> str:
    """Return a ratio in per cent, to two digits."""
    return f"{100 * ratio:.2g}" if ratio < 0.995 else f"{100 * ratio:.0f}" if ratio <= MOST else ">1000"


def _depth(depth_mm: float | None) -> str:
    return "nowhere" if depth_mm is None else f"{depth_mm:g}"
