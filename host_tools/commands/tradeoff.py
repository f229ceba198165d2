"""`host_tools tradeoff`: what accuracy costs, part by part, as Pareto fronts, and docs/tradeoff.md."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.files.shipped import CERTIFICATES, MODELS, SIMULATED_PROBE
from host_tools.commands.measured_chapters import (
    chosen_chapters,
    judge,
    measure_page,
    repeating,
)
from host_tools.commands.output import require_writable


def tradeoff(
    out: Annotated[
        Path | None,
        typer.Option(help="Markdown file to write, results and figures beside it; printed only when not given."),
    ] = None,
    model: Annotated[Path, typer.Option(help="Bundle of modes standard and precise.")] = MODELS / "standard",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = SIMULATED_PROBE,
    only: Annotated[list[str] | None, typer.Option(help="Chapter to measure, all by default; repeat it.")] = None,
    short: Annotated[bool, typer.Option(help="The smallest of everything: does it run, not what is it worth.")] = False,
) -> None:
    """Measure time and error of what can be chosen: forward model, light, frames, networks, mode; under half an hour.

    Times are processor time over that of one exp-and-sum of an image, measured in turns. Exit code 1 when a model that
    the plan chooses errs more than it promises.
    """
    import cv2

    from device.files.bundle_file import read_paper_model, read_quick_model, read_ramp_model
    from device.files.certificate_file import read_calibration
    from device.measurement.bundle import MODEL_FILE
    from device.measurement.mode_models import ModeModels
    from device.simulation.physics.light_table import load_light_table
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.tradeoff import (
        forward_models,
        light_models,
        press_frames,
        press_modes,
        press_networks,
        tolerance_times,
    )

    if out:
        require_writable(out, (".md",))
    cv2.setNumThreads(1)
    quick, ramp, tables = read_quick_model(MODELS / "quick"), read_ramp_model(model), ProbeTables.load(table)
    models = ModeModels(read_paper_model(MODELS / "paper"), quick, ramp)
    calibration = read_calibration(table / CERTIFICATES["physical"])
    chapters = {
        "forward": lambda: forward_models.forward_chapter(forward_models.SHORT if short else None),
        "tolerances": lambda: tolerance_times.tolerances_chapter(tolerance_times.SHORT if short else None),
        "light": lambda: light_models.light_chapter(
            load_light_table(table), tables.centred, light_models.SHORT if short else None
        ),
        "frames": lambda: press_frames.frames_chapter(
            ramp, quick, tables, **(press_frames.SHORT if short else {})
        ),
        "networks": lambda: press_networks.networks_chapter(
            (model / MODEL_FILE).read_bytes(), ramp, press_networks.SHORT if short else None
        ),
        "modes": lambda: press_modes.modes_chapter(
            models, calibration, tables, presses=press_modes.FEWEST if short else press_modes.PRESSES
        ),
    }  # fmt: skip
    given = {"out": out, "model": model, "table": table, "only": only, "short": short}
    chosen = chosen_chapters(only, chapters)
    measured = measure_page("tradeoff", repeating(tradeoff, given), chosen, out, list(chapters))
    judge(measured, tables=1)
