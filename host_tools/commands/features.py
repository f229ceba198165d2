"""`host_tools features`: what each number of the image knows of inclusion, light and skin, measured on simulated
presses.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from device.files.durable import write_durably
from device.simulation.virtual_probe import ProbeTables
from host_tools.commands.measured_chapters import ROOT, shown
from host_tools.commands.output import note, progress, require_writable


def features(
    out: Annotated[Path, typer.Option(help="Markdown file to write.")] = ROOT / "docs" / "features.md",
    table: Annotated[Path, typer.Option(help="Folder of the probe's tables.")] = ROOT / "models" / "simulated_probe",
) -> None:
    """Measure the sensitivity of every image feature on simulated force ramps, and write definitions and figures."""
    from host_tools.replication.feature_page import page
    from host_tools.replication.feature_sensitivity import PRESSES, SCENES, Phantoms, sensitivity

    require_writable(out, (".md",))
    tables = ProbeTables.load(table)
    with progress("presses") as bar:
        task = bar.add_task("", total=PRESSES)
        scenes = [sensitivity(Phantoms(scene, tables, lambda: bar.advance(task))) for scene in SCENES]
    write_durably(out, page(scenes, command=f"host_tools features --out {shown(out)}").encode())
    note.print(f"{out} written.")
