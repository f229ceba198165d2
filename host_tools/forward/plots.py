"""Figures of a solution: the face with and without the inclusion, what the inclusion adds, and the contact pressure.

Over the radius where every section is the same, otherwise through the whole face along its first ray, +x or towards
the inclusion.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

from device.measurement.arrays import Array
from host_tools.forward.deformation import CENTRAL_RATIO
from host_tools.forward.solution import Solution

SIZE_IN = (12.0, 3.6)
DPI = 120


def plot_solution(solution: Solution) -> Figure:
    """Return a figure of three panels, made by pyplot: a notebook shows it, and `plt.show()` does."""
    figure = plt.figure(figsize=SIZE_IN, layout="constrained")
    _draw(figure, solution)
    return figure


def write_plot(solution: Solution, path: Path) -> None:
    """Write the figure to a PNG, PDF or SVG file."""
    _unseen(solution).savefig(path, dpi=DPI)


def png_of(solution: Solution, *, dpi: int = 60) -> bytes:
    """Return the figure as a small PNG."""
    file = BytesIO()
    _unseen(solution).savefig(file, format="png", dpi=dpi)
    return file.getvalue()


def _unseen(solution: Solution) -> Figure:
    """Return a figure that pyplot does not know, so that no window shows it and none needs to be closed."""
    figure = Figure(figsize=SIZE_IN, layout="constrained")
    _draw(figure, solution)
    return figure


def _draw(figure: Figure, solution: Solution) -> None:
    x_mm, window_mm = _places_mm(solution), CENTRAL_RATIO * solution.r_mm[-1]
    w_mm, baseline_mm = (_section(state.w_mm) for state in (solution.pressed, solution.baseline))
    p_kpa, baseline_kpa = (_section(state.p_kpa) for state in (solution.pressed, solution.baseline))
    panels = figure.subplots(1, 3)
    panels[0].plot(x_mm, w_mm, label="with inclusion")
    panels[0].plot(x_mm, baseline_mm, "--", label="without")
    panels[0].set_ylabel("surface deformation w (mm)")
    panels[0].legend()
    panels[1].plot(x_mm, 1e3 * (w_mm - baseline_mm))
    panels[1].set_ylabel("what the inclusion adds, dw (µm)")
    panels[2].plot(x_mm, p_kpa, label="with inclusion")
    panels[2].plot(x_mm, baseline_kpa, "--", label="without")
    panels[2].set_ylabel("contact pressure p (kPa)")
    panels[2].set_ylim(0, 4 * p_kpa[np.abs(x_mm) <= window_mm].max())  # the rim is singular
    for panel in panels:
        panel.set_xlabel(_axis_name(solution))
        for edge_mm in {window_mm, max(-window_mm, float(x_mm[0]))} - {0.0}:
            panel.axvline(edge_mm, color="0.8", lw=1, zorder=0)
        panel.grid(alpha=0.3)


def _places_mm(solution: Solution) -> Array:
    """Return where the section is sampled: radii, or x from one rim to the other."""
    rays = solution.rays
    if len(rays.angle_rad) == 1:
        return np.asarray(rays.r_mm[0])
    ahead, behind = _ahead_and_behind(len(rays.angle_rad))
    return np.concatenate([-rays.r_mm[behind, :0:-1], rays.r_mm[ahead]])


def _axis_name(solution: Solution) -> str:
    angle_rad = solution.rays.angle_rad
    if len(angle_rad) == 1:
        return "radius (mm)"
    return "x (mm)" if angle_rad[0] == 0 else f"{np.rad2deg(angle_rad[0]):.0f} degrees from x (mm)"


def _section(field: Array) -> Array:
    """Return a field [A, R] at those places."""
    if len(field) == 1:
        return np.asarray(field[0])
    ahead, behind = _ahead_and_behind(len(field))
    return np.concatenate([field[behind, :0:-1], field[ahead]])


def _ahead_and_behind(angles: int) -> tuple[int, int]:
    """Return the first ray, in whose direction a turned scene has its inclusion, and the one against it."""
    return 0, angles // 2
