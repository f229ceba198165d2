"""CalculiX is optional: absent it is skipped by name, but when it runs and fails the chapter fails."""

import pytest

from host_tools.verification import mechanics
from host_tools.verification.cross_check.calculix import CalculixFailed


def test_without_the_program_the_chapter_says_why_it_is_skipped(monkeypatch):
    monkeypatch.setattr(mechanics, "ccx_available", lambda: False)
    chapter = mechanics.chapter(short=False)
    assert "not installed" in chapter.skipped
    assert not chapter.benchmarks


@pytest.fixture
def failing(monkeypatch):
    def fail():
        raise CalculixFailed("ccx reached 2 of 3 indentations")

    monkeypatch.setattr(mechanics, "ccx_available", lambda: True)
    monkeypatch.setattr(mechanics, "ccx_version", lambda: "2.20")
    monkeypatch.setattr(mechanics, "RUNS", {"any": fail})


def test_a_run_that_stops_short_is_a_failure_and_no_skip(failing):
    chapter = mechanics.chapter(short=False)
    assert not chapter.skipped
    assert not chapter.passed
    assert "2 of 3" in chapter.benchmarks[0].quantity
