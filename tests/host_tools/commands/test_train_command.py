"""Which options of `host_tools train` go together, and the command that the card keeps."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import pytest
from sweep_rows import synthetic_rows

from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity
from host_tools.commands import sweep as sweep_command
from host_tools.commands import train as command
from host_tools.data import sweep as sweeping
from host_tools.data.plan import SweepPlan


@pytest.mark.parametrize(
    ("mode", "options"),
    [
        ("quick", {"dry_run": True}),
        ("standard", {"trials": 3}),
        ("paper", {"dry_run": True}),
        ("quick", {"trials": 3}),
        ("quick", {"judge_only": True}),
        ("quick", {"wide": Path("build")}),
        ("all", {"out": Path("build")}),
        ("all", {"dry_run": True}),
    ],
)
def test_an_option_of_another_mode_is_refused_before_anything_is_trained(mode, options):
    with pytest.raises(InvalidQuantity, match=f"one of mode {mode}"):
        command.train(mode=mode, **options)


def test_what_only_a_training_reads_is_refused_where_nothing_is_trained(tmp_path):
    with pytest.raises(InvalidQuantity, match="must be left out with --judge-only"):
        command.train(mode="standard", judge_only=True, wide=tmp_path)


@pytest.fixture
def swept(monkeypatch, tmp_path):
    """The sweeps that a training asks for, which are not solved."""
    asked = []
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sweep_command, "sweep", lambda **options: asked.append(options))
    monkeypatch.setattr(command, "_paper", lambda data, *_: asked.append(data))
    return asked


def test_too_few_networks_are_refused_before_a_scene_is_swept(swept, tmp_path):
    with pytest.raises(InvalidQuantity, match="trials is 0"):
        command.train(mode="paper", trials=0, out=tmp_path / "model")
    assert swept == []


@pytest.mark.parametrize(("scenes", "is_the_papers"), [(command.PAPER_SCENES, True), (133, False)])
def test_a_sweep_of_other_scenes_is_not_taken_for_the_papers(swept, monkeypatch, tmp_path, scenes, is_the_papers):
    monkeypatch.setattr(sweeping, "executor", lambda **_: nullcontext(synthetic_rows))
    sweeping.sweep(SweepPlan(scenes, 1), command.SWEPT)
    if not is_the_papers:
        with pytest.raises(InvalidQuantity, match="must be of 134 scenes of seed 1"):
            command.train(mode="paper", out=tmp_path / "model")
    else:
        command.train(mode="paper", out=tmp_path / "model")
    assert swept == ([command.SWEPT] if is_the_papers else [])


def test_a_missing_sweep_is_made(swept, tmp_path):
    command.train(mode="paper", out=tmp_path / "model")
    assert [swept[0]["scenes"], swept[1]] == [command.PAPER_SCENES, command.SWEPT]


def test_an_unknown_mode_is_refused_with_the_known_ones():
    with pytest.raises(InvalidQuantity, match="paper, standard, quick, commissioned, all"):
        command.train(mode="fast")


def test_the_card_keeps_every_option_that_was_given(monkeypatch, tmp_path):
    kept = {}

    def keep(table, wide, out, seed, dry_run, line):
        kept.update(line=line, out=out, wide=wide)

    monkeypatch.setattr(command, "_standard", keep)
    wide = tmp_path / "wide"
    out = tmp_path / "model"
    command.train(mode="standard", out=out, wide=wide, dry_run=True, seed=4)
    assert kept["line"] == f"host_tools train --mode standard --wide {wide} --dry-run --out {out} --seed 4"
    assert (kept["out"], kept["wide"]) == (out, wide)


def test_the_kept_command_quotes_what_a_shell_would_part():
    line = command._command({"--mode": "quick", "--out": Path("my models/x"), "--table": None, "--dry-run": True})
    assert line == "host_tools train --mode quick --out 'my models/x' --dry-run"


@pytest.mark.parametrize("mode", ["paper", "standard", "quick", "commissioned"])
def test_a_folder_of_something_else_is_refused_before_anything_is_trained(mode, tmp_path):
    (tmp_path / "sweep.nc").write_text("mine")
    with pytest.raises(InvalidQuantity, match="a new folder or a model bundle"):
        command.train(mode=mode, out=tmp_path)
    assert (tmp_path / "sweep.nc").read_text() == "mine"


@pytest.mark.parametrize(
    ("mode", "options", "named"),
    [
        ("paper", {"data": Path("other.nc"), "trials": 2}, "--data other.nc and --trials 2"),
        ("paper", {"trials": 2}, "--trials 2"),
        ("paper", {"seed": 2}, "--seed 2"),
        ("standard", {"seed": 2, "judge_only": True}, "--seed 2"),
        ("standard", {"wide": Path("other")}, "--wide other"),
        ("quick", {"table": Path("other")}, "--table other"),
        ("commissioned", {"seed": 2}, "--seed 2"),
    ],
)
def test_another_model_than_the_released_one_needs_a_folder_of_its_own(swept, mode, options, named):
    with pytest.raises(InvalidQuantity) as refusal:
        command.train(mode=mode, **options)
    folder = MODELS / ("standard" if mode == "commissioned" else mode)
    assert str(refusal.value).startswith(f"out is not given, but must be given with {named}: name a folder: {folder},")
    assert swept == []


def test_what_the_chain_takes_makes_the_released_model_again(swept, monkeypatch):
    quick = []
    monkeypatch.setattr(command, "_quick", lambda *given: quick.append(given))
    command.train(mode="paper", trials=command.TRIALS, seed=command.SEED)
    assert swept[1:] == [command.SWEPT]
    command.train(mode="quick", table=SIMULATED_PROBE)
    assert [given[1] for given in quick] == [MODELS / "quick"]


@pytest.mark.parametrize(("mode", "judge_only"), [("standard", False), ("standard", True), ("commissioned", False)])
def test_a_dry_run_does_not_touch_the_models_of_the_release(mode, judge_only):
    with pytest.raises(InvalidQuantity, match="out is not given, but must be given with --dry-run"):
        command.train(mode=mode, dry_run=True, judge_only=judge_only)
