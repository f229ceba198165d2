"""`host_tools optics`: what is asked of the tracer, what is written, and the exit code."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.optics import build_lookup
from host_tools.pages.benchmark import Chapter, at_most
from host_tools.pages.page import RESULTS
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import NAME, probe_text, simulated_probe
from host_tools.verification.light import chapters, verdict

Asked = list[dict[str, object]]


def run(*words: object) -> Any:
    return CliRunner().invoke(app, ["optics", *map(str, words)])


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Asked:
    """One chapter whose error is a millionth of the rays; holds up to a million."""
    calls: Asked = []

    def fake(rays: int, **options: object) -> dict[str, Callable[[], Chapter]]:
        calls.append({"rays": rays, **options})
        return {"angles": lambda: Chapter("One", "", "", (at_most("case", "noise", rays / 1e6, 1.0),))}

    monkeypatch.setattr(chapters, "optics_chapters", fake)
    measured = json.loads((RESULTS / "optics.json").read_text())["facts"]
    monkeypatch.setattr(verdict, "facts", lambda rays: measured | {"contact_over_dark": rays})
    return calls


def test_a_missed_bound_is_exit_code_1(asked: Asked) -> None:
    assert run("verify", "--rays", 100_000).exit_code == 0
    assert run("verify").exit_code == 1
    assert [call["rays"] for call in asked] == [100_000, 2_000_000]


def test_mitsuba_and_its_interpreter_are_passed_on(asked: Asked) -> None:
    run("verify", "--mitsuba", "--mitsuba-python", "/there/python")
    assert asked == [{"rays": 2_000_000, "mitsuba": True, "mitsuba_python": Path("/there/python")}]


def test_the_page_repeats_the_command_without_paths_of_the_machine(asked: Asked, tmp_path: Path) -> None:
    page = tmp_path / "optics.md"
    run("verify", "--rays", 150_000, "--mitsuba", "--mitsuba-python", "/there/python", "--out", page)
    text = page.read_text()
    assert "`host_tools optics verify --rays 150000 --mitsuba --out optics.md`" in text
    assert "/there" not in text
    assert "the centre is 150000 times as bright" in text


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("--rays", 99_999), "rays is 99999"),
        (("--out", "page.txt"), "page.txt"),
        (("--mitsuba-python", "/there/python"), "left out without --mitsuba"),
    ],
)
def test_what_cannot_be_done_is_refused_before_anything_runs(
    words: tuple[object, ...], sentence: str, asked: Asked
) -> None:
    result = run("verify", *words)
    assert isinstance(result.exception, InvalidQuantity)
    assert sentence in str(result.exception)
    assert asked == []


def test_build_writes_the_table_of_the_rays_asked_for(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    calls: list[tuple[Path, int, int, str]] = []

    def fake(folder: Path, rays: int, seed: int, on_step: Callable[[str], None], probe: Probe) -> None:
        for step in build_lookup.STEPS:
            on_step(step)
        calls.append((folder, rays, seed, probe.serial))

    monkeypatch.setattr(build_lookup, "write_light_table", fake)
    result = run("build", "--out", tmp_path, "--rays", 20_000, "--seed", 3)
    assert result.exit_code == 0
    file = tmp_path / "probe.toml"
    file.write_text(probe_text(replace(simulated_probe(), serial="TSIS-0007")))
    assert run("build", "--out", tmp_path, "--rays", 20_000, "--probe", file).exit_code == 0
    assert calls == [(tmp_path, 20_000, 3, "SIM-0001"), (tmp_path, 20_000, 1, "TSIS-0007")]
    assert "20000 rays" in result.stdout


def test_a_seed_of_more_than_32_bits_is_refused(tmp_path: Path) -> None:
    refused = run("build", "--out", tmp_path, "--seed", 2**32)
    assert refused.exit_code == 2
    assert "4294967295" in refused.output


def test_another_probes_light_does_not_go_to_the_simulated_ones_by_itself() -> None:
    refused = run("build", "--probe", SIMULATED_PROBE / NAME)
    assert isinstance(refused.exception, InvalidQuantity)
    assert "out is not given, but must be given with --probe" in str(refused.exception)


@pytest.mark.parametrize("verb", ["build", "verify"])
def test_every_verb_has_help_with_an_example(verb: str) -> None:
    assert f"Example: host_tools optics {verb}" in run(verb, "--help").stdout
