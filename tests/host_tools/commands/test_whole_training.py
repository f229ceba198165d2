"""`host_tools train --mode all` is a chain of commands that exist, in an order that works, to everything in models/."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
import typer
from room import ROOT

from device.files.shipped import CERTIFICATES
from device.measurement.quantities import InvalidQuantity
from host_tools.__main__ import app
from host_tools.commands import train as train_command
from host_tools.commands.model import WIDE
from host_tools.commands.train import ALL_OF, ChainedCommand, chained_commands, run_chain

TABLES = ("surface_table", "off_axis_table", "layer_table", "face_motion", "tissue_layers")
BUNDLE = ("model.json", "model.json.sha256", "model.onnx")
WRITTEN_BY_HAND = {"models/simulated_probe/probe.toml", "models/simulated_probe/phantoms.toml"}


def option(command: ChainedCommand, name: str) -> str | None:
    return command.words[command.words.index(name) + 1] if name in command.words else None


def written(command: ChainedCommand) -> set[str]:
    """What a command writes, by what the rooms say that its kind writes."""
    out, verb = option(command, "--out"), command.words[0]
    if verb in ("sweep", "phantom", "calibrate"):
        return {str(out)}
    if verb == "train":
        mode = option(command, "--mode")
        if mode == "commissioned":
            return {f"{out}/range_commissioned.onnx"}
        more = ("range.onnx", "surrogate.npz") if mode == "standard" else ()
        return {f"{out}/{name}" for name in (*BUNDLE, *more)}
    if option(command, "--part") == "wide":
        return {str(WIDE)}
    named = ("light_table",) if verb == "optics" else TABLES
    named = ("press_derivatives",) if option(command, "--part") == "derivatives" else named
    return {f"{out}/{name}.{kind}" for name in named for kind in ("json", "npz")}


def needed(command: ChainedCommand) -> set[str]:
    """What a command reads of what the chain makes."""
    tables = {f"models/simulated_probe/{name}.npz" for name in (*TABLES, "light_table")}
    paper, certificate = {"models/paper/model.onnx"}, f"models/simulated_probe/{CERTIFICATES['physical']}"
    match command.words[0], option(command, "--mode"), option(command, "--part"):
        case "train", "paper", _:
            return {"build/sweep.nc"}
        case "train", "standard", _:
            return {*tables, certificate, str(WIDE)}
        case "train", "quick", _:
            return {*tables, certificate, "models/standard/surrogate.npz"}
        case "train", "commissioned", _:
            return {*tables, "models/simulated_probe/press_derivatives.npz", "models/standard/surrogate.npz", str(WIDE)}
        case "phantom", _, _:
            return tables | paper
        case "calibrate", _, _:
            return {*paper, command.words[1].removesuffix(ALL_OF)}
        case "table", _, "derivatives":
            return tables
    return set()


def test_together_they_write_everything_in_models_that_is_not_written_by_hand():
    listed = subprocess.run(["git", "ls-files", "models"], cwd=ROOT, capture_output=True, text=True, check=True)
    kept = {name for name in listed.stdout.split() if name.count("/") == 2} - WRITTEN_BY_HAND
    made = {name for command in chained_commands() for name in written(command)}
    assert {name for name in made if name.startswith("models/")} == kept


def test_each_reads_only_what_one_before_it_has_written():
    made: set[str] = set()
    for command in chained_commands():
        assert needed(command) <= made, command.words
        made |= written(command)


@pytest.mark.parametrize("command", chained_commands("tcp://host:8786"), ids=lambda command: " ".join(command.words))
def test_each_is_a_command_line_that_the_toolkit_takes(command):
    verb, words = typer.main.get_command(app), list(command.words)
    while hasattr(verb, "commands"):
        verb = verb.commands[words.pop(0)]
    taken = verb.make_context(command.words[0], words).params
    assert taken.get("seed") == {"sweep": 1, "train": 1}.get(command.words[0], taken.get("seed"))
    if "scheduler" in taken:
        assert taken["scheduler"] == "tcp://host:8786"


def test_make_train_is_this_chain():
    told = subprocess.run(
        ["make", "--no-print-directory", "-n", "train"], cwd=ROOT, capture_output=True, text=True, check=True
    ).stdout
    assert told.splitlines()[-1].endswith("host_tools train --mode all")


@pytest.fixture
def ran(monkeypatch):
    """What would have run, each command with the code it ends with."""
    lines, codes = list[list[str]](), dict[str, int]()

    def run(words, cwd, check):
        assert words[:3] == [sys.executable, "-m", "host_tools"]
        lines.append(words[3:])
        return SimpleNamespace(returncode=codes.get(words[3], 0))

    monkeypatch.setattr(train_command, "subprocess", SimpleNamespace(run=run))
    return SimpleNamespace(lines=lines, codes=codes)


def test_recordings_are_named_one_by_one_and_what_is_not_written_over_is_gone_before(ran, tmp_path: Path):
    for name in ("phantom2", "phantom1"):
        (tmp_path / "build/phantoms/physical" / name).mkdir(parents=True)
    certificate = tmp_path / "calibration.json"
    certificate.write_text("{}")
    run_chain([ChainedCommand(("calibrate", "build/phantoms/physical/*"), "calibration.json")], tmp_path)
    assert ran.lines == [["calibrate", *(f"build/phantoms/physical/phantom{number}" for number in (1, 2))]]
    assert not certificate.exists()
    run_chain([ChainedCommand(("phantom",), "build/phantoms/physical")], tmp_path)
    assert not (tmp_path / "build/phantoms/physical").exists()


@pytest.mark.parametrize(("ended", "code"), [(2, 2), (-9, 1)])
def test_a_command_that_fails_is_the_last_and_its_code_the_whole_ones(ran, tmp_path: Path, capsys, ended, code):
    ran.codes["optics"] = ended
    with pytest.raises(typer.Exit) as left:
        run_chain(chained_commands(), tmp_path)
    assert left.value.exit_code == code
    assert [line[0] for line in ran.lines] == ["sweep", "table", "optics"]
    assert f"ended with {ended}" in capsys.readouterr().err


def test_mode_all_runs_the_chain_in_the_source_tree(monkeypatch):
    started = []
    monkeypatch.setattr(train_command, "run_chain", lambda chain, tree: started.append((list(chain), tree)))
    train_command.train(mode="all")
    assert started == [(chained_commands(), ROOT)]
    with pytest.raises(InvalidQuantity, match="seed is 3, but must be 1 with --mode all: train each mode with --seed"):
        train_command.train(mode="all", seed=3)
    assert len(started) == 1
