"""Panels of choices as a table and as a figure: every point, the front through them, the chosen one ringed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from device.measurement.estimate import SPOKEN
from device.measurement.quantities import UNKNOWNS
from host_tools.pages.benchmark import Figure, Table
from host_tools.tradeoff.pareto import Choice, front, needless

COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00")
"""Colours told apart by colour-blind eyes (Okabe & Ito, 2008)."""
MARKERS = "osD^v*"
COST = "time (yardsticks)"
CLOSE = 0.07
"""Of two points no further apart than this share of a panel, either way, one is named."""
LETTER = 0.016
"""Width of a name's letter in widths of a panel: so much room is left of the first point."""
SUBDIVISIONS = ((5.0, tuple(map(float, range(1, 10)))), (100.0, (1.0, 2.0, 5.0)))
"""Numbers a decade of an axis that spans at most this ratio; one of any other."""


@dataclass(frozen=True)
class Panel:
    """Choices that compete with each other, under a title; `error` names the axis with its unit."""

    title: str
    error: str
    choices: tuple[Choice, ...]


def unknown_panels(points: Sequence[Sequence[Choice]], kind: str = "") -> list[Panel]:
    """Return a panel for each unknown; every way to do a thing has a point [3] for each of them."""
    titles = (f"{SPOKEN[name]}{kind}" for name in UNKNOWNS)
    return [Panel(title, "median error (%)", tuple(one[i] for one in points)) for i, title in enumerate(titles)]


def front_table(caption: str, panels: Sequence[Panel], digits: int = 3) -> Table:
    """Return every choice of every panel, by rising cost."""
    rows = []
    for panel in panels:
        best, beaten = front(panel.choices), needless(panel.choices)
        for one in sorted(panel.choices, key=lambda choice: choice.cost):
            place = "front" if one in best else "beaten" if one in beaten else "near"
            name = f"**{one.name}**" if one.chosen else one.name
            rows.append((panel.title, one.family, name, _short(one.cost, digits), _short(one.error, digits), place))
    return Table(caption, ("", "family", "choice", COST, "error", ""), tuple(rows))


def _short(value: float, digits: int) -> str:
    return f"{value:.{digits}g}" if value < 10**digits else f"{value:.0f}"


def front_figure(name: str, caption: str, panels: Sequence[Panel], columns: int = 3) -> Figure:
    """Return the panels side by side, both axes logarithmic."""
    rows = -(-len(panels) // columns)
    size_in = (3.6 * min(columns, len(panels)) + 0.4, 3.1 * rows + 0.5)
    return Figure(name, caption, lambda canvas: _draw(canvas, panels, rows, min(columns, len(panels))), size_in)


def _draw(figure: Any, panels: Sequence[Panel], rows: int, columns: int) -> None:
    families = list(dict.fromkeys(one.family for panel in panels for one in panel.choices))
    styles = dict(zip(families, zip(COLOURS, MARKERS, strict=True), strict=False))
    cells = figure.subplots(rows, columns, squeeze=False).flat
    for axes, panel in zip(cells, panels, strict=False):
        _draw_panel(axes, panel, styles)
    for axes in list(cells)[len(panels) :]:
        axes.set_visible(False)
    handles = {label: handle for axes in figure.axes for handle, label in zip(*axes.get_legend_handles_labels())}  # noqa: B905
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=4, fontsize=8, frameon=False)


def _draw_panel(axes: Any, panel: Panel, styles: Mapping[str, tuple[str, str]]) -> None:
    for family in dict.fromkeys(one.family for one in panel.choices):
        of_family = [one for one in panel.choices if one.family == family]
        colour, marker = styles[family]
        axes.plot([p.cost for p in of_family], [p.error for p in of_family], marker, color=colour, ms=5, label=family)
    best = front(panel.choices)
    axes.step([p.cost for p in best], [p.error for p in best], where="post", color="#000000", lw=0.9, label="front")
    chosen = [one for one in panel.choices if one.chosen]
    ring = {"mfc": "none", "mec": "#d00000", "ms": 12, "mew": 1.6}
    if chosen:
        axes.plot([p.cost for p in chosen], [p.error for p in chosen], "o", label="chosen", **ring)
    for one in _named(panel):  # no point lies below and left of one of the front: there is room for its name
        below_left = {"xytext": (-4, -3), "textcoords": "offset points", "ha": "right", "va": "top"}
        axes.annotate(one.name, (one.cost, one.error), fontsize=6.5, **below_left)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.margins(x=0.1 + LETTER * max(len(one.name) for one in best), y=0.2)
    for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
        _number(axis, low, high)
    axes.set_title(panel.title, fontsize=9)
    axes.set_xlabel(COST, fontsize=8)
    axes.set_ylabel(panel.error, fontsize=8)
    axes.tick_params(labelsize=7)
    axes.grid(alpha=0.3, which="both", lw=0.4)


def _named(panel: Panel) -> list[Choice]:
    """Return the points of a panel's front that are named: of neighbours the chosen one, else the first."""
    named: list[Choice] = []
    spans = [max(np.ptp(np.log([_place(one)[i] for one in panel.choices])), 1e-9) for i in range(2)]
    for one in sorted(front(panel.choices), key=lambda choice: not choice.chosen):
        apart = [np.abs(np.log(_place(one)) - np.log(_place(other))) / spans for other in named]
        if all(distance.max() > CLOSE for distance in apart):
            named.append(one)
    return named


def _place(one: Choice) -> tuple[float, float]:
    return one.cost, one.error


def _number(axis: Any, low: float, high: float) -> None:
    """Write plain numbers at decades, and between them where an axis spans few."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    subdivisions = next((parts for ratio, parts in SUBDIVISIONS if high <= ratio * low), (1.0,))
    axis.set_major_locator(LogLocator(subs=subdivisions, numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, place: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())
