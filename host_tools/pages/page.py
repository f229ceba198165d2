"""What a verb measured to JSON, and JSON through a template to a page of docs/: numbers and prose in their own files.

`docs/results/<page>.json` is written by the verb that measures, `docs/templates/<page>.md.jinja` by hand. A page is the
two together, so prose is edited without measuring again, and no number of a page stands anywhere but in its results.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import date
from math import isfinite, nan
from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from device import __version__
from device.files.durable import write_durably
from device.files.shipped import SOURCE_TREE, TEMPLATES
from host_tools.pages.benchmark import Benchmark, Chapter, Figure, Table

DOCS = (SOURCE_TREE or Path()) / "docs"
RESULTS = DOCS / "results"
FIGURES = "figures"
MOST = 10.0
"""Ratios beyond 1000 % are not written out."""
LINE = 200
"""JSON that fits into a line of so many characters is not broken."""
NUMBER = re.compile(r"[+-]?\d+(\.\d+)?(e[+-]\d+)?( ?%)?")
FORMATS = (
    "{}",
    *(f"{{:{sign}.{digits}{kind}" for kind in ("f}", "e}", "%}", "f} %") for sign in ("", "+") for digits in range(7)),
)
"""How the numbers of a column may be written; the first that gives every cell back as it is shown is kept."""


@dataclass(frozen=True)
class Timed:
    """A chapter and the wall time (s) it took."""

    chapter: Chapter
    seconds: float


@dataclass(frozen=True)
class Results:
    """Everything that a page shows beside its prose; `facts` are what the prose quotes, numbers, lists and texts.

    `kept` are chapters as JSON that were measured before and stay; a page with any says of each how it was measured.
    """

    page: str
    command: str
    chapters: Mapping[str, Timed] = field(default_factory=dict)
    kept: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    tables: Mapping[str, Table] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)
    software: str = __version__
    date: str = field(default_factory=lambda: date.today().isoformat())

    def record(self) -> dict[str, Any]:
        """Return the results as JSON; a number that is none becomes null."""
        return {
            "page": self.page,
            "command": self.command,
            "software": self.software,
            "date": self.date,
            "facts": dict(self.facts),
            "tables": {name: _table_record(table) for name, table in self.tables.items()},
            "chapters": {**self.kept, **{name: chapter_record(timed) for name, timed in self.chapters.items()}},
        }

    def in_chapters(self, out: Path, order: Sequence[str]) -> Results:
        """Return the same with chapters of a page that was written before, but for those measured now.

        Chapters that a page may have are in `order`; the facts of each then say by which command, software and when it
        was measured.
        """
        old, origin = _before(out), ("command", "software", "date")
        before = {
            name: chapter | {"facts": {one: old[one] for one in origin} | chapter["facts"]}
            for name, chapter in old.get("chapters", {}).items()
        }
        mine = {one: getattr(self, one) for one in origin}
        chapters = {
            name: replace(timed, chapter=replace(timed.chapter, facts=mine | dict(timed.chapter.facts)))
            for name, timed in self.chapters.items()
        }
        found = before | {name: chapter_record(timed) for name, timed in chapters.items()}
        return replace(self, chapters=chapters, kept={name: found[name] for name in order if name in found})


def _before(out: Path) -> dict[str, Any]:
    """Return the results that stand beside a page; {} where there are none."""
    record = _record_of(out)
    return dict(json.loads(record.read_text(encoding="utf-8"))) if record.exists() else {}


def _record_of(out: Path) -> Path:
    return out.parent / "results" / f"{out.stem}.json"


def write_page(out: Path, results: Results) -> None:
    """Write figures and results into folders beside the page, and the page from these results."""
    for figure in (figure for timed in results.chapters.values() for figure in timed.chapter.figures):
        _draw(figure, out.parent / FIGURES / figure.name)
    record = _record_of(out)
    record.parent.mkdir(exist_ok=True)
    write_durably(record, f"{dumps(results.record())}\n".encode())
    write_durably(out, render(record).encode())


def render(record: Path) -> str:
    """Return the page of results; raises `ValueError` when its template leaves out a chapter that was measured."""
    found = json.loads(record.read_text(encoding="utf-8"))
    chapters = {name: _chapter(chapter) for name, chapter in found["chapters"].items()}
    tables = {name: _table(table) for name, table in found["tables"].items()}
    template = _environment().get_template(f"{found['page']}.md.jinja")
    text = template.render({**found, "chapters": chapters, "tables": tables})
    unsaid = [chapter["title"] for chapter in chapters.values() if f"\n## {chapter['title']}\n" not in text]
    if unsaid:
        raise ValueError(f"{template.name} has no chapter {', '.join(unsaid)}: add it there")
    return text


def benchmark_row(benchmark: Benchmark) -> tuple[str, ...]:
    """Return a benchmark as the cells under `BENCHMARK_HEADER`."""
    exact = "" if benchmark.exact is None else f"{benchmark.exact:.6g}"
    error, bound = f"{benchmark.error:.1e}", f"{benchmark.bound:.3g}"
    word = "holds" if benchmark.passed else "**fails**"
    return benchmark.case, benchmark.quantity, f"{benchmark.measured:.6g}", exact, error, bound, word


BENCHMARK_HEADER = ("case", "quantity", "measured", "exact", "error", "bound", "")


def dumps(value: Any, indent: int = 0) -> str:
    """Return JSON in which a row is a line: what is short stays in one, what is long is broken by its parts."""
    line = json.dumps(value, ensure_ascii=False, allow_nan=False)
    if len(line) + indent <= LINE or not isinstance(value, dict | list):
        return line
    inner = " " * (indent + 1)
    if isinstance(value, dict):
        parts = [f"{inner}{json.dumps(key)}: {dumps(part, indent + 1)}" for key, part in value.items()]
    else:
        parts = [inner + dumps(part, indent + 1) for part in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return "\n".join([opening, ",\n".join(parts), " " * indent + closing])


def _environment() -> Environment:
    """Return the templates' settings: a name that is not in the results is an error, not an empty place."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
        autoescape=False,
    )
    environment.filters |= {
        "f": lambda value, spec: format(value, spec),
        "each": lambda values, spec: [format(value, spec) for value in values],
        "benchmark": benchmark_row,
        "nearest": _nearest,
        "percent": percent,
        "format_unit": lambda text, unit: f"{text} {unit}",
    }
    return environment


