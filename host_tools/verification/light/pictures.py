"""Traced images drawn on matplotlib figures: maps on one logarithmic scale, and profiles through the middle.

The scale of radiance is shared by all panels of a figure, so that brighter is brighter; colours of cividis read the
same to colour-blind eyes (Nunez et al., PLoS ONE 13:e0199239, 2018).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.colors import LogNorm, Normalize
from matplotlib.patches import Circle
from numpy.typing import NDArray

from host_tools.optics.traced import Traced
from host_tools.verification.light.scenes import FACE_RADIUS_MM

LINES = ("#000000", "#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9")
"""Colours told apart by colour-blind eyes (Okabe & Ito, 2008)."""
STYLES = ("-", "--", "-.", ":", (0, (5, 1)), (0, (3, 1, 1, 1)))
DECADES = 3
BAND_MM = 1.0
RADIANCE = "radiance (1/(sr mm²) per LED light)"


def draw_maps(figure: Any, images: Mapping[str, Traced], *, columns: int = 3) -> None:
    """Draw images by label side by side, on one scale of three decades below the brightest cell."""
    peak = max(float(found.radiance.max()) for found in images.values())
    norm = LogNorm(peak * 10.0**-DECADES, peak, clip=True)
    panels = _panels(figure, len(images), columns)
    for panel, (label, found) in zip(panels.flat, images.items(), strict=True):
        shown = draw_map(panel, label, found.radiance, _reach_mm(found), norm)
    figure.colorbar(shown, ax=panels, shrink=0.8).set_label(RADIANCE, fontsize=8)


def _panels(figure: Any, count: int, columns: int) -> Any:
    panels = figure.subplots(-(-count // columns), columns, sharex=True, sharey=True, squeeze=False)
    for panel in panels[-1]:
        panel.set_xlabel("x (mm)")
    for panel in panels[:, 0]:
        panel.set_ylabel("y (mm)")
    return panels


def _reach_mm(found: Traced) -> float:
    return float(found.x_mm[-1] + (found.x_mm[1] - found.x_mm[0]) / 2)


def draw_map(
    panel: Any,
    title: str,
    values: NDArray[np.float64],
    reach_mm: float,
    norm: Normalize,
    colours: str = "cividis",
    edge: str = "white",
) -> Any:
    """Draw one image [ny, nx] of +- `reach_mm` with the edge of the round face; return what a colour bar needs."""
    floor = norm.vmin if isinstance(norm, LogNorm) and norm.vmin is not None else -np.inf
    extent = (-reach_mm, reach_mm, -reach_mm, reach_mm)
    shown = panel.imshow(
        np.maximum(values, floor), norm=norm, cmap=colours, origin="lower", extent=extent, interpolation="nearest"
    )
    panel.add_patch(Circle((0, 0), FACE_RADIUS_MM, fill=False, color=edge, lw=0.8, ls=":"))
    panel.set_title(title, fontsize=9)
    panel.set_xticks([-10, 0, 10])
    panel.set_yticks([-10, 0, 10])
    return shown


def middle(found: Traced) -> NDArray[np.float64]:
    """Return the profile along x through the middle of the face, the mean of a band."""
    return np.asarray(found.radiance[np.abs(found.y_mm) < BAND_MM].mean(axis=0))


def draw_profiles(figure: Any, images: Mapping[str, Traced]) -> None:
    """Draw the profiles of images by label."""
    axes = figure.subplots()
    for (label, found), colour, style in zip(images.items(), LINES, STYLES, strict=False):
        axes.plot(found.x_mm, 1e5 * middle(found), color=colour, ls=style, label=label)
    axes.set_xlabel("x (mm)")
    axes.set_ylabel("radiance (10⁻⁵ / (sr mm²) per LED light)")
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8, loc="center left", bbox_to_anchor=(1.0, 0.5))
