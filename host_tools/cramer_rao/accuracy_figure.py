"""The map of bounds to the figure of docs/accuracy.md: one panel for each unknown and modulus, depth over size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.colors import LogNorm

from device.measurement.arrays import Array
from host_tools.cramer_rao.accuracy_map import DEPTHS_MM, MODULI_KPA, SIZES_MM, STANDARD, MappedScene, stds
from host_tools.cramer_rao.accuracy_page import NAMES, ROUGHLY
from host_tools.pages.page import percent


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


def _draw_panel(panel: Any, found: Array) -> Any:
    """Draw one unknown and modulus, depth downwards over size."""
    image = panel.imshow(found, norm=LogNorm(1, 300), cmap="RdYlGn_r", aspect="auto")
    for (row, column), value in np.ndenumerate(found):
        weight = "bold" if value <= 100 * ROUGHLY else "normal"
        panel.text(column, row, percent(value / 100), ha="center", va="center", fontsize=9, weight=weight)
    panel.set_xticks(range(len(SIZES_MM)), [f"{size:g}" for size in SIZES_MM])
    panel.set_yticks(range(len(DEPTHS_MM)), [f"{depth:g}" for depth in DEPTHS_MM])
    return image
