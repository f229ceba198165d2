"""Chapters of a verification: measured behind a progress bar, and printed as tables that show what failed.

And `host_tools pages`, which writes the pages that keep them without measuring anything.
"""

from __future__ import annotations

import shlex
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from inspect import signature
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from device.files.durable import write_durably
from device.files.shipped import SOURCE_TREE
from device.measurement.quantities import InvalidQuantity
from host_tools.commands.output import note, progress, source_tree

if TYPE_CHECKING:
    from host_tools.pages import benchmark
    from host_tools.pages.page import Timed


def chosen_chapters(
    only: list[str] | None, known: Mapping[str, Callable[[], benchmark.Chapter]]
) -> dict[str, Callable[[], benchmark.Chapter]]:
    """Return the chapters asked for by name, all without a name; raise `InvalidQuantity` for an unknown one."""
    for name in only or []:
        if name not in known:
            raise InvalidQuantity("only", repr(name), f"one of {', '.join(known)}", "name a chapter")
    return {name: known[name] for name in only or known}


def measure_page(
    page: str,
    command: str,
    chapters: Mapping[str, Callable[[], benchmark.Chapter]],
    out: Path | None,
    order: Sequence[str],
) -> dict[str, Timed]:
    """Measure chapters, and write each at once to the page, if any: what ends this loses the one at work alone.

    The page keeps its other chapters; all that it may have are in `order`.
    """
    from host_tools.pages.page import Results, write_page

    def keep(name: str, timed: Timed) -> None:
        if out:
            write_page(out, Results(page, command, {name: timed}).in_chapters(out, order))

    measured = measure_chapters(chapters, keep)
    if out:
        note.print(f"{out} written.")
    return measured


def measure_chapters(
    chapters: Mapping[str, Callable[[], benchmark.Chapter]], keep: Callable[[str, Timed], None] | None = None
) -> dict[str, Timed]:
    """Measure every chapter, one after the other, each with the wall time it took; `keep` is given each at once."""
    from host_tools.pages.page import Timed

    measured = {}
    with progress("chapters") as bar:
        task = bar.add_task("", total=len(chapters))
        for name, chapter in chapters.items():
            began = time.perf_counter()
            found = chapter()
            measured[name] = Timed(found, time.perf_counter() - began)
            if keep:
                keep(name, measured[name])
            bar.advance(task)
    return measured


def judge(measured: Mapping[str, Timed], tables: int | None = 0) -> None:
    """Print chapters and then of each the first `tables`, or all; exit with code 1 when a figure misses its bound."""
    missed = sum(
        print_chapter(timed)
        for timed in measured.values()
        if not tables or timed.chapter.benchmarks or timed.chapter.skipped
    )
    for timed in measured.values():
        for table in timed.chapter.tables[:tables]:
            print_table(table)
    if missed:
        note.print(f"{missed} benchmarks miss their bound.")
        raise typer.Exit(1)


def print_chapter(timed: Timed) -> int:
    """Print one chapter; return how many of its benchmarks miss their bound."""
    from host_tools.pages.page import BENCHMARK_HEADER, benchmark_row

    chapter, out = timed.chapter, Console(width=140, highlight=False)
    if chapter.skipped:
        out.print(f"{chapter.title}: skipped, {chapter.skipped}", markup=False)
        return 0
    table = Table(*BENCHMARK_HEADER, title=f"{chapter.title} ({timed.seconds:.1f} s)", title_justify="left")
    for benchmark in chapter.benchmarks:
        table.add_row(*map(escape, benchmark_row(benchmark)), style=None if benchmark.passed else "bold red")
    out.print(table)
    return sum(not benchmark.passed for benchmark in chapter.benchmarks)


def print_table(table: benchmark.Table) -> None:
    """Print numbers that are not judged."""
    printed = Table(*map(escape, table.header), title=escape(table.caption), title_justify="left")
    for row in table.rows:
        printed.add_row(*map(escape, row))
    Console(width=160, highlight=False).print(printed)


def repeating(
    verb: Callable[..., None], given: Mapping[str, object], *, of: str = "", always: Collection[str] = ()
) -> str:
    """Return the command line that measures the same again, for the page that keeps it.

    `given` are values by the names of the verb's parameters, in the order of the line; those as by default are left
    out, but for the ones of `always`, and of a file outside the repository stands its name alone. `of` is the group of
    the verb.
    """
    usual = signature(verb).parameters
    told = {name: value for name, value in given.items() if name in always or value != usual[name].default}
    words = [word for name, value in told.items() for word in _words(name, value)]
    return shlex.join(["host_tools", *of.split(), verb.__name__, *words])


def _words(name: str, value: object) -> list[str]:
    """Return an option as it is typed: a flag alone, each value of several."""
    option, values = f"--{name.replace('_', '-')}", value if isinstance(value, list) else [value]
    if value is True:
        return [option]
    if value is None or value is False:
        return [] if value is None else [option.replace("--", "--no-", 1)]
    return [word for one in values for word in (option, shown(one) if isinstance(one, Path) else str(one))]


def shown(path: Path) -> str:
    """Return a path as it would be typed at the root of the repository; of one elsewhere its name alone."""
    whole = path.resolve()
    inside = SOURCE_TREE and whole.is_relative_to(SOURCE_TREE)
    return str(whole.relative_to(SOURCE_TREE)) if SOURCE_TREE and inside else path.name


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
