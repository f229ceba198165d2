"""The modes end to end: the same random presses in the frames of each mode, every drift, the device's own answer.

Cost is the computing of an answer, from the recording on. How long the hand is busy does not depend on a processor and
stands beside it as frames; the seconds of a press are in `GET /api/v1/device`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.calibration import Calibration
from device.measurement.estimate import SPOKEN, Estimate
from device.measurement.mode import FRAMES, Mode
from device.measurement.mode_models import ModeModels
from device.measurement.quantities import UNKNOWNS
from device.measurement.recording.recording import Recording
from device.simulation.virtual_probe import ProbeTables
from host_tools.pages.benchmark import Chapter, Table
from host_tools.scores.dial import dial_entry, timed_presses
from host_tools.tradeoff.fronts import Panel, front_figure, front_table
from host_tools.tradeoff.pareto import Choice, needless_everywhere
from host_tools.tradeoff.yardstick import timed

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
    models: ModeModels,
    calibration: Calibration,
    tables: ProbeTables,
    *,
    modes: Sequence[Mode] | None = None,
    presses: int = PRESSES,
) -> Chapter:
    """Return the fronts of the modes that are asked for, or of all."""
    points: dict[str, list[Choice]] = {name: [] for name in UNKNOWNS}
    rows = []
    for mode in modes or models.modes:
        yardsticks: list[float] = []

        def answer(recording: Recording, mode: Mode, yardsticks: list[float] = yardsticks) -> Estimate:
            found, cost = timed(lambda: models.estimate(recording, mode, calibration))
            yardsticks.append(cost.yardsticks)
            return found

        entry = dial_entry(mode, timed_presses(answer, mode, tables, presses=presses))
        cost = float(np.median(yardsticks))
        share = entry["answered"] / entry["presses"]
        for name in UNKNOWNS:
            label = f"{mode}, {share:.0%} answered"
            points[name].append(Choice(label, mode, cost, max(entry["median_percent"][name], 0.01)))
        errors = (f"{entry['median_percent'][name]:.1f} %" for name in UNKNOWNS)
        known = (f"{entry['determined'][name]:.0%}" for name in UNKNOWNS)
        rows.append((mode, f"{FRAMES[mode].count}", f"{cost:.0f}", f"{share:.0%}", *errors, *known))
    panels = [Panel(SPOKEN[name], "median error (%)", tuple(points[name])) for name in UNKNOWNS]
    return Chapter(
        "The modes of a press",
        f"{presses} random presses over the trained ranges, the same ones in every mode, with every drift.",
        "host_tools/tradeoff/press_modes.py; presses: host_tools/scores/dial.py",
        tables=(Table("What each mode takes and gives", HEADER, tuple(rows)), front_table("Every mode", panels)),
        figures=(front_figure("tradeoff_modes.svg", "Computing and error of the modes", panels),),
        facts={"needless": [name.split(",")[0] for name in needless_everywhere([panel.choices for panel in panels])]},
    )
