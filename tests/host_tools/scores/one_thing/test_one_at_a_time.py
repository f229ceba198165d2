"""What a row must reach, how far a quantity may be off by its rows, and a chapter from nothing to its tables."""

import json

import numpy as np
import pytest
from told_answers import told_presses
from typer.testing import CliRunner

from device.files.bundle_file import read_quick_model, read_ramp_model
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.pages.page import Results, Timed, write_page
from host_tools.press_models.press_derivatives import load_derivatives
from host_tools.scenes.phantom_set import BLOCKS_NEEDED, read_phantoms
from host_tools.scores.one_thing.causes import causes
from host_tools.scores.one_thing.one_at_a_time import (
    AFTER,
    TITLES,
    _benchmarks,
    _largest_held,
    _rows_held,
    holds,
    one_at_a_time_chapter,
)
from host_tools.scores.one_thing.press_answers import DesignToTry
from host_tools.scores.scored_presses import FIGURES


def test_a_row_holds_but_for_one_deviation_of_chance():
    assert holds(told_presses(36, wrong=4))
    assert holds(told_presses(33, wrong=7))  # 82.5 % of 40; 86 % less 5.5 %
    assert not holds(told_presses(32, wrong=8))
    assert holds(told_presses(37, refused=3))
    assert not holds(told_presses(36, refused=4))


def test_a_mode_that_may_refuse_needs_to_cover_what_it_answers():
    assert holds(told_presses(4, refused=36), may_refuse=True)
    assert holds(told_presses(0, refused=40), may_refuse=True)
    assert not holds(told_presses(2, wrong=2, refused=36), may_refuse=True)
    assert not holds(told_presses(0, refused=40))


def test_the_largest_size_that_holds_has_none_below_it_that_does_not():
    sizes = ("0.3 %", "0.5 %", "1 %")
    assert _largest_held(sizes, [True, True, True]) == "all tried"
    assert _largest_held(sizes, [True, False, True]) == "up to 0.3 %"
    assert _largest_held(sizes, [False, True, True]) == "**none tried**"
    assert _largest_held(("+2 %", "-2 %"), [False, True]) == "-2 %"
    assert _largest_held(("0.5 mm",), [True]) == "0.5 mm"


def test_a_chapter_that_is_not_one_is_refused() -> None:
    done = CliRunner().invoke(app, ["robustness", "--only", "colour"])
    assert done.exit_code == 1
    assert isinstance(done.exception, InvalidQuantity)
    assert "one of tolerances, held, other optics, one at a time, silent errors, skins, uneven tissue, named" in str(
        done.exception
    )


def test_each_row_has_bounds_of_its_own_in_the_modes_that_have_to_do_with_it():
    tried = [
        one for one in causes() if one.name in ("nothing", "load cell's span +2 %", "optical axis, not undone 0.5 mm")
    ]
    of_mode = [told_presses(40), told_presses(33, wrong=7), told_presses(0, refused=40)]
    found = dict.fromkeys(AFTER.values(), of_mode)
    judged = {(one.case, one.quantity.removesuffix(" (at least)")): one for one in _benchmarks(tried, found)}
    assert {case for case, _ in judged} == {
        "quick, nothing", "quick, load cell's span +2 %", "standard, nothing", "standard, load cell's span +2 %",
        "precise, nothing", "precise, load cell's span +2 %",
    }  # fmt: skip
    assert ("quick, nothing", "answered") not in judged
    missed = [key for key, one in judged.items() if not one.passed]
    assert missed == [(f"{mode}, load cell's span +2 %", "size_mm covered, determined") for mode in AFTER]
    assert _rows_held("standard", tried, of_mode) == {"bounded": 2, "reached": 1, "but_for_chance": 2}


def test_mode_quick_may_refuse_a_row():
    (tilted,) = [one for one in causes() if one.name == "tilt on the lesion 0.5 degrees"]
    ramps = {name: [told_presses(40)] for name in AFTER.values()}
    cases = {one.case for one in _benchmarks([tilted], ramps | {"quick after": [told_presses(0, refused=40)]})}
    assert cases == {f"{mode}, {tilted.name}" for mode in ("standard", "precise")}
    assert _rows_held("quick", [tilted], [told_presses(0, refused=40)])["reached"] == 1


@pytest.mark.long
def test_a_few_things_become_tables_and_a_figure(tables, tmp_path):
    design = DesignToTry(
        read_ramp_model(MODELS / "standard"),
        read_quick_model(MODELS / "quick"),
        load_derivatives(SIMULATED_PROBE),
        tables,
    )
    phantoms = read_phantoms(SIMULATED_PROBE / "phantoms.toml", blocks_needed=BLOCKS_NEEDED)
    tried = [
        one for one in causes() if one.name in ("nothing", "load cell's span +2 %", "tilt on the lesion 0.5 degrees")
    ]
    chapter = one_at_a_time_chapter(design, phantoms, presses=6, scans=2, tried=tried, own_quick=design.quick, jobs=1)
    assert [table.caption for table in chapter.tables[1:]] == list(TITLES.values())
    tightness, as_it_ships, after, *_ = chapter.tables
    assert [row[0] for row in tightness.rows] == ["load cell's span", "tilt on the lesion"]
    assert [row[2] for row in after.rows] == ["tolerances", "commissioned", "tolerances"]
    refused = {row[0]: row[2 + FIGURES.index("refused")] for row in as_it_ships.rows}
    assert refused["tilt on the lesion"] == "100 %"
    answered = {row[0]: int(row[3 + FIGURES.index("answered")]) for row in after.rows}
    assert min(answered.values()) >= 3
    out = tmp_path / "robustness.md"
    results = Results("robustness", "host_tools robustness", {"one at a time": Timed(chapter, 1.0)})
    write_page(out, results.in_chapters(out, ["tolerances", "one at a time"]))
    assert "(figures/robustness_one_thing.svg)" in out.read_text()
    assert (tmp_path / "figures" / "robustness_one_thing.svg").read_text().startswith("<?xml")
    facts = json.loads((tmp_path / "results" / "robustness.json").read_text())["chapters"]["one at a time"]["facts"]
    assert facts["command"] == "host_tools robustness"
    assert np.isfinite(chapter.benchmarks[0].measured)
