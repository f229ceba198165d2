"""`host_tools pages`: write the pages of docs/ from their results and templates, without measuring anything."""

from __future__ import annotations

from typing import Annotated

import typer

from device.files.durable import write_durably
from host_tools.commands.output import note, source_tree


def pages(
    check: Annotated[
        bool, typer.Option(help="Write nothing; exit code 1 when a page is not what it would be.")
    ] = False,
) -> None:
    """Write each page of docs/results from its template in docs/templates."""
    from host_tools.pages.page import DOCS, RESULTS, render

    source_tree("write its pages")
    stale = []
    for record in sorted(RESULTS.glob("*.json")):
        page, text = DOCS / f"{record.stem}.md", render(record)
        if page.exists() and page.read_text(encoding="utf-8") == text:
            continue
        stale.append(page.name)
        if not check:
            write_durably(page, text.encode())
    if check and stale:
        note.print(f"{', '.join(stale)}: not what results and template say; run `host_tools pages`.")
        raise typer.Exit(1)
    note.print(f"{', '.join(stale)} written." if stale else "Every page is what its results and template say.")
