"""The walk of docs/own_probe.md, from nine castings to mode standard: the toolkit's and the device's own commands.

The probe is one of the twenty worlds: what it is, and how its camera looks at the face, is hidden from the file.
"""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import tomli_w
from daemon_process import ROOT
from toolkit_process import run_toolkit

from device.__main__ import main
from device.assembly.answers import active_calibration, answers_for
from device.errors import ForeignCalibration
from device.files.bundle_file import read_paper_model, read_ramp_model
from device.files.certificate_file import read_calibration
from device.files.recording_file import read_recording
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.files.toml_record import as_table
from device.measurement.quantities import InvalidQuantity
from device.measurement.ramp_modes.estimate import estimate_ramp
from device.measurement.recording.recording import GEOMETRY
from device.settings.layers import read_config
from host_tools.commissioning import commission as commission_module
from host_tools.commissioning import own_quick as own_quick_module
from host_tools.press_models.quick_training import QuickBudget
from host_tools.scenes.phantom_set import StatedPhantom, read_phantoms
from host_tools.scenes.probe_file import read_probe

SERIAL, WORLD = "TSIS-0007", ROOT / "scenarios/worlds/world_02.toml"
CAST = ("phantom1", "phantom2", "phantom4", "phantom5", "phantom7", "phantom8", "block1", "block2", "block3")
TISSUES_KPA = 4.6, 5.4
PRESSES = 2
SHORT_BUDGET = QuickBudget(recordings=24, trained_on=2_000, members=2, steps=600, belts_of=1_600, evaluated=1_600)
"""Of mode quick, whose intervals are then wider than a commissioned probe's and as honest."""
NOT_CAST = {"size_mm": 11.0, "depth_mm": 5.5, "youngs_modulus_kpa": 90.0}


def cast(phantoms: list[StatedPhantom], path) -> None:
    """Write the file of a set: the simulated probe's phantoms in two tissues."""
    of_two = [replace(one, tissue_modulus_kpa=TISSUES_KPA[place % 2]) for place, one in enumerate(phantoms)]
    tables = [as_table(one, without_none=True) for one in of_two]
    path.write_text(tomli_w.dumps({"serial": "PH-7", "phantoms": tables}))


def toolkit(*arguments: object) -> str:
    done = run_toolkit(*arguments)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    """A folder with `built.toml`, what the simulator builds on, and `probe.toml`, in which the grid's camera stands."""
    folder = tmp_path_factory.mktemp("bench")
    own = (SIMULATED_PROBE / "probe.toml").read_text().replace("SIM-0001", SERIAL)
    for name in ("built.toml", "probe.toml"):
        (folder / name).write_text(own)
    shipped = {one.name: one for one in read_phantoms(SIMULATED_PROBE / "phantoms.toml").phantoms}
    cast([shipped[name] for name in CAST], folder / "phantoms.toml")
    fresh = [replace(shipped[name], name=f"press{place}", **NOT_CAST) for place, name in enumerate(CAST[:6])]
    cast(fresh, folder / "not_cast.toml")
    pressed = ("--probe", folder / "built.toml", "--scenario", WORLD)
    toolkit("phantom", "--grid", 4, *pressed, "--out", folder / "grid")
    toolkit("probe", "camera", *sorted((folder / "grid").iterdir()), "--probe", folder / "probe.toml", "--write")
    castings = ("--phantoms", folder / "phantoms.toml", "--ramp")
    toolkit("phantom", *castings, *pressed, "--out", folder / "ramps")
    others = ("--phantoms", folder / "not_cast.toml", "--ramp", "--seed", 900, "--camera-of", folder / "probe.toml")
    toolkit("phantom", *others, *pressed, "--out", folder / "presses")
    held = [one for one in others if one != "--ramp"]
    toolkit("phantom", *held, *pressed, "--out", folder / "holds")
    return folder


def settings(bench, **said: object) -> Path:
    """Write settings of the probe, with the camera that the grid told; return their path."""
    geometry = read_probe(bench / "probe.toml").geometry
    camera = asdict(geometry.scale) | {name: getattr(geometry, name) for name in GEOMETRY}
    paths = {name: str(path) for name, path in said.items()}
    path = bench / "settings.toml"
    path.write_text(tomli_w.dumps({"serial": SERIAL, "data": str(bench / "var"), **paths, "camera": camera}))
    return path


def analysed(capsys, *arguments: object) -> tuple[int, str, str]:
    code = main([str(one) for one in arguments])
    captured = capsys.readouterr()
    return code, captured.out, captured.err


