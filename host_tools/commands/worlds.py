"""`host_tools worlds` and `robustness`: probes that differ from what the models believe, and how they are answered."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import Bound, require
from host_tools.commands.measured_chapters import (
    chosen_chapters,
    judge,
    measure_page,
    repeating,
)
from host_tools.commands.output import Scheduler, note, require_writable
from host_tools.workers import workers


def worlds(
    out: Annotated[Path, typer.Option(help="Folder of the scenario files.")],
    count: Annotated[int, typer.Option(help="How many, up to 99.")] = 20,
    seed: Annotated[int, typer.Option(min=0, help="Seed of all tolerances.")] = 1,
) -> None:
    """Write scenes of probes of random tolerances, all of it at once: layers, camera, contact law, LEDs, load cell, and
    what differs between the lesion's press and the reference's.

    The same seed gives the same files. `make run SCENE=FILE` runs one; scores/foreign_probes.py has the tolerances.
    """
    from host_tools.scores.foreign_probes import write_worlds

    require("count", count, Bound(1, 99, "worlds"), "ask for at least one")
    require("seed", seed, Bound(0, 2**63, ""), "give a whole number from 0")
    out.mkdir(parents=True, exist_ok=True)
    written = write_worlds(count, seed, out)
    note.print(f"{written[0]} to {written[-1].name}", soft_wrap=True)


def robustness(
    out: Annotated[
        Path | None, typer.Option(help="Markdown file to write, results beside it; printed only when not given.")
    ] = None,
    probes: Annotated[int, typer.Option(help="How many foreign probes, up to 99.")] = 20,
    presses: Annotated[
        int | None, typer.Option(help="Random presses of each probe or thing; 60 and 40 when not given.")
    ] = None,
    model: Annotated[Path, typer.Option(help="Bundle of modes standard and precise of the design.")] = MODELS
    / "standard",
    phantoms: Annotated[Path, typer.Option(help="File of the phantoms of every probe.")] = SIMULATED_PROBE
    / "phantoms.toml",
    table: Annotated[Path, typer.Option(help="Folder of the design's tables.")] = SIMULATED_PROBE,
    only: Annotated[
        list[str] | None, typer.Option(help="Chapter to measure, all by default; repeat it. The page keeps the others.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of probes, presses and phantoms.")] = 1,
    scheduler: Scheduler = None,
) -> None:
    """Measure how presses of probes that somebody built are answered, before and after commissioning: of random
    tolerances, in mode quick too, of other optics, with one thing at a time, with what no test notices, on skins and in
    uneven tissue that are solved anew; and what a refusal names.

    Half an hour on two cores; the page has each chapter as soon as it is measured. Exit code 1 when a figure
    misses its bound: the page says by how much.
    """
    from device.files.bundle_file import read_quick_model, read_ramp_model
    from device.simulation.virtual_probe import ProbeTables
    from host_tools.press_models.press_derivatives import load_derivatives
    from host_tools.scenes.phantom_set import BLOCKS_NEEDED, read_phantoms
    from host_tools.scores.one_thing.held_presses import PRESSES as OF_HELD
    from host_tools.scores.one_thing.held_presses import held_presses_chapter
    from host_tools.scores.one_thing.named_blocks import named_blocks_chapter
    from host_tools.scores.one_thing.one_at_a_time import PRESSES as OF_EACH
    from host_tools.scores.one_thing.one_at_a_time import one_at_a_time_chapter
    from host_tools.scores.one_thing.press_answers import DesignToTry
    from host_tools.scores.one_thing.silent_errors import silent_errors_chapter
    from host_tools.scores.one_thing.solved_skins import solved_skins_chapter
    from host_tools.scores.one_thing.uneven_tissue import uneven_tissue_chapter
    from host_tools.scores.robustness import PRESSES, other_optics_chapter, robustness_chapter

    require("probes", probes, Bound(1, 99, "probes"), "ask for at least one")
    if presses is not None:
        require("presses", presses, Bound(4, 10_000, "presses"), "ask for at least four of each")
    if out:
        require_writable(out, (".md",))
    trained, quick, derivatives = read_ramp_model(model), read_quick_model(MODELS / "quick"), load_derivatives(table)
    stated, tables = read_phantoms(phantoms, blocks_needed=BLOCKS_NEEDED), ProbeTables.load(table)
    design = DesignToTry(trained, quick, derivatives, tables)
    chapters = {
        "tolerances": lambda: robustness_chapter(
            trained, derivatives, tables, stated, probes=probes, presses=presses or PRESSES, seed=seed
        ),
        "held": lambda: held_presses_chapter(design, stated, presses=presses or OF_HELD, seed=seed),
        "other optics": lambda: other_optics_chapter(
            trained, derivatives, tables, stated, presses=presses or PRESSES, seed=seed
        ),
        "one at a time": lambda: one_at_a_time_chapter(design, stated, presses=presses or OF_EACH, seed=seed),
        "silent errors": lambda: silent_errors_chapter(design, presses=presses or OF_EACH, seed=seed),
        "skins": lambda: solved_skins_chapter(design, seed=seed),
        "uneven tissue": lambda: uneven_tissue_chapter(design, seed=seed),
        "named": lambda: named_blocks_chapter(design, seed=seed),
    }
    chosen = chosen_chapters(only, chapters)
    counts = {"probes": probes} if "tolerances" in chosen else {}
    files = {"model": model, "phantoms": phantoms, "table": table}
    given = {**counts, "presses": presses, "seed": seed, **files, "only": only, "out": out}
    command = repeating(robustness, given, always=["probes"])
    with workers(scheduler):
        measured = measure_page("robustness", command, chosen, out, list(chapters))
    judge(measured, tables=None)
