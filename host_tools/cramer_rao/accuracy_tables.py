"""The map of bounds to the tables of docs/accuracy.md: every scene, by the order of the elements, and inside the box.

The larger bound of both orders counts; where they are apart, both are shown beside each other.

Bounds of one inclusion over its modulus to how often a press of it determines the modulus, the ends of the box
included.

A Cramer-Rao bound is a straight line about one modulus and knows no ends. Here the modulus runs along a line on which
every step of one is as visible as any other, by its bound there, and its posterior ends where the box ends; size and
depth are known as the Gaussian box says. Source: the line is Rao's distance, Bull. Calcutta Math. Soc. 37 (1945).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from device.measurement.arrays import Array
from device.measurement.confidence_belt import IDENTIFIABLE_RATIO
from device.measurement.parameters import EVEN_STD, RANGES
from device.measurement.quantities import UNKNOWNS
from host_tools.cramer_rao.accuracy_map import MODULI_KPA, PRECISE, STANDARD, MappedScene
from host_tools.cramer_rao.bounds import Limits
from host_tools.cramer_rao.press_bound import OFFSETS_MM
from host_tools.forward.derivatives.sensitive_presses import ORDERS

MODULUS = UNKNOWNS.index("youngs_modulus_kpa")
BOX = RANGES["youngs_modulus_kpa"]
LN_MODULUS: Array = np.linspace(np.log(BOX.low), np.log(BOX.high), 401)
"""Where the posterior is computed; even in it is how the box spreads inclusions."""
NARROW = IDENTIFIABLE_RATIO * EVEN_STD * float(LN_MODULUS[-1] - LN_MODULUS[0]) / 2
"""The spread of ln E under which the probe calls the modulus identifiable."""
ERRORS: Array = np.linspace(-4.0, 4.0, 321)
"""Errors of a press in standard deviations, and how often each occurs."""
OFTEN: Array = np.exp(-(ERRORS**2) / 2) / np.exp(-(ERRORS**2) / 2).sum()
LEAST_INFORMATION = 1e-6
"""Less of ln E is nothing: it is known to a factor of e to the 1000."""


def std_of_modulus(found: Limits) -> float:
    """Return the bound of ln E when only size and depth are held by the Gaussian box.

    A prior of the modulus adds to its own information, so taking it away again is a subtraction.
    """
    information = found.std_with_box[MODULUS] ** -2 - found.box_std[MODULUS] ** -2
    return float(max(information, LEAST_INFORMATION) ** -0.5)


def visible_line(moduli_kpa: Sequence[float], std: Array) -> Array:
    """Return places [n] of `LN_MODULUS` on the line, from bounds [M] of ln E at rising moduli [M].

    Between them the logarithm of the bound is straight in ln E, and beyond them it goes on so.
    """
    at, log_std = np.log(moduli_kpa), np.log(std)
    slope = np.diff(log_std) / np.diff(at)
    piece = np.clip(np.searchsorted(at, LN_MODULUS) - 1, 0, len(slope) - 1)
    density = np.exp(-(log_std[piece] + slope[piece] * (LN_MODULUS - at[piece])))
    steps = (density[1:] + density[:-1]) / 2 * np.diff(LN_MODULUS)
    return np.concatenate([[0.0], np.cumsum(steps)])


def posterior_spread(line: Array, seen: Array) -> Array:
    """Return the standard deviations [m] of ln E when presses show places [m] on the line [n], with an error of one."""
    weight = np.exp(-((line[:, None] - seen) ** 2) / 2 + np.min((line[:, None] - seen) ** 2, axis=0) / 2)
    weight /= weight.sum(axis=0)
    mean = LN_MODULUS @ weight
    return np.asarray(np.sqrt(np.sum((LN_MODULUS[:, None] - mean) ** 2 * weight, axis=0)))


def determined_share(line: Array, modulus_kpa: float) -> float:
    """Return in which share of presses of an inclusion of this modulus its posterior is narrow enough for the probe."""
    place = np.interp(np.log(modulus_kpa), LN_MODULUS, line)
    return float(OFTEN @ (posterior_spread(line, place + ERRORS) < NARROW))


ONE_SIDED_KPA = 60.0
"""An example of what an image may rule out below."""
MOST = 10.0
"""Bounds beyond 1000 % are not written out."""
NAMES = ("size", "depth", "modulus")


def percent(ratio: float) -> str:
    """Return a ratio in per cent, to two digits."""
    return f"{100 * ratio:.2g}" if ratio < 0.995 else f"{100 * ratio:.0f}" if ratio <= MOST else ">1000"


def box_in_words() -> str:
    """Return the ranges of size, depth and modulus that inclusions come from."""
    (d, h, E) = (RANGES[name] for name in UNKNOWNS)
    return f"{d.low:g}-{d.high:g} mm, {h.low:g}-{h.high:g} mm deep, {E.low:g}-{E.high:g} kPa"


def tables(scenes: list[MappedScene], beside: Array) -> Iterator[str]:
    """Yield the lines of the chapters that show all scenes; `beside` is of `beside_axis.beside_over_axis`."""
    yield from _alone(scenes)
    yield from _orders(scenes)
    yield from _with_box(scenes)
    yield from _determined(scenes)
    yield from _beside_axis(beside)


def _alone(scenes: list[MappedScene]) -> Iterator[str]:
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


def _orders(scenes: list[MappedScene]) -> Iterator[str]:
    """Yield both orders beside each other for the scenes that are marked with ~."""
    low, high = ORDERS
    yield from (
        "### Where the orders are apart",
        "",
        f"Each scene marked with ~, in per cent: elements of order {low} | of order {high}. Where the finer one is the "
        "larger, the coarser took errors of its elements for knowledge of the inclusion.",
        "",
        "| way, scene | " + " | ".join(f"{name}, order {order}" for name in NAMES for order in ORDERS) + " |",
        "|---" * (1 + len(NAMES) * len(ORDERS)) + "|",
    )
    for way in (STANDARD, PRECISE):
        for scene in scenes:
            if scene.limits[way].not_converged:
                size_mm, depth_mm, modulus_kpa = scene.inclusion
                both = np.array([scene.limits[way].by_order[order].alone.std for order in ORDERS])
                cells = " | ".join(percent(std) for std in both.T.ravel())
                yield f"| {way}, {size_mm:g} mm, {depth_mm:g} mm deep, {modulus_kpa:g} kPa | {cells} |"
    yield ""


def _with_box(scenes: list[MappedScene]) -> Iterator[str]:
    yield from (
        "### With the box",
        "",
        f"The box as prior ({box_in_words()}, spread as in `device/measurement/parameters.py`), as a Gaussian "
        "about the inclusion itself. **Bold** where the probe would call an estimate as good as this `identifiable`. What "
        "is not bold is not determined by an answer as wide as this Gaussian, about an inclusion on the axis. That is no "
        "limit of every answer: a real one knows where the box ends, and an inclusion beside the axis is another scene. "
        "What both change for the modulus is said below.",
        "",
    )
    yield from _table(scenes, STANDARD, with_box=True)


def _determined(scenes: list[MappedScene]) -> Iterator[str]:
    rows = [_row_determined(row) for row in rows_of(scenes)]
    bold = np.array([[s.limits[STANDARD].identifiable[MODULUS] for s in row] for row in rows_of(scenes)])
    yield from (
        "### The modulus, with the ends of the box",
        "",
        f"An image of a hard inclusion that only rules out what is softer than {ONE_SIDED_KPA:g} kPa leaves "
        f"{ONE_SIDED_KPA:g}-{BOX.high:g} kPa: {percent(_one_sided_share())} % of the box's spread, less than half of "
        "it, so it is called `identifiable`. That is knowledge of one side, but true. At the very end of the box a "
        f"posterior is {(1 - 2 / math.pi) ** 0.5:.2f} times as wide as the same Gaussian without ends. Between the "
        "ends it may be too wide where the table above is bold, since a hard inclusion looks much like a harder one.",
        "",
        "In per cent of presses: how often the posterior of the modulus, with the ends of the box, would be called "
        "`identifiable`. It is followed over the whole box with the bound of each column in its place "
        "(`host_tools/cramer_rao/accuracy_tables.py`); size and depth are held as in the table above.",
        "",
        *_head("Standard, modulus determined"),
    )
    for row, shares in zip(rows_of(scenes), rows, strict=True):
        yield f"| {_inclusion(row)} | " + " | ".join(f"{100 * share:.0f}" for share in shares) + " |"
    yield "| mean | " + " | ".join(f"{100 * share:.0f}" for share in np.mean(rows, axis=0)) + " |"
    yield "| bold in the table above | " + " | ".join(f"{100 * share:.0f}" for share in bold.mean(axis=0)) + " |"
    yield ""


def _one_sided_share() -> float:
    """Return the spread of an even ln E above `ONE_SIDED_KPA` over that of all of the box."""
    return math.log(BOX.high / ONE_SIDED_KPA) / math.log(BOX.high / BOX.low)


def _beside_axis(beside: Array) -> Iterator[str]:
    ratios = np.quantile(beside, [0.0, 0.5, 1.0], axis=1).transpose(1, 2, 0)
    yield from (
        "### The modulus, beside the axis",
        "",
        "All the scenes above lie on the probe's axis, which a press hardly ever meets. Beside it one side of the face "
        "is brighter, and how that falls off with the radius is a second look at the inclusion, with smooth errors of its "
        "own: of some inclusions' modulus it tells more than the unknown place costs, of others' less. By the polynomials "
        "and the noise that mode standard believes in (`models/standard`), with the box as prior: bound of the modulus "
        "over the same on the axis, smallest / median / largest of the pairs of size and depth "
        "(`host_tools/cramer_rao/press_bound.py`). Only ratios, since that model is not the one of the bounds above: it is "
        "made of the simulated probe's tables. Inclusions up to 2 mm beside the axis are what [the modes](modes.md) are "
        "scored on, so these may call the modulus determined where no inclusion on the axis is bold.",
        "",
        *_head("beside the axis"),
    )
    for offset_mm, row in zip(OFFSETS_MM, ratios, strict=True):
        yield f"| {offset_mm:g} mm | " + " | ".join(" / ".join(f"{x:.2f}" for x in cell) for cell in row) + " |"
    yield ""


def _row_determined(row: list[MappedScene]) -> list[float]:
    line = visible_line(MODULI_KPA, np.array([std_of_modulus(scene.limits[STANDARD]) for scene in row]))
    return [determined_share(line, modulus_kpa) for modulus_kpa in MODULI_KPA]


def rows_of(scenes: list[MappedScene]) -> list[list[MappedScene]]:
    """Return the scenes by size and depth, each with all its moduli."""
    return [scenes[i : i + len(MODULI_KPA)] for i in range(0, len(scenes), len(MODULI_KPA))]


def _table(scenes: list[MappedScene], way: str, *, with_box: bool) -> Iterator[str]:
    yield from _head(way.capitalize() + (", with the box as prior" if with_box else ", measurement alone"))
    for row in rows_of(scenes):
        yield f"| {_inclusion(row)} | " + " | ".join(_cell(s, way, with_box) for s in row) + " |"
    yield ""


def _head(title: str) -> tuple[str, str]:
    columns = " | ".join(f"{modulus:g} kPa" for modulus in MODULI_KPA)
    return f"| {title} | {columns} |", "|---" * (len(MODULI_KPA) + 1) + "|"


def _inclusion(row: list[MappedScene]) -> str:
    size_mm, depth_mm, _ = row[0].inclusion
    return f"{size_mm:g} mm, {depth_mm:g} mm deep"


def _cell(scene: MappedScene, way: str, with_box: bool) -> str:
    found = scene.limits[way]
    if with_box:
        pairs = zip(found.std_with_box, found.identifiable, strict=True)
        return " / ".join(f"**{percent(std)}**" if narrow else percent(std) for std, narrow in pairs)
    return " / ".join(percent(std) for std in found.std) + (" ~" if found.not_converged else "")
