"""Figures of a solution: surface with and without the inclusion, the inclusion field, and the contact pressure."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")

from matplotlib import pyplot as plt

from host_tools.forward.solution import Solution


def plot_solution(solution: Solution, path: Path) -> None:
    """Write a figure of three panels to a PNG, PDF or SVG file."""
    r_mm, window_mm = solution.r_mm, 0.9 * solution.r_mm[-1]
    figure, panels = plt.subplots(1, 3, figsize=(12, 3.6), layout="constrained")
    panels[0].plot(r_mm, solution.w_mm, label="with inclusion")
    panels[0].plot(r_mm, solution.w_baseline_mm, "--", label="without")
    panels[0].set_ylabel("surface deformation w (mm)")
    panels[0].legend()
    panels[1].plot(r_mm, 1e3 * solution.inclusion_deformation_mm)
    panels[1].set_ylabel("inclusion field dw (µm)")
    panels[2].plot(r_mm, solution.p_kpa, label="with inclusion")
    panels[2].plot(r_mm, solution.p_baseline_kpa, "--", label="without")
    panels[2].set_ylabel("contact pressure p (kPa)")
    panels[2].set_ylim(0, 4 * solution.p_kpa[r_mm <= window_mm].max())  # the rim is singular
    for panel in panels:
        panel.set_xlabel("radius (mm)")
        panel.axvline(window_mm, color="0.8", lw=1, zorder=0)
        panel.grid(alpha=0.3)
    figure.savefig(path, dpi=120)
    plt.close(figure)
