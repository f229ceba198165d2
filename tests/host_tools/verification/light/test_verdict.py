"""A verdict stands only while its numbers do; the page knows its chapters and what it cannot show."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from host_tools.pages.page import Results, write_page
from host_tools.verification.light.chapters import optics_chapters
from host_tools.verification.light.verdict import facts

RAYS = 50_000


@pytest.fixture(scope="module")
def found() -> dict[str, Any]:
    return facts(RAYS)


def rows(folder: Path, found: dict[str, Any]) -> list[str]:
    """Return the rows of the table of verdicts."""
    page = folder / "optics.md"
    write_page(page, Results("optics", "host_tools optics verify", facts=found))
    text = page.read_text()
    assert "is simulated" in text
    assert "contact is assumed" in text
    return text.split("| statement |")[1].split("\n\n")[0].splitlines()[2:]


def test_every_verdict_is_supported_even_by_few_rays(found: dict[str, Any], tmp_path: Path) -> None:
    verdicts = rows(tmp_path, found)
    assert len(verdicts) == 7
    assert [row for row in verdicts if "**open**" in row] == []


@pytest.mark.parametrize(
    ("wrong", "statement"),
    [
        ({"contact_over_dark": 99.0}, "Untouched"),
        ({"caught_ratio": 1e-6}, "Deformation"),
        ({"bent_change": -0.1}, "Contact"),
        ({"dimples_brightness": [0.98, 1.03, 0.76]}, "Deeper"),
        ({"dimples_brightness": [0.98, 0.97, 0.99]}, "Deeper"),
        ({"gain_of_doubling": 1.9}, "The sum"),
        ({"wet_change": 0.1}, "(not in the paper) Gel"),
        ({"contrast_cast": 30.0}, "(not in the paper) Where"),
    ],
)
def test_a_verdict_without_support_is_open(
    wrong: dict[str, Any], statement: str, found: dict[str, Any], tmp_path: Path
) -> None:
    opened = [row for row in rows(tmp_path, found | wrong) if "**open**" in row]
    assert len(opened) == 1
    assert opened[0].startswith(f"| {statement}")


def test_mitsuba_is_left_out_unless_asked_for() -> None:
    chapters = optics_chapters(RAYS)
    assert list(chapters)[-1] == "mitsuba"
    assert "not asked for" in chapters["mitsuba"]().skipped
