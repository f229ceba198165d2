"""The document says what was measured, by which command, and what failed or was left out."""

import pytest

from device import __version__
from host_tools.pages.benchmark import Chapter, Figure, Table, at_most, relative
from host_tools.pages.document import Timed, write_document

FIGURE = Figure("line.svg", "A line", lambda figure: figure.subplots().plot([0, 1]))
GOOD = Chapter(
    "Good",
    "It holds.",
    "Paper, p. 1.",
    (relative("one", "force (N)", 1.01, 1.0, 0.1),),
    (Table("More", ("a",), (("b",),)),),
)
BAD = Chapter("Bad", "It fails.", "Paper, p. 2.", (at_most("two", "noise", 2.0, 1.0),), figures=(FIGURE,))
ABSENT = Chapter("Absent", "It is not there.", "Manual.", skipped="the program is not installed")


@pytest.fixture
def document(tmp_path):
    path = tmp_path / "verification.md"
    chapters = {chapter.title: Timed(chapter, 1.5) for chapter in (GOOD, BAD, ABSENT)}
    write_document(path, chapters, command="host_tools verify --out verification.md")
    return path


def test_it_names_command_and_version_and_counts_what_holds(document):
    text = document.read_text()
    assert f"`host_tools verify --out verification.md`, software {__version__}" in text
    assert "1 of 2 benchmarks hold" in text
    assert "## What this does not show" in text


def test_it_shows_failures_and_what_was_skipped(document):
    text = document.read_text()
    assert "| two | noise | 2 |  | 2.0e+00 | 1 | **fails** |" in text
    assert "| one | force (N) | 1.01 | 1 | 1.0e-02 | 0.1 | holds |" in text
    assert "**Skipped**: the program is not installed." in text


def test_its_figures_exist_and_are_the_same_every_time(document):
    figure = document.parent / "figures" / "line.svg"
    assert "![A line](figures/line.svg)" in document.read_text()
    first = figure.read_bytes()
    write_document(document, {"bad": Timed(BAD, 0.0)}, command="again")
    assert figure.read_bytes() == first
