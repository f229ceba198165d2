"""`host_tools paper`: what it is given, what it writes, and the exit code."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

from device.measurement.quantities import InvalidQuantity
from device.simulation import virtual_probe
from device.simulation.virtual_probe import ProbeTables
from host_tools.__main__ import app
from host_tools.data import dataset
from host_tools.pages.benchmark import Table
from host_tools.pages.page import RESULTS
from host_tools.replication import page as paper_page
from host_tools.replication import study as paper_study


def run(*words: object) -> Any:
    return CliRunner().invoke(app, ["paper", *map(str, words)])


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same small table for every one of the page's, and the facts of the page with the seeds asked for."""
    measured = json.loads((RESULTS / "paper_protocol.json").read_text())
    table = Table("Errors", ("unknown", "error [%]"), (("size", "7"),))

    rows = SimpleNamespace(excluded_rows=4, features=range(80), scene_defaults={})
    monkeypatch.setattr(dataset, "training_rows", lambda path: rows)
    monkeypatch.setattr(ProbeTables, "load", lambda folder: None)
    monkeypatch.setattr(virtual_probe, "table_record", lambda folder, name: {})
    monkeypatch.setattr(paper_study, "PaperStudy", lambda rows, tables, seeds: SimpleNamespace(seeds=seeds))
    monkeypatch.setattr(paper_page, "paper_tables", lambda study: dict.fromkeys(measured["tables"], lambda: table))
    monkeypatch.setattr(paper_page, "paper_facts", lambda study: measured["facts"] | {"seeds": study.seeds})


def test_tables_are_printed_and_rows_that_are_left_out_are_counted() -> None:
    done = run()
    assert done.exit_code == 0
    assert "error [%]" in done.output
    assert "4 scenes of" in done.output


def test_the_first_line_says_which_scenes_which_force_and_how_many_seeds(tmp_path: Path) -> None:
    done = run("--data", tmp_path / "sweep.nc", "--seeds", 2)
    assert done.stdout.splitlines()[0] == f"80 scenes of {tmp_path / 'sweep.nc'}, 0.5 N, 2 seeds"


def test_tables_of_another_waveguide_than_the_sweeps_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    other = {"scene_defaults": {"waveguide": {"radius_mm": 9.0}}}
    monkeypatch.setattr(virtual_probe, "table_record", lambda folder, name: other)
    done = run()
    assert str(done.exception).startswith("radius_mm of the sweep is 11 mm, but must be 9 mm, as the images")
    assert "Errors" not in done.output


def test_the_page_repeats_the_command(tmp_path: Path) -> None:
    page = tmp_path / "paper.md"
    assert run("--out", page).exit_code == 0
    assert "`host_tools paper --out paper.md`" in page.read_text()
    run("--seeds", 5, "--out", page)
    assert "`host_tools paper --seeds 5 --out paper.md`" in page.read_text()
    assert "## Levenberg-Marquardt beside scaled conjugate gradient, 5 seeds\n" in page.read_text()
    assert json.loads((tmp_path / "results" / "paper.json").read_text())["facts"]["seeds"] == 5
    run("--data", tmp_path / "other.nc", "--table", tmp_path / "tables", "--out", page)
    assert "`host_tools paper --data other.nc --table tables --out paper.md`" in page.read_text()


def test_a_page_of_another_type_is_refused_before_anything_is_measured(tmp_path: Path) -> None:
    done = run("--out", tmp_path / "paper.txt")
    assert isinstance(done.exception, InvalidQuantity)
    assert "Errors" not in done.output
