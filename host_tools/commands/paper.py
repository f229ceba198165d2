"""`host_tools paper`: the paper's protocol to the letter, and what it was worth, on the screen and in docs/."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.files.shipped import SIMULATED_PROBE, SOURCE_TREE
from host_tools.commands.measured_chapters import print_table, repeating
from host_tools.commands.output import Scheduler, note, note_left_out, progress, require_writable
from host_tools.workers import workers

DEFAULT_DATA = (SOURCE_TREE or Path()) / "build" / "sweep.nc"
DEFAULT_SEEDS = 100


def paper(
    out: Annotated[Path | None, typer.Option(help="Markdown file to write; results go beside it.")] = None,
    data: Annotated[Path, typer.Option(help="Data set of `host_tools sweep`.")] = DEFAULT_DATA,
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = SIMULATED_PROBE,
    seeds: Annotated[int, typer.Option(help="Trials of each network; the page is meant for 100.")] = DEFAULT_SEEDS,
    scheduler: Scheduler = None,
) -> None:
    """Repeat the paper's protocol, take its assumptions away, and set two algorithms side by side.

    Some five minutes on one core for 100 seeds. A sweep of another force or waveguide than that of the images
    is refused.
    """
    require_writable(out, (".md",))
    from device.simulation.virtual_probe import FACE_TABLES, ProbeTables, table_record
    from host_tools.calibration.phantom import TARGET_N
    from host_tools.data.dataset import require_enough, training_rows
    from host_tools.replication.page import paper_facts, paper_tables
    from host_tools.replication.protocol import require_waveguide
    from host_tools.replication.study import PaperStudy

    rows = training_rows(data)
    note_left_out(rows.excluded_rows, data)
    require_enough(rows, data)
    study = PaperStudy(rows, ProbeTables.load(table), seeds=seeds)
    require_waveguide(rows, table_record(table, FACE_TABLES[0]).get("scene_defaults") or {})
    print(f"{len(rows.features)} scenes of {data}, {TARGET_N:g} N, {seeds} seeds", flush=True)
    parts, tables = paper_tables(study), {}
    with workers(scheduler), progress("tables") as bar:
        task = bar.add_task("", total=len(parts))
        for name, compute in parts.items():
            tables[name] = compute()
            bar.advance(task)
    for computed in tables.values():
        print_table(computed)
    if out:
        from host_tools.pages.page import Results, write_page

        command = repeating(paper, {"data": data, "table": table, "seeds": seeds, "out": out})
        write_page(out, Results("paper_protocol", command, tables=tables, facts=paper_facts(study)))
        note.print(f"{out} written.")
