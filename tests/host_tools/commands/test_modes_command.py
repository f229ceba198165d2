"""`host_tools modes`: a chapter that is measured anew leaves those that were measured before on the page."""

from __future__ import annotations

import json
from pathlib import Path

from typer.testing import CliRunner, Result

from host_tools.__main__ import app
from host_tools.pages.benchmark import Chapter, at_most
from host_tools.pages.page import Results, Timed, write_page


def modes(*words: str) -> Result:
    return CliRunner().invoke(app, ["modes", *words])


def test_the_page_keeps_chapters_that_are_not_measured_with_how_they_were(tmp_path: Path) -> None:
    out = tmp_path / "modes.md"
    zero = at_most("a scan", "shift of the depth (mm)", 0.1, 0.2)
    before = Chapter("What a zero drift costs", "Measured long ago.", "scores/span.py", (zero,))
    write_page(out, Results("modes", "host_tools modes --only span", {"span": Timed(before, 36.2)}, date="2026-01-01"))
    done = modes("--only", "coverage", "--out", str(out))
    assert done.exit_code in (0, 1), done.output  # 1: a figure misses its bound
    found = json.loads((tmp_path / "results" / "modes.json").read_text())["chapters"]
    assert list(found) == ["coverage", "span"]
    assert found["span"]["claim"] == "Measured long ago."
    assert found["span"]["facts"]["date"] == "2026-01-01"
    text = out.read_text()
    for name in found:
        facts = found[name]["facts"]
        assert f"measured by `{facts['command']}`, software {facts['software']}, {facts['date']}." in text
    assert "\n## What a zero drift costs\n" in text


def test_a_chapter_that_is_not_one_is_refused() -> None:
    done = modes("--only", "colour")
    assert done.exit_code == 1
    assert "one of dial, coverage, posterior" in str(done.exception)
