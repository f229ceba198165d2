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


LONG_CHAPTERS = (pytest.param(name, marks=pytest.mark.long) for name in ("forward", "tolerances", "modes"))


@pytest.mark.parametrize("chapter", ["networks", *LONG_CHAPTERS])
def test_a_chapter_becomes_a_page_with_its_figure(tmp_path: Path, chapter: str) -> None:
    out = tmp_path / "tradeoff.md"
    done = tradeoff("--only", chapter, "--out", str(out))
    assert done.exit_code == 0, done.output
    assert list(measured(out)) == [chapter]
    text = out.read_text()
    (figure,) = measured(out)[chapter]["figures"]
    assert f"(figures/{figure['name']})" in text
    assert (tmp_path / "figures" / figure["name"]).read_text().startswith("<?xml")
    assert "| front |" in text


@pytest.mark.long
def test_all_chapters_are_one_page(tmp_path: Path) -> None:
    out = tmp_path / "tradeoff.md"
    done = tradeoff("--out", str(out))
    assert done.exit_code == 0, done.output
    assert list(measured(out)) == ["forward", "tolerances", "light", "frames", "networks", "modes"]


def test_a_chapter_that_is_not_one_is_refused() -> None:
    done = tradeoff("--only", "colour")
    assert done.exit_code == 1
    assert "one of forward, tolerances, light, frames, networks, modes" in str(done.exception)