def percent(ratio: float | None) -> str:
    """Return a ratio in per cent, to two digits; one above `MOST`, or None, is too large to mean anything."""
    if ratio is None or ratio > MOST:
        return ">1000"
    return f"{100 * ratio:.2g}" if ratio < 0.995 else f"{100 * ratio:.0f}"


def _nearest(benchmarks: Sequence[Benchmark]) -> Benchmark:
    """Return the benchmark that uses up most of its bound; of several that miss a bound of 0, the farthest."""
    return max(benchmarks, key=lambda one: (_share(one), one.error))


def _share(benchmark: Benchmark) -> float:
    if benchmark.bound:
        return benchmark.error / benchmark.bound
    return 0.0 if benchmark.passed else float("inf")


def chapter_record(timed: Timed) -> dict[str, Any]:
    """Return a chapter as JSON."""
    chapter = timed.chapter
    return {
        "title": chapter.title,
        "claim": chapter.claim,
        "source": chapter.source,
        "seconds": round(timed.seconds, 1),
        "skipped": chapter.skipped,
        "facts": dict(chapter.facts),
        "benchmarks": [_benchmark_record(benchmark) for benchmark in chapter.benchmarks],
        "tables": [_table_record(table) for table in chapter.tables],
        "figures": [{"name": figure.name, "caption": figure.caption} for figure in chapter.figures],
    }


def _chapter(record: dict[str, Any]) -> dict[str, Any]:
    benchmarks = [_benchmark(benchmark) for benchmark in record["benchmarks"]]
    passed = all(benchmark.passed for benchmark in benchmarks)
    tables = [_table(table) for table in record["tables"]]
    return {**record, "benchmarks": benchmarks, "passed": passed, "tables": tables}


def _benchmark_record(benchmark: Benchmark) -> dict[str, Any]:
    return {name: _or_null(value) for name, value in vars(benchmark).items()}


def _or_null(value: Any) -> Any:
    if isinstance(value, str) or value is None:
        return value
    return float(value) if isfinite(value) else None


def _benchmark(record: dict[str, Any]) -> Benchmark:
    numbers = {name: nan if record[name] is None else record[name] for name in ("measured", "error")}
    return Benchmark(**(record | numbers))


def _table_record(table: Table) -> dict[str, Any]:
    """Return a table whose cells are numbers wherever one format writes all of a column's numbers."""
    columns = [_column(cells) for cells in zip(*table.rows, strict=True)]
    rows = [list(row) for row in zip(*(values for _, values in columns), strict=True)]
    formats = [spec for spec, _ in columns]
    return {"caption": table.caption, "header": list(table.header), "formats": formats, "rows": rows}


def _table(record: dict[str, Any]) -> Table:
    rows = (
        tuple(
            cell if isinstance(cell, str) else spec.format(cell)
            for spec, cell in zip(record["formats"], row, strict=True)
        )
        for row in record["rows"]
    )
    return Table(record["caption"], tuple(record["header"]), tuple(rows))


def _column(cells: Iterable[str]) -> tuple[str, list[str | float]]:
    """Return the format of a column's numbers and its cells, text where they are no numbers."""
    shown = list(cells)
    numbers = [cell for cell in shown if NUMBER.fullmatch(cell)]
    for spec in FORMATS:
        if all(spec.format(_number(cell, spec)) == cell for cell in numbers):
            return spec, [_number(cell, spec) if cell in numbers else cell for cell in shown]
    return "{}", list(shown)


def _number(cell: str, spec: str) -> float:
    """Return the number that a format shows as a cell, or nearly so."""
    text = cell.rstrip(" %")
    if spec.endswith("%}"):
        return round(float(text) / 100, 12)
    return int(text) if text.lstrip("+-").isdecimal() else float(text)


def _draw(figure: Figure, path: Path) -> None:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    path.parent.mkdir(parents=True, exist_ok=True)
    with plt.rc_context({"svg.hashsalt": figure.name}):
        canvas = plt.figure(figsize=figure.size_in, layout="constrained")
        figure.draw(canvas)
        canvas.savefig(path, metadata={"Date": None})
        plt.close(canvas)
