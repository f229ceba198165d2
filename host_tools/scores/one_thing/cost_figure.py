"""What each thing costs, as a figure: a line for each, errors and coverage side by side, the modes apart by colour."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from host_tools.pages.benchmark import Figure
from host_tools.scores.scored_presses import ScoredPresses

COLOURS = {"quick": "#e69f00", "standard": "#0072b2", "precise": "#009e73"}
"""Colours told apart by colour-blind eyes (Okabe & Ito, 2008)."""
MARKERS = {"quick": "s", "standard": "o", "precise": "D"}
PANELS = "size RMSE (mm)", "depth RMSE (mm)", "covered, the less of both (%)", "answered (%)"


def cost_figure(
    file_name: str, names: Sequence[str], found: Mapping[str, Sequence[ScoredPresses]], bounds: tuple[float, float]
) -> Figure:
    """Return the figure of things by name and each mode's presses with them; `bounds` of coverage and of answers."""

    def draw(canvas: Any) -> None:
        panels = canvas.subplots(1, len(PANELS), sharey=True)
        at = np.arange(len(names))
        for mode, of_mode in found.items():
            values = np.array([_values(one) for one in of_mode])
            for axes, column in zip(panels, values.T, strict=True):
                axes.plot(column, at, MARKERS[mode], color=COLOURS[mode], markersize=4.5, label=mode, linestyle="none")
        for axes, title in zip(panels, PANELS, strict=True):
            axes.set_xlabel(title, fontsize=8)
            axes.tick_params(labelsize=7)
            axes.grid(axis="y", linewidth=0.4, color="0.85")
        for axes, bound in zip(panels[2:], bounds, strict=True):
            axes.axvline(100 * bound, color="0.4", linewidth=0.8, linestyle="--")
        panels[0].set_yticks(at, names)
        panels[0].set_ylim(len(names) - 0.5, -0.5)
        handles, labels = panels[0].get_legend_handles_labels()
        canvas.legend(handles, labels, loc="outside lower center", ncols=len(found), fontsize=8, frameon=False)

    caption = "What each thing alone costs: errors, coverage and answers of each mode; dashed: what is asked for"
    return Figure(file_name, caption, draw, (10.0, 1.2 + 0.24 * len(names)))


def _values(found: ScoredPresses) -> tuple[float, float, float, float]:
    """Return what the panels show of presses; nothing where none is answered."""
    answered = 100 * found.share_answered()
    if not answered:
        return np.nan, np.nan, np.nan, answered
    size_mm, depth_mm = map(float, np.sqrt((found.error_mm() ** 2).mean(axis=0)))
    return size_mm, depth_mm, 100 * float(np.nanmin(found.determined_covered())), answered
