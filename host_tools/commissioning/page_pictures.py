"""Pictures of a commissioning: what the fit leaves of each ramp, the probe against its tolerances, phantoms left out.

Each is an SVG of its own, with its words as text. Maps diverge from white on one scale, blue below and red above
(ColorBrewer's RdBu); lines are told apart by shape, too: both are read by colour-blind eyes and on a grey printer.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import StringIO
from typing import Any

import matplotlib
import numpy as np
from matplotlib.figure import Figure as Canvas

from device.measurement.arrays import Array
from device.measurement.confidence_belt import COVERAGE
from device.measurement.quantities import UNKNOWNS
from device.measurement.ramp_modes.commissioned.discrepancy import Discrepancy
from device.measurement.ramp_modes.commissioned.row_derivatives import NAMES
from device.measurement.ramp_modes.intervals import CHI_SQUARE_90
from device.measurement.ramp_modes.radial_profile import CONTRAST, PROFILE_FORCES_N, RESPONSE
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RINGS
from host_tools.commissioning.joint_fit import FLOOR, PROBE, ProbeFit
from host_tools.commissioning.left_out import LeftOut
from host_tools.commissioning.probe_prior import LABELS
from host_tools.press_models.mode_outcome import EvaluatedPresses

WIDTH_IN = 7.6
FOUND, STATED, MISSED = "#0072b2", "#b0b0b0", "#d55e00"
"""Colours told apart by colour-blind eyes (Okabe & Ito, 2008), and a grey."""
HALF_WIDTH_STD = float(np.sqrt(CHI_SQUARE_90))
"""Half of a 90 % interval of a normal distribution, in standard deviations."""
ACROSS = 3
MAPS_LEFT_IN, MAPS_LINE_IN, FORCE_IN = 0.55, 1.65, 0.14
"""Left of the maps, from one line of them to the next, and the height of one force."""
SCALE_QUANTILE = 0.99
"""The scale of the maps holds so many of their cells; ends beyond it are drawn as the ends."""
UNKNOWN_LABELS = dict(zip(UNKNOWNS, ("size (mm)", "depth (mm)", "Young's modulus (kPa)"), strict=True))


def svg(name: str, height_in: float, draw: Callable[[Any], None]) -> str:
    """Return what `draw` puts on a canvas as one SVG element without metadata; `name` keeps its inner names its own."""
    with matplotlib.rc_context({"svg.hashsalt": name, "svg.fonttype": "none", "font.size": 8, "axes.linewidth": 0.6}):
        canvas = Canvas(figsize=(WIDTH_IN, height_in), layout="constrained")
        draw(canvas)
        text = StringIO()
        canvas.savefig(text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
    return text.getvalue()[text.getvalue().index("<svg") :]


def residual_maps(names: Sequence[str], left_ratio: Array) -> str:
    """Return maps, ring over force, of what the fit leaves of each ramp [n, contrast and response], in permille."""
    permille = 1000 * left_ratio
    end = max(0.1, float(np.nanquantile(np.abs(permille), SCALE_QUANTILE)))
    height_in = MAPS_LINE_IN * -(-len(names) // ACROSS) + 0.85

    def draw(canvas: Any) -> None:
        canvas.set_layout_engine("none")
        for number, (name, one) in enumerate(zip(names, permille, strict=True)):
            line, column = divmod(number, ACROSS)
            upper, lower = (_panel(canvas, line, column, below) for below in (False, True))
            upper.set_title(name, fontsize=8.5, fontweight="bold", loc="left", parse_math=False)
            _map(upper, one[CONTRAST], end, "contrast")
            shown = _map(lower, one[RESPONSE], end, "response")
            upper.tick_params(labelbottom=False)
            if number + ACROSS >= len(names):
                lower.set_xlabel("ring (mm from the middle)", fontsize=7.5)
            if column == 0:
                upper.set_ylabel("force (N)", fontsize=7.5)
        axes = canvas.add_axes((0.25, 0.42 / height_in, 0.5, 0.11 / height_in))
        bar = canvas.colorbar(shown, cax=axes, orientation="horizontal", extend="both")
        bar.set_label("seen less explained, permille of the light", fontsize=8)

    return svg("residuals", height_in, draw)


def _panel(canvas: Any, line: int, column: int, below: bool) -> Any:
    """Return axes for a map of the contrast, or of the response `below` it, all forces equally high."""
    height_in = canvas.get_figheight()
    width_in = (WIDTH_IN - MAPS_LEFT_IN) / ACROSS
    top_in = line * MAPS_LINE_IN + (0.24 + 4 * FORCE_IN + 0.17 if below else 0.24)
    high_in = (3 if below else 4) * FORCE_IN
    place = MAPS_LEFT_IN + column * width_in, height_in - top_in - high_in, width_in - 0.42, high_in
    return canvas.add_axes(np.divide(place, (WIDTH_IN, height_in, WIDTH_IN, height_in)))


def _map(panel: Any, cells: Array, end: float, what: str = "") -> Any:
    """Draw one map of cells [forces x rings], and how large `what` is; return what a colour bar needs."""
    of_force = cells.reshape(-1, RINGS)
    rings = np.append(RING_RADII_MM, RING_RADII_MM[-1] + RING_MM) - RING_MM / 2
    shown = panel.pcolormesh(
        rings,
        np.arange(len(of_force) + 1) - 0.5,
        of_force,
        vmin=-end,
        vmax=end,
        cmap="RdBu_r",
        edgecolors="face",
        lw=0.2,
    )
    panel.set_yticks(range(len(of_force)), [f"{force:.2f}" for force in PROFILE_FORCES_N[: len(of_force)]])
    panel.set_xticks([0, 3, 6, 9])
    panel.tick_params(labelsize=6.5, length=2)
    if np.isnan(of_force).all():
        panel.set_facecolor("0.94")
        panel.text(0.5, 0.5, "bare block: no contrast", transform=panel.transAxes, ha="center", va="center", fontsize=7)
    elif what:
        rms = float(np.sqrt(np.mean(of_force**2)))
        panel.set_title(f"{what} {rms:.1f} rms", fontsize=7, loc="right", pad=3.5)
    return shown


def lacking_maps(discrepancy: Discrepancy) -> str:
    """Return what was learned that the forward model lacks, in the middle of skin and tissue."""

    def draw(canvas: Any) -> None:
        for panel, columns, factor, title in zip(
            canvas.subplots(1, 2),
            (CONTRAST, RESPONSE),
            (100, 1000),
            ("contrast: % of what an inclusion does", "reference force response: permille of the light"),
            strict=True,
        ):
            cells = factor * discrepancy.mean[0, columns]
            shown = _map(panel, cells, max(0.1, float(np.abs(cells).max())))
            panel.set_title(title, fontsize=8, loc="left")
            panel.set_xlabel("ring (mm from the middle)")
            canvas.colorbar(shown, ax=panel)
        canvas.axes[0].set_ylabel("force (N)")

    return svg("lacking", 1.7, draw)


def probe_posterior(fit: ProbeFit) -> str:
    """Return each direction of the probe, its mean and 90 % interval beside its tolerance, in tolerances."""
    std, tolerance = np.sqrt(np.diag(fit.covariance)), fit.prior.std[PROBE]
    at, mean = np.arange(len(PROBE)), fit.tolerances_away

    def draw(canvas: Any) -> None:
        panel = canvas.subplots()
        panel.axvspan(-HALF_WIDTH_STD, HALF_WIDTH_STD, color="0.9", label="tolerance, 90 %")
        panel.axvline(0, color="0.6", lw=0.6)
        believed = HALF_WIDTH_STD * np.maximum(std / tolerance, FLOOR)
        panel.errorbar(mean, at, xerr=believed, fmt="none", ecolor=FOUND, lw=1, capsize=3, label="believed, 90 %")
        found = HALF_WIDTH_STD * std / tolerance
        panel.errorbar(mean, at, xerr=found, fmt="o", color=FOUND, ms=5, lw=4, label="told by the phantoms, 90 %")
        panel.set_yticks(at, [LABELS[NAMES[number]] for number in PROBE])
        panel.set_ylim(len(at) - 0.5, -0.5)
        farthest = max(3.0, float(np.max(np.abs(mean) + believed)) * 1.05)
        panel.set_xlim(-farthest, farthest)
        panel.set_xlabel("found less expected, in standard deviations of the tolerance")
        canvas.legend(loc="outside upper center", ncols=3, frameon=False, fontsize=7.5)

    return svg("posterior", 1.0 + 0.28 * len(PROBE), draw)


def left_out_intervals(phantoms: Sequence[LeftOut]) -> str:
    """Return the 90 % interval of each unknown of each phantom left out beside its stated truth."""

    def draw(canvas: Any) -> None:
        panels = canvas.subplots(1, len(UNKNOWNS), sharey=True)
        for place, (panel, label) in enumerate(zip(panels, UNKNOWN_LABELS.values(), strict=True)):
            for at, one in enumerate(phantoms):
                _interval(panel, at, one, place)
            panel.set_xlabel(label)
            panel.grid(axis="y", lw=0.4, color="0.9")
        panels[0].set_yticks(range(len(phantoms)), [one.name for one in phantoms], parse_math=False)
        panels[0].set_ylim(len(phantoms) - 0.4, -0.6)
        panels[2].set_xscale("log")
        panels[2].set_xticks([10, 20, 50, 100, 160], ["10", "20", "50", "100", "160"])
        panels[2].minorticks_off()
        _legend(canvas, panels[0])

    return svg("left out", 0.9 + 0.26 * len(phantoms), draw)


def _interval(panel: Any, at: int, one: LeftOut, place: int) -> None:
    known, held = one.is_determined[place], one.is_covered[place]
    colour = FOUND if held else MISSED
    ends = [one.low[place], one.high[place]]
    panel.plot(ends, [at, at], color=colour if known else STATED, lw=3 if known else 1.5, ls="-" if known else ":")
    panel.plot(one.value[place], at, "o" if held else "X", color=colour if known else STATED, ms=5 if held else 7)
    truth, tolerance = one.truth[place], HALF_WIDTH_STD * one.tolerance[place]
    panel.errorbar(truth, at + 0.22, xerr=tolerance, fmt="|", color="black", ms=6, lw=1, capsize=0)


def _legend(canvas: Any, panel: Any) -> None:
    shapes = (
        {"color": FOUND, "marker": "o", "lw": 3, "label": "answer, holds the truth"},
        {"color": MISSED, "marker": "X", "lw": 3, "label": "answer, misses it"},
        {"color": STATED, "marker": "o", "lw": 1.5, "ls": ":", "label": "not determined"},
        {"color": "black", "marker": "|", "lw": 1, "label": "stated truth, 90 %"},
    )
    handles = [panel.plot([], [], **shape)[0] for shape in shapes]
    canvas.legend(handles=handles, loc="outside upper center", ncols=4, frameon=False, fontsize=7.5)


def left_out_misfits(phantoms: Sequence[LeftOut], limit: float, gate: float) -> str:
    """Return the misfit of each phantom left out beside the limit of a refusal and the gate of commissioning."""

    def draw(canvas: Any) -> None:
        panel = canvas.subplots()
        at, misfits = np.arange(len(phantoms)), [one.misfit_ratio for one in phantoms]
        panel.hlines(at, 0, misfits, color=FOUND, lw=1.5)
        panel.plot(misfits, at, "o", color=FOUND, ms=5)
        for bound, style, words in ((limit, "--", "a press is refused"), (gate, "-", "commissioning is refused")):
            panel.axvline(bound, color=MISSED, lw=1, ls=style, label=f"above {bound:.2f} {words}")
        panel.set_yticks(at, [one.name for one in phantoms], parse_math=False)
        panel.set_ylim(len(phantoms) - 0.4, -0.6)
        panel.set_xlim(0, 1.05 * max(gate, *misfits))
        panel.set_xlabel("misfit: squared residuals over their number, as believed")
        canvas.legend(loc="outside upper center", ncols=2, frameon=False, fontsize=7.5)

    return svg("misfits", 0.9 + 0.2 * len(phantoms), draw)


def believed_coverage(modes: Sequence[tuple[str, EvaluatedPresses]]) -> str:
    """Return of each mode's presses the share determined, and of these the share covered with its 90 % interval."""

    def draw(canvas: Any) -> None:
        determined, covered = canvas.subplots(1, 2, sharey=True)
        labels: list[str] = []
        for number, (name, presses) in enumerate(modes):
            for place, unknown in enumerate(UNKNOWNS):
                at, known = len(labels), presses.is_known[:, place]
                labels.append(f"{name}: {UNKNOWN_LABELS[unknown].partition(' (')[0]}")
                determined.barh(at, 100 * known.mean(), height=0.55, color=FOUND, alpha=1 - 0.3 * number)
                if known.any():
                    low, share, high = shares(int(presses.is_covered[known, place].sum()), int(known.sum()))
                    covered.plot([100 * low, 100 * high], [at, at], color=FOUND, lw=3, alpha=1 - 0.3 * number)
                    covered.plot(100 * share, at, "o", color=FOUND, ms=5)
        determined.set_yticks(range(len(labels)), labels)
        determined.set_ylim(len(labels) - 0.4, -0.6)
        determined.set_xlim(0, 100)
        determined.set_xlabel("determined (%)")
        covered.set_xlim(40, 100)
        covered.axvline(100 * COVERAGE, color="0.3", lw=1, ls="--")
        covered.set_xlabel("of these covered (%)")

    return svg("coverage", 0.7 * len(modes) + 0.7, draw)


def shares(held: int, count: int) -> tuple[float, float, float]:
    """Return the share of `count` that held, between the ends of its 90 % interval.

    Source: Wilson, JASA 22 (1927).
    """
    share, square = held / count, HALF_WIDTH_STD**2 / count
    middle = (share + square / 2) / (1 + square)
    half = np.sqrt(square * (share * (1 - share) + square / 4)) / (1 + square)
    return float(middle - half), share, float(middle + half)
