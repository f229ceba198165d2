"""A page is its results in its template: what was measured, by which command, and what failed or was left out."""

import json
from math import nan

import pytest

from device import __version__
from host_tools.pages.benchmark import Chapter, Figure, Table, at_least, at_most, relative
from host_tools.pages.page import DOCS, RESULTS, TEMPLATES, Results, Timed, dumps, percent, render, write_page

FIGURE = Figure("line.svg", "A line", lambda figure: figure.subplots().plot([0, 1]))
ROWS = (
    ("8.00", "42%", "1.5 %", "3 of 4", "16"),
    ("10.48", "7%", "12.0 %", "-", "1e-06"),
    ("a guess", "", "0.1 %", "", "6.37"),
)
GOOD = Chapter(
    "Good",
    "It holds.",
    "Paper, p. 1.",
    (relative("one", "force (N)", 1.01, 1.0, 0.1),),
    (Table("More", ("a", "b", "c", "d", "e"), ROWS),),
)
BAD = Chapter("Bad", "It fails.", "Paper, p. 2.", (at_most("two", "noise", 2.0, 1.0),), figures=(FIGURE,))
ABSENT = Chapter("Absent", "It is not there.", "Manual.", skipped="the program is not installed")
BROKEN = Chapter("Broken", "It broke.", "Manual.", (at_most("three", "no number", nan, 1.0),))


@pytest.fixture
def page(tmp_path):
    path = tmp_path / "verification.md"
    named = zip(("patch", "hertz", "rates", "hayes"), (GOOD, BAD, ABSENT, BROKEN), strict=True)
    chapters = {name: Timed(chapter, 1.5) for name, chapter in named}
    write_page(path, Results("verification", "host_tools verify --out verification.md", chapters))
    return path


@pytest.fixture
def record(page):
    return json.loads((page.parent / "results" / "verification.json").read_text())


def test_it_names_command_and_version_and_counts_what_holds(page):
    text = page.read_text()
    assert f"`host_tools verify --out verification.md`, software {__version__}" in text
    assert "1 of 3 benchmarks hold" in text
    assert "## What this does not show" in text


def test_it_shows_failures_and_what_was_skipped(page):
    text = page.read_text()
    assert "| two | noise | 2 |  | 2.0e+00 | 1 | **fails** |" in text
    assert "| three | no number | nan |  | nan | 1 | **fails** |" in text
    assert "| one | force (N) | 1.01 | 1 | 1.0e-02 | 0.1 | holds |" in text
    assert "**Skipped**: the program is not installed." in text


def test_of_several_that_fall_short_the_farthest_is_told(tmp_path):
    """Misses of a bound of 0 use up the same share of it: all that there is."""
    short = Chapter("Short", "", "", tuple(at_least("one", name, got, 0.9) for name, got in (("a", 0.8), ("b", 0.3))))
    path = tmp_path / "verification.md"
    write_page(path, Results("verification", "host_tools verify", {"patch": Timed(short, 1.0)}))
    assert "b (at least): 6.0e-01 of 0" in path.read_text(encoding="utf-8")


def test_claim_prose_and_source_stand_above_the_numbers(page):
    text = page.read_text()
    assert "## Bad\n\nIt fails.\nRadius and peak are" in text
    assert "the benchmark is its limit.\n\nSource: Paper, p. 2.\n\n| case |" in text


def test_its_figures_exist_and_are_the_same_every_time(page):
    figure = page.parent / "figures" / "line.svg"
    assert "![A line](figures/line.svg)" in page.read_text()
    first = figure.read_bytes()
    write_page(page, Results("verification", "again", {"hertz": Timed(BAD, 0.0)}))
    assert figure.read_bytes() == first


def test_numbers_are_numbers_in_the_results_and_cells_as_they_were_on_the_page(page, record):
    table = record["chapters"]["patch"]["tables"][0]
    assert table["rows"] == [
        [8.0, 0.42, 1.5, "3 of 4", 16],
        [10.48, 0.07, 12.0, "-", 1e-06],
        ["a guess", "", 0.1, "", 6.37],
    ]
    for row in ROWS:
        assert f"| {' | '.join(row)} |" in page.read_text()
    assert record["chapters"]["patch"]["benchmarks"][0]["measured"] == 1.01
    assert record["chapters"]["hayes"]["benchmarks"][0]["error"] is None


def test_results_have_a_row_in_a_line():
    table = {"caption": "Long", "rows": [[number, "a cell of a row"] for number in range(20)]}
    assert dumps(table).splitlines()[1:4] == [' "caption": "Long",', ' "rows": [', '  [0, "a cell of a row"],']
    assert json.loads(dumps(table)) == table


def test_a_chapter_that_the_template_leaves_out_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"verification.md.jinja has no chapter Good: add it there"):
        write_page(tmp_path / "page.md", Results("verification", "verify", {"not_there": Timed(GOOD, 0.0)}))


@pytest.mark.parametrize(
    ("ratio", "text"), [(0.0123, "1.2"), (0.5, "50"), (0.997, "100"), (1.54, "154"), (12.0, ">1000"), (None, ">1000")]
)
def test_bounds_are_written_to_two_digits_as_far_as_they_mean_anything(ratio, text):
    assert percent(ratio) == text


def test_every_template_has_results():
    assert {path.stem for path in RESULTS.glob("*.json")} == {path.name[:-9] for path in TEMPLATES.glob("*.md.jinja")}


@pytest.mark.parametrize("record", sorted(RESULTS.glob("*.json")), ids=lambda path: path.stem)
def test_every_page_of_docs_is_what_its_results_and_template_say(record):
    """`host_tools pages` writes it anew."""
    assert (DOCS / f"{record.stem}.md").read_text(encoding="utf-8") == render(record)


@pytest.mark.parametrize("record", sorted(RESULTS.glob("*.json")), ids=lambda path: path.stem)
def test_no_verdict_of_a_page_is_open(record):
    assert "**open**" not in render(record)


def test_a_chapter_that_is_not_measured_again_stays_as_it_is(tmp_path):
    out, order = tmp_path / "verification.md", ("patch", "rates", "hayes")
    write_page(out, Results("verification", "first", {"patch": Timed(GOOD, 1.5)}, date="2025-01-01"))
    for command, name, chapter in (("second", "hayes", ABSENT), ("third", "rates", BAD), ("fourth", "hayes", BROKEN)):
        write_page(out, Results("verification", command, {name: Timed(chapter, 2.0)}).in_chapters(out, order))
    found = json.loads((tmp_path / "results" / "verification.json").read_text())["chapters"]
    assert list(found) == list(order)
    assert [found[name]["facts"]["command"] for name in order] == ["first", "third", "fourth"]
    assert found["patch"]["facts"]["date"] == "2025-01-01"
    assert found["patch"]["tables"][0]["rows"][1][0] == 10.48
    assert "## Good" in out.read_text()
    assert "## Broken" in out.read_text()
    assert "## Absent" not in out.read_text()
