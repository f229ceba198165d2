"""`host_tools paper`: the paper's protocol to the letter, and what it was worth, on the screen and in docs/."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.simulation.virtual_probe import ProbeTables
from host_tools.commands.measured_chapters import ROOT, measure_chapters, print_chapter, print_tables, shown
from host_tools.commands.output import note, note_left_out, require_writable

DEFAULT_DATA = ROOT / "build" / "sweep.nc"
DEFAULT_TABLE = ROOT / "models" / "simulated_probe"
DEFAULT_SEEDS = 100


def paper(
    out: Annotated[Path | None, typer.Option(help="Markdown file to write.")] = None,
    data: Annotated[Path, typer.Option(help="Data set of `host_tools sweep`.")] = DEFAULT_DATA,
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = DEFAULT_TABLE,
    seeds: Annotated[int, typer.Option(help="Trials of each network; bounds are meant for 100.")] = DEFAULT_SEEDS,
) -> None:
    """Repeat the paper's protocol, take its assumptions away, and set two algorithms side by side.

    Exit code 1 when a bound is missed. Some five minutes on one core for 100 seeds.
    """
    require_writable(out, (".md",))
    from host_tools.data.dataset import require_enough, training_rows
    from host_tools.replication.chapters import paper_chapters
    from host_tools.replication.study import PaperStudy

    rows = training_rows(data)
    note_left_out(rows.excluded_rows, data)
    require_enough(rows, data)
    study = PaperStudy(rows, ProbeTables.load(table), seeds=seeds)
    measured = measure_chapters(paper_chapters(study))
    failed = 0
    for timed in measured.values():
        failed += print_chapter(timed)
        print_tables(timed.chapter)
    if out:
        from host_tools.pages.document import write_document
        from host_tools.replication.verdict import cover

        write_document(out, measured, command=_command(out, data, table, seeds), cover=cover(study))
        note.print(f"{out} written.")
    if failed:
        note.print(f"{failed} benchmarks miss their bound.")
        raise typer.Exit(1)


def _command(out: Path, data: Path, table: Path, seeds: int) -> str:
    flags = [f"--data {shown(data)}"] if data != DEFAULT_DATA else []
    flags += [f"--table {shown(table)}"] if table != DEFAULT_TABLE else []
    flags += [f"--seeds {seeds}"] if seeds != DEFAULT_SEEDS else []
    return " ".join(["host_tools paper", *flags, f"--out {shown(out)}"])