@pytest.fixture(scope="module")
def own(bench):
    """The words of the command and the bundle's folder; card and mode quick are made of fewer presses than usual."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(commission_module, "PRESSES", 12)
        patched.setattr(commission_module, "SCANS", 4)
        patched.setattr(own_quick_module, "OWN_BUDGET", SHORT_BUDGET)
        ramps, out = sorted((bench / "ramps").iterdir()), bench / SERIAL
        files = ("--probe", bench / "probe.toml", "--phantoms", bench / "phantoms.toml")
        return toolkit("commission", *ramps, *files, "--out", out), out


@pytest.mark.long
def test_a_probe_that_somebody_built_is_commissioned_and_answers_presses_that_no_casting_was_of(bench, own, capsys):
    told, folder = own
    assert str(folder / "calibration.json") in told
    of_probe = settings(bench, standard_model=folder, calibration=folder / "calibration.json")
    presses = sorted((bench / "presses").iterdir())[:PRESSES]
    code, out, err = analysed(capsys, "--config", of_probe, "analyse", *presses)
    assert code == 0, err
    estimates = [json.loads(line) for line in out.splitlines()]
    assert len(estimates) == len(presses)
    for estimate in estimates:
        assert estimate["status"] in ("ok", "partly_identifiable"), estimate["reason"]
        assert (estimate["mode"], estimate["model"]) == ("standard", SERIAL)
        for name in ("size_mm", "depth_mm"):
            assert estimate[name]["low"] <= NOT_CAST[name] <= estimate[name]["high"]


@pytest.mark.long
def test_presses_are_scored_by_the_probes_own_bundle_and_certificate(bench, own):
    _, folder = own
    presses = sorted((bench / "presses").iterdir())[:PRESSES]
    told = toolkit("evaluate", *presses, "--phantoms", bench / "not_cast.toml", "--standard-model", folder, "--json")
    found = json.loads(told)
    assert (found["answered"], found["left_out"]) == (PRESSES, 0)
    for one in found["each"]:
        assert one["truth"] == NOT_CAST
        assert one["estimate"]["calibration_id"] == read_calibration(folder / "calibration.json").id


@pytest.mark.long
def test_a_press_that_is_held_is_answered_by_mode_quick_of_the_probe(bench, own, capsys):
    told, folder = own
    quick = folder.with_name(f"{SERIAL}-quick")
    assert "set quick_model to it" in told
    of_probe = settings(bench, standard_model=folder, quick_model=quick, calibration=folder / "calibration.json")
    holds = sorted((bench / "holds").iterdir())[:PRESSES]
    code, out, err = analysed(capsys, "--config", of_probe, "analyse", "--mode", "quick", *holds)
    assert code == 0, err
    for estimate in map(json.loads, out.splitlines()):
        assert estimate["status"] == "partly_identifiable", estimate["reason"]
        assert (estimate["mode"], estimate["model"]) == ("quick", quick.name)
        assert estimate["size_mm"]["low"] <= NOT_CAST["size_mm"] <= estimate["size_mm"]["high"]


@pytest.mark.long
def test_the_daemon_takes_up_bundle_and_certificate_and_offers_what_they_are_for(bench, own):
    _, folder = own
    quick = folder.with_name(f"{SERIAL}-quick")
    paths = {"standard_model": folder, "quick_model": quick, "calibration": folder / "calibration.json"}
    config = read_config(settings(bench, **paths))
    paper = read_paper_model(config.paper_model)
    calibration = active_calibration(config, paper)
    answers = answers_for(config, paper, calibration)
    assert answers.modes == ("quick", "standard", "precise")
    assert answers.expires_at == calibration.validity.expires_at
    cards = [json.loads((one / "model.json").read_text()) for one in (folder, quick)]
    assert {card["expires_at"] for card in cards} == {answers.expires_at}
    assert len({card["surrogate_sha256"] for card in cards}) == 1
    moved = replace(config, camera=replace(config.camera, axis_x_mm=0.0))
    with pytest.raises(ForeignCalibration, match=r"camera\.axis_x_mm is 0, but must be -0\.2"):
        active_calibration(moved, paper)


@pytest.mark.long
def test_the_same_press_is_refused_without_commissioning_and_the_sentence_says_to_do_it(bench, own, capsys):
    press, (_, folder) = bench / "presses/press0", own
    code, out, err = analysed(capsys, "--root", bench, "analyse", press)
    assert (code, out) == (1, "")
    assert f"serial of the recording is {SERIAL}" in err
    assert "--config FILE" in err
    certified = settings(bench, calibration=folder / "calibration.json")
    code, out, err = analysed(capsys, "--config", certified, "analyse", press)
    assert (code, out) == (1, "")
    assert "commission the probe" in err
    recording, certificate = read_recording(press), read_calibration(folder / "calibration.json")
    with pytest.raises(InvalidQuantity, match=f"serial is {SERIAL}.*commission this probe with `host_tools comm"):
        estimate_ramp(recording, "standard", read_ramp_model(MODELS / "standard"), certificate)
