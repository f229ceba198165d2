"""`host_tools verify`: which chapters run, what is written, and the exit code."""

import json

import pytest
from typer.testing import CliRunner

from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.pages.benchmark import Chapter, at_most
from host_tools.verification import chapters


def run(*words):
    return CliRunner().invoke(app, ["verify", *words])


@pytest.fixture
def fakes(monkeypatch):
    """Two chapters, of which the second misses its bound."""
    asked = []

    def fake(name, error):
        def chapter(short):
            asked.append((name, short))
            return Chapter(name, "", "", (at_most("case", "noise", error, 1.0),))

        return chapter

    monkeypatch.setattr(chapters, "CHAPTERS", {"patch": fake("patch", 0.5), "hertz": fake("hertz", 2.0)})
    return asked


def test_a_missed_bound_is_exit_code_1(fakes):
    assert run().exit_code == 1
    assert fakes == [("patch", False), ("hertz", False)]


def test_only_the_chapters_asked_for_are_run(fakes):
    assert run("--only", "patch", "--short").exit_code == 0
    assert fakes == [("patch", True)]


def test_an_unknown_chapter_is_refused_before_anything_runs(fakes):
    result = run("--only", "patch", "--only", "nothing")
    assert isinstance(result.exception, InvalidQuantity)
    assert "nothing" in str(result.exception)
    assert "patch, hertz, extremes" in str(result.exception)
    assert fakes == []


def test_a_longer_chapter_is_run_by_its_name_with_its_own_scenes(fakes, monkeypatch):
    drawn = []

    def fake(**asked):
        drawn.append(asked)
        return Chapter("Tolerances", "", "", (at_most("case", "noise", 0.5, 1.0),))

    monkeypatch.setattr(chapters, "EXTRA_CHAPTERS", {"tolerances": fake})
    assert run("--only", "tolerances", "--scenes", "7", "--seed", "3").exit_code == 0
    assert (drawn, fakes) == ([{"scenes": 7, "seed": 3}], [])
    refused = run("--only", "patch", "--scenes", "7")
    assert isinstance(refused.exception, InvalidQuantity)
    assert "given with --tolerances" in str(refused.exception)


def test_chapters_that_are_not_measured_stay_on_the_page_with_how_they_were(fakes, tmp_path):
    out = tmp_path / "verification.md"
    for name in ("patch", "hertz"):
        run("--only", name, "--out", str(out))
    for line in (
        "| patch | `host_tools verify --only patch ",
        "| hertz | `host_tools verify --only hertz ",
    ):
        assert line in out.read_text()


def test_chapters_that_were_measured_before_an_interrupt_stand_on_the_page(fakes, monkeypatch, tmp_path):
    def interrupted(short):
        raise KeyboardInterrupt

    out = tmp_path / "verification.md"
    monkeypatch.setitem(chapters.CHAPTERS, "hertz", interrupted)
    assert run("--out", str(out)).exit_code != 0
    assert "\n## patch\n" in out.read_text()
    assert list(json.loads((tmp_path / "results" / "verification.json").read_text())["chapters"]) == ["patch"]


def test_the_document_repeats_the_command(fakes, tmp_path):
    out = tmp_path / "verification.md"
    run("--only", "patch", "--short", "--out", str(out))
    assert "`host_tools verify --only patch --short --out verification.md`" in out.read_text()
