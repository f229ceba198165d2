"""`host_tools tradeoff`: from nothing to a page with figures, on the smallest of everything."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from host_tools.__main__ import app


def tradeoff(*words: str) -> Result:
    return CliRunner().invoke(app, ["tradeoff", "--short", *words])


def measured(out: Path) -> dict[str, dict]:
    return json.loads((out.parent / "results" / f"{out.stem}.json").read_text())["chapters"]


def has_its_figure(out: Path, chapter: str) -> bool:
    (figure,) = measured(out)[chapter]["figures"]
    drawn = (out.parent / "figures" / figure["name"]).read_text()
    return f"(figures/{figure['name']})" in out.read_text() and drawn.startswith("<?xml")


def test_a_chapter_becomes_a_page_with_its_figure(tmp_path: Path) -> None:
    out = tmp_path / "tradeoff.md"
    done = tradeoff("--only", "networks", "--out", str(out))
    assert done.exit_code == 0, done.output
    assert list(measured(out)) == ["networks"]
    assert has_its_figure(out, "networks")
    assert "| front |" in out.read_text()


@pytest.mark.long
def test_all_chapters_are_one_page(tmp_path: Path) -> None:
    out = tmp_path / "tradeoff.md"
    done = tradeoff("--out", str(out))
    assert done.exit_code == 0, done.output
    chapters = ["forward", "tolerances", "light", "frames", "networks", "modes"]
    assert list(measured(out)) == chapters
    assert all(has_its_figure(out, chapter) for chapter in chapters)
    assert out.read_text().count("| front |") >= len(chapters)


def test_a_chapter_that_is_not_one_is_refused() -> None:
    done = tradeoff("--only", "colour")
    assert done.exit_code == 1
    assert "one of forward, tolerances, light, frames, networks, modes" in str(done.exception)
