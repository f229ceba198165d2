"""`host_tools evaluate --noise-free`, `--posterior` and `--scan`: which chapters are measured, and what is printed."""

from __future__ import annotations

import json
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from device.files import bundle_file
from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.pages.benchmark import Chapter, Table, at_most
from host_tools.scores import noise_free as mode_noise_free
from host_tools.scores import posterior as mode_posterior
from host_tools.scores import scan as mode_scan


def chapter(title: str, error: float = 0.4) -> Chapter:
    table = Table("Shown numbers", ("unknown", "mean"), (("size_mm", "0.321"),))
    return Chapter(title, f"Claim of {title}.", "here", (at_most("size_mm", "mean error (%)", error, 0.5),), (table,))


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, dict[str, object]]]:
    """Chapters of two numbers; what they are asked for is kept."""
    kept: list[tuple[str, dict[str, object]]] = []

    def noise_free(answers: object, tables: object, **options: object) -> Chapter:
        kept.append(("noise-free", options))
        return chapter("Without noise")

    def posterior(model: object, **options: object) -> Chapter:
        kept.append(("posterior", options))
        return chapter("Beside the posterior")

    def scan(model: object, **options: object) -> Chapter:
        kept.append(("scan", options))
        return chapter("Ramp by ramp")

    monkeypatch.setattr(bundle_file, "read_ramp_model", lambda path: SimpleNamespace(answers=None))
    monkeypatch.setattr(mode_scan, "scan_chapter", scan)
    monkeypatch.setattr(mode_noise_free, "noise_free_chapter", noise_free)
    monkeypatch.setattr(mode_posterior, "posterior_chapter", posterior)
    return kept


def evaluate(*options: str):
    return CliRunner().invoke(app, ["evaluate", *options])


def test_both_chapters_are_printed_with_their_benchmarks_and_tables(asked):
    done = evaluate("--noise-free", "--posterior")
    assert done.exit_code == 0, done.output
    for words in (
        "Without noise",
        "Beside the posterior",
        "Claim of Without noise.",
        "Shown numbers",
        "0.321",
        "holds",
    ):
        assert words in done.output
    assert asked == [
        ("noise-free", {"seed": 1000}),
        ("posterior", {"seed": 1000}),
    ]


def test_json_holds_the_chapters(asked):
    done = evaluate("--noise-free", "--json")
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert found["chapters"]["noise-free"]["benchmarks"][0]["measured"] == 0.4
    assert (found["asked"]["seed"], found["asked"]["scenes"], found["asked"]["certificate"]) == (1000, None, None)


@pytest.mark.parametrize(("name", "mode"), [("posterior", "standard"), ("scan", "precise")])
def test_scenes_and_seed_are_those_asked_for(asked, name, mode):
    assert evaluate(f"--{name}", "--mode", mode, "--scenes", "7", "--seed", "3").exit_code == 0
    assert asked == [(name, {"scenes": 7, "seed": 3})]


def test_presses_without_noise_are_as_many_as_asked_for(asked):
    assert evaluate("--noise-free", "--scenes", "50").exit_code == 0
    assert asked == [("noise-free", {"presses": 50, "seed": 1000})]


def test_a_figure_that_misses_its_bound_is_exit_code_1_and_is_still_printed(asked, monkeypatch):
    monkeypatch.setattr(mode_noise_free, "noise_free_chapter", lambda *_, **__: chapter("Missed", 0.6))
    done = evaluate("--noise-free")
    assert done.exit_code == 1
    assert "fails" in done.output
    assert "0.321" in done.output


@pytest.mark.parametrize(
    ("name", "mode", "expected"),
    [("noise-free", "quick", "standard"), ("posterior", "precise", "standard"), ("scan", "standard", "precise")],
)
def test_a_mode_that_a_chapter_is_not_of_is_refused(asked, name, mode, expected):
    done = evaluate(f"--{name}", "--mode", mode)
    assert isinstance(done.exception, InvalidQuantity)
    assert f"mode is {mode}, but must be {expected}" in str(done.exception)
    assert asked == []


def test_recordings_have_no_reference_and_are_refused(asked, tmp_path):
    done = evaluate("--posterior", str(tmp_path))
    assert "recordings is 1, but must be none" in str(done.exception)
    assert asked == []
