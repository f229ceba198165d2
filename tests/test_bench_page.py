"""The page of `make bench`: medians of all runs beside their bounds, and what was asked for and is not reached."""

import json
from dataclasses import replace

import pytest
from bench_page import medians, write_speed
from bench_table import Figure

ORDER = ("work", "daemon", "endurance")
STANDARD = Figure(
    "work on a frame, a press and a scene",
    "press, mode standard: frames to an estimate",
    330.0,
    bound=380,
    here="80 ms here",
)
ANSWER = Figure("daemon of a probe", "standard: last frame to answer", 500.0, bound=850.0, here="120 ms here")


def written(folder, runs):
    write_speed(folder / "speed.md", ORDER, runs, dict.fromkeys(runs, 60.0))
    return (folder / "speed.md").read_text(), json.loads((folder / "results" / "speed.json").read_text())


def rows(page, name):
    return [[cell.strip() for cell in line.split("|")[1:-1]] for line in page.splitlines() if f"| {name} |" in line]


def test_a_figure_of_several_runs_is_their_median_and_one_bad_run_misses_nothing(tmp_path):
    runs = [[replace(STANDARD, value=value)] for value in (330.0, 500.0, 340.0)]
    page, found = written(tmp_path, {"work": runs})
    (row,) = rows(page, STANDARD.name)
    assert row[1:] == ["340", "330", "500", "yardsticks", "at most 380", "80 ms", "holds"]
    assert found["chapters"]["work"]["facts"]["missed"] == []
    assert "## Work on a frame, a press and a scene" in page


def test_a_figure_that_is_not_in_every_run_is_said():
    with pytest.raises(ValueError, match="is 1 times in 2 runs"):
        medians([[STANDARD], [replace(STANDARD, name="of 601 frames")]])


def test_a_median_beyond_its_bound_is_missed(tmp_path):
    runs = [[replace(STANDARD, value=value)] for value in (390.0, 300.0, 400.0)]
    page, found = written(tmp_path, {"work": runs})
    assert rows(page, STANDARD.name)[0][-1] == "**missed**"
    assert found["chapters"]["work"]["facts"]["missed"] == [STANDARD.name]


@pytest.mark.parametrize("value", [333.0, 90.0])
def test_what_was_asked_for_stands_beside_what_it_takes_until_it_is_reached(tmp_path, value):
    page, _ = written(tmp_path, {"work": [[replace(STANDARD, value=value)]]})
    (line,) = (line for line in page.splitlines() if line.startswith("- **25 ms of computing in mode standard"))
    assert f"100 yardsticks**: {value:.0f}." in line
    assert ("**open**" in line) == (value <= 100)


def test_chapters_of_before_stay_beside_those_that_are_run_again(tmp_path):
    written(tmp_path, {"work": [[STANDARD]], "daemon": [[ANSWER]]})
    page, found = written(tmp_path, {"daemon": [[replace(ANSWER, value=480.0)]]})
    assert list(found["chapters"]) == ["work", "daemon"]
    assert [rows(page, one.name)[0][1] for one in (STANDARD, ANSWER)] == ["330", "480"]
    assert 'make bench ONLY="daemon" RUNS=1 OUT=docs/speed.md' in page
