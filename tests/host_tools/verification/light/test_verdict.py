"""A verdict stands only while its numbers do; the page knows its chapters and what it cannot show."""

from __future__ import annotations

from dataclasses import replace

from host_tools.verification.light.chapters import LIMITS, cover, optics_chapters
from host_tools.verification.light.verdict import Finding, findings

RAYS = 50_000
FOUND = Finding("Light is trapped", "0.4 % leaves", "confirmed", supported=True)


def test_a_verdict_without_support_is_open() -> None:
    assert FOUND.row() == "| Light is trapped | 0.4 % leaves | confirmed |"
    assert "**open**" in replace(FOUND, supported=False).row()


def test_every_verdict_is_supported_even_by_few_rays() -> None:
    assert [f.statement for f in findings(RAYS) if not f.supported] == []


def test_the_page_opens_with_the_verdicts_and_says_that_all_is_simulated() -> None:
    page = cover(RAYS)
    assert [line for line in page.opening if line.startswith("| Untouched")]
    assert any("is simulated" in line for line in page.opening)
    assert any("contact is assumed" in limit for limit in LIMITS)


def test_mitsuba_is_left_out_unless_asked_for() -> None:
    chapters = optics_chapters(RAYS)
    assert list(chapters)[-1] == "mitsuba"
    assert "not asked for" in chapters["mitsuba"]().skipped
