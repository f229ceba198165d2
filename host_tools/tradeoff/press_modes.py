"""The modes end to end: the same random presses in the frames of each mode, every drift, the device's own answer.

Cost is the computing of an answer, from the recording on. How long the hand is busy does not depend on a processor and
stands beside it as frames; the seconds of a press are in `GET /api/v1/device`.
"""

from __future__ import annotations

import numpy as np

from device.measurement.calibration import Calibration
from device.measurement.estimate import SPOKEN, Estimate
from device.measurement.mode import Mode
from device.measurement.mode_models import ModeModels
from device.measurement.quantities import UNKNOWNS
from device.measurement.recording.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table
from host_tools.scores.dial import dial_entry, timed_presses
from host_tools.tradeoff.fronts import front_figure, front_table, unknown_panels
from host_tools.tradeoff.pareto import Choice, needless_everywhere
from host_tools.tradeoff.yardstick import timed

LEAST_PERCENT = 0.01
PRESSES, FEWEST = 48, 3
"""Enough for a figure, and to try the chain."""
HEADER = (
    "mode",
    "frames a press",
    "computing (yardsticks)",
    "answered",
    *(f"{SPOKEN[name]} error" for name in UNKNOWNS),
    *(f"{SPOKEN[name]} determined" for name in UNKNOWNS),
)


def modes_chapter(
    models: ModeModels, calibration: Calibration, tables: ProbeTables, *, presses: int = PRESSES
) -> Chapter:
    """Return the fronts of the modes that have a model."""
    rows, points = zip(*(_measured(mode, models, calibration, tables, presses) for mode in models.modes), strict=True)
    panels = unknown_panels(points)
    return Chapter(
        "The modes of a press",
        f"{presses} random presses over the trained ranges, the same ones in every mode, with every drift.",
        "host_tools/tradeoff/press_modes.py; presses: host_tools/scores/dial.py",
        tables=(Table("What each mode takes and gives", HEADER, rows), front_table("Every mode", panels)),
        figures=(front_figure("tradeoff_modes.svg", "Computing and error of the modes", panels),),
        facts={"needless": [name.split()[0] for name in needless_everywhere([panel.choices for panel in panels])]},
    )


def _measured(
    mode: Mode, models: ModeModels, calibration: Calibration, tables: ProbeTables, presses: int
) -> tuple[tuple[str, ...], list[Choice]]:
    """Return a mode's row of the table and its point for each unknown."""
    yardsticks: list[float] = []

    def answer(recording: Recording, mode: Mode) -> Estimate:
        found, takes = timed(lambda: models.estimate(recording, mode, calibration))
        yardsticks.append(takes.yardsticks)
        return found

    entry = dial_entry(mode, timed_presses(answer, mode, tables, presses=presses))
    cost, share = float(np.median(yardsticks)), f"{entry['answered'] / entry['presses']:.0%}"
    errors, known = entry["median_percent"], entry["determined"]
    row = (mode, f"{entry['frames']}", f"{cost:.0f}", share, *(f"{errors[name]:.1f} %" for name in UNKNOWNS))
    points = [Choice(f"{mode} ({share})", mode, cost, max(errors[name], LEAST_PERCENT)) for name in UNKNOWNS]
    return (*row, *(f"{known[name]:.0%}" for name in UNKNOWNS)), points
