"""`host_tools modes`: what the modes of a press are worth, measured on the simulated probe, and docs/modes.md."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from device.files.shipped import CERTIFICATES, MODELS, SIMULATED_PROBE
from host_tools.commands.measured_chapters import chosen_chapters, judge, measure_page, repeating
from host_tools.commands.output import Scheduler, require_writable
from host_tools.workers import workers


def modes(
    out: Annotated[
        Path | None, typer.Option(help="Markdown file to write, results beside it; printed only when not given.")
    ] = None,
    model: Annotated[Path, typer.Option(help="Bundle of modes standard and precise.")] = MODELS / "standard",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = SIMULATED_PROBE,
    only: Annotated[
        list[str] | None, typer.Option(help="Chapter to measure, all by default; repeat it. The page keeps the others.")
    ] = None,
    seed: Annotated[
        int, typer.Option(min=0, help="Seed of dial, posterior, ranks, scan, missed, noise-free and tissue.")
    ] = 1,
    scheduler: Scheduler = None,
) -> None:
    """Measure error, time, coverage and refusals of the modes against bounds; some hours on two cores.

    The page has each chapter as soon as it is measured. Exit code 1 when a figure misses its
    bound: the page says by how much.
    """
    from device.files.bundle_file import read_paper_model, read_quick_model, read_ramp_model
    from device.files.certificate_file import read_calibration
    from device.measurement.mode_models import ModeModels
    from device.measurement.ramp_modes.model import RAMP_MODES
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.press_models.seeds import derived_seed
    from host_tools.scores.breast_imager import breast_imager_chapter
    from host_tools.scores.coverage import coverage_chapter
    from host_tools.scores.dial import dial_chapter
    from host_tools.scores.ellipsoids import oblong_chapter
    from host_tools.scores.just_outside import just_outside_chapter
    from host_tools.scores.noise_free import missed_chapter, noise_free_chapter
    from host_tools.scores.one_thing.known_tissue import known_tissue_chapter
    from host_tools.scores.one_thing.other_tissue import other_tissue_chapter
    from host_tools.scores.outside import kinds, outside_chapter
    from host_tools.scores.posterior import posterior_chapter
    from host_tools.scores.rank_histograms import rank_chapter
    from host_tools.scores.scan import scan_chapter
    from host_tools.scores.span import span_chapter

    if out:
        require_writable(out, (".md",))
    quick, trained, tables = read_quick_model(MODELS / "quick"), read_ramp_model(model), ProbeTables.load(table)
    models = ModeModels(read_paper_model(MODELS / "paper"), quick, trained)
    calibration = read_calibration(table / CERTIFICATES["physical"])
    chapters = {
        "dial": lambda: dial_chapter(models, trained.bundle, calibration, tables, seed=seed),
        "coverage": lambda: coverage_chapter(
            {"quick": quick.bundle.card} | dict.fromkeys(RAMP_MODES, trained.bundle.card)
        ),
        "posterior": lambda: posterior_chapter(trained, seed=seed),
        "ranks": lambda: rank_chapter(trained, seed=seed),
        "scan": lambda: scan_chapter(trained, seed=seed),
        "missed": lambda: missed_chapter(trained, tables, seed=seed),
        "noise-free": lambda: noise_free_chapter(trained.answers, tables, seed=seed),
        "span": lambda: span_chapter(trained, tables),
        "outside": lambda: outside_chapter(
            partial(models.estimate, calibration=calibration), kinds(tables, derived_seed(1, "outside"))
        ),
        "known-tissue": known_tissue_chapter,
        "tissue": lambda: other_tissue_chapter(partial(models.estimate, calibration=calibration), tables, seed=seed),
        "oblong": lambda: oblong_chapter(partial(models.estimate, calibration=calibration), trained.answers, tables),
        "just-outside": lambda: just_outside_chapter(trained, calibration, tables),
        "breast-imager": lambda: breast_imager_chapter(trained, calibration, tables),
    }  # fmt: skip
    given = {"out": out, "model": model, "table": table, "only": only, "seed": seed}
    chosen = chosen_chapters(only, chapters)
    with workers(scheduler):
        measured = measure_page("modes", repeating(modes, given), chosen, out, list(chapters))
    judge(measured)
