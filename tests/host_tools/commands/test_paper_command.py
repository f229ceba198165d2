"""`host_tools paper`: what it is given, what it writes, and the exit code."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from device.measurement.quantities import InvalidQuantity
from device.simulation.virtual_probe import ProbeTables
from host_tools.__main__ import app
from host_tools.data import dataset
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.pages.document import Cover
from host_tools.replication import chapters as paper_chapters
from host_tools.replication import study as paper_study
from host_tools.replication import verdict


def run(*words: object) -> Any:
    return CliRunner().invoke(app, ["paper", *map(str, words)])


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """One chapter whose error is 1 % of the seeds; holds up to a hundred."""

    def chapters(study: Any) -> dict[str, Any]:
        table = Table("Errors", ("unknown", "error [%]"), (("size", "7"),))
        return {"one": lambda: Chapter("One", "", "", (at_most("case", "noise", study.seeds / 100, 1.0),), (table,))}

    monkeypatch.setattr(dataset, "training_rows", lambda path: SimpleNamespace(excluded_rows=4, features=range(80)))
    monkeypatch.setattr(ProbeTables, "load", lambda folder: None)
    monkeypatch.setattr(paper_study, "PaperStudy", lambda rows, tables, seeds: SimpleNamespace(seeds=seeds))
    monkeypatch.setattr(paper_chapters, "paper_chapters", chapters)
    monkeypatch.setattr(verdict, "cover", lambda study: Cover("Paper", (f"{study.seeds} seeds",), ("nothing",)))


def test_a_missed_bound_is_exit_code_1() -> None:
    assert run().exit_code == 0
    assert run("--seeds", 101).exit_code == 1


def test_tables_are_printed_and_rows_that_are_left_out_are_counted() -> None:
    done = run()
    assert "error [%]" in done.output
    assert "4 scenes of" in done.output


def test_the_page_repeats_the_command(tmp_path: Path) -> None:
    page = tmp_path / "paper.md"
    assert run("--out", page).exit_code == 0
    assert "`host_tools paper --out paper.md`" in page.read_text()
    run("--seeds", 5, "--out", page)
    assert "`host_tools paper --seeds 5 --out paper.md`" in page.read_text()
    assert page.read_text().startswith("# Paper\n\n5 seeds\n")
    run("--data", tmp_path / "other.nc", "--table", tmp_path / "tables", "--out", page)
    assert "`host_tools paper --data other.nc --table tables --out paper.md`" in page.read_text()


def test_a_page_of_another_type_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    done = run("--out", tmp_path / "paper.txt")
    assert isinstance(done.exception, InvalidQuantity)
    assert "One" not in done.output
