"""`host_tools evaluate` on recordings of phantoms, each read by the mode that its frames are for."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
import tomli_w
from model_card import edit_card
from toolkit_process import run_toolkit
from typer.testing import CliRunner

from device.files.certificate_file import read_calibration
from device.files.recording_file import write_recording
from device.files.shipped import MODELS, SIMULATED_PROBE
from device.measurement.bundle import BundleRefused
from device.measurement.calibration import certificate_id
from device.measurement.parameters import NOMINAL
from device.measurement.quantities import Inclusion, InvalidQuantity
from host_tools.__main__ import app
from host_tools.commands import evaluate as evaluate_module
from host_tools.commands.evaluate import _random_presses
from host_tools.press_models.recorded_presses import recorded_press
from host_tools.scenes.phantom_set import read_phantoms


@pytest.fixture(scope="module")
def folder(tables, tmp_path_factory):
    """A ramp, a hold, and a ramp that carries no truth."""
    folder = tmp_path_factory.mktemp("recordings")
    parameters = np.array([12.0, 6.0, 60.0, *NOMINAL.values()])
    for mode in ("standard", "quick"):
        write_recording(recorded_press(tables, parameters, mode, 4), folder / mode)
    write_recording(replace(recorded_press(tables, parameters, "standard", 5), truth=None), folder / "nameless")
    return folder


def test_recordings_are_scored_and_one_without_truth_is_named(folder):
    done = CliRunner().invoke(app, ["evaluate", *(str(folder / name) for name in ("standard", "quick", "nameless"))])
    assert done.exit_code == 0, done.output
    assert "1 presses of mode standard, simulated: " in done.output
    assert "1 presses of mode quick, simulated: " in done.output
    assert "nameless is left out: truth is missing" in done.output
    assert "truth inside 90 % intervals" in done.output


def test_json_holds_the_score_and_every_press(folder):
    named = [str(folder / name) for name in ("standard", "quick", "nameless")]
    found = json.loads(run_toolkit("evaluate", *named, "--json").stdout)
    assert (found["presses"], found["left_out"], found["answered"]) == (2, 1, 2)
    assert [one["name"] for one in found["each"]] == named[:2]
    assert found["asked"] == {
        "mode": None,
        "light": "physical",
        "scenes": None,
        "seed": None,
        "models": {name: str(MODELS / name) for name in ("paper", "quick", "standard")},
        "certificate": str(SIMULATED_PROBE / "calibration.json"),
    }
    assert found["unknowns"] is None
    assert [(one["mode"], one["simulated"]) for one in found["groups"]] == [("standard", True), ("quick", True)]
    errors = [100 * abs(one["estimate"]["size_mm"]["value"] / 12.0 - 1) for one in found["each"]]
    sizes = [one["unknowns"]["size_mm"] for one in found["groups"]]
    assert [one["mean_percent"] for one in sizes] == pytest.approx(errors)
    assert [one["bounded"] for one in sizes] == [1, 0]


def test_json_of_mode_paper_holds_its_phantoms_and_random_scenes():
    found = json.loads(run_toolkit("evaluate", "--scenes", 3, "--json").stdout)
    for table in found["phantoms"].values():
        truth, estimate = np.array(table["truth"]), np.array(table["estimate"])
        assert truth.shape == (9, 3)
        mean = 100 * np.abs(estimate / truth - 1).mean(axis=0)
        assert list(table["percent"]["mean"].values()) == pytest.approx(mean)
    assert found["random_scenes"]["scenes"] == 3
    assert (found["asked"]["mode"], found["asked"]["scenes"], found["asked"]["seed"]) == ("paper", 3, 1000)


def test_a_truth_that_is_no_number_leaves_only_its_recording_out_and_names_it(folder, tmp_path):
    damaged = tmp_path / "damaged"
    shutil.copytree(folder / "standard", damaged)
    text = (damaged / "recording.json").read_text()
    (damaged / "recording.json").write_text(text.replace('"size_mm": 12.0', '"size_mm": NaN'))
    done = CliRunner().invoke(app, ["evaluate", str(damaged), str(folder / "standard")])
    assert done.exit_code == 0, done.output
    assert f"{damaged} is left out: size_mm is nan" in done.output
    assert "1 presses of mode standard, simulated: " in done.output
    assert "\n1 left out" in done.output


def test_a_mode_that_the_frames_are_not_for_leaves_the_recording_out(folder):
    done = CliRunner().invoke(app, ["evaluate", "--mode", "precise", str(folder / "quick")])
    assert done.exit_code != 0
    assert "is left out" in done.output.replace("\n", " ")


def test_random_presses_of_a_mode_are_scored():
    done = CliRunner().invoke(app, ["evaluate", "--mode", "standard", "--scenes", "3"])
    assert done.exit_code == 0, done.output
    assert done.output.startswith("3 presses of mode standard, simulated: ")
    assert "RMS error / bound " in done.output


def test_modes_quick_and_paper_have_no_bound(folder):
    done = CliRunner().invoke(app, ["evaluate", str(folder / "quick")])
    assert done.exit_code == 0, done.output
    assert "skill against the range" in done.output
    assert "bound" not in done.output


def test_random_presses_of_mode_precise_are_scans_of_two_to_five_ramps():
    scans = list(_random_presses("precise", SIMULATED_PROBE, 4, seed=1))
    assert [1 + len(one.read.keywords["further_mm"]) for one in scans] == [2, 3, 4, 5]
    assert len(scans[0].read().ramps()) == 2
    ramps = list(_random_presses("standard", SIMULATED_PROBE, 4, seed=1))
    assert [one.read.args[1].tolist() for one in ramps] == [one.read.args[1].tolist() for one in scans]
    assert not any(len(one.read.keywords["further_mm"]) for one in ramps)


TRUTH = {"size_mm": 12.0, "depth_mm": 6.0, "youngs_modulus_kpa": 60.0}
A1 = {"size_mm": 12.4, "depth_mm": 6.2, "youngs_modulus_kpa": 63.0}
"""What the file says of a phantom whose recordings say `TRUTH`: within three tolerances."""


def phantoms_file(path, tissue_kpa=6.0):
    """Write a set of six phantoms of which A1 is the one that was pressed, and of a bare block."""
    tolerances = {"size_mm": 0.2, "depth_mm": 0.1, "youngs_modulus_kpa": 2.0}
    tissue = {"tissue_modulus_kpa": tissue_kpa, "tissue_thickness_mm": 31.0}
    listed = []
    for name in ("A1", "A2", "A3", "A4", "A5", "A6", "B0"):
        own = {"A1": A1, "B0": {}}.get(name, {"size_mm": 5.0, "depth_mm": 5.0, "youngs_modulus_kpa": 90.0})
        stated = tissue | own
        listed.append(
            {"name": name, "surface": "dusted", **stated}
            | {f"{one}_tolerance": tolerances.get(one, 0.1) for one in stated}
            | {f"{one}_measured_by": "calliper" for one in stated}
        )
    path.write_text(tomli_w.dumps({"serial": "PH-7", "phantoms": listed}))
    return path


@pytest.fixture(scope="module")
def castings(tables, tmp_path_factory):
    """The same ramp under several names: without truth, and of another set."""
    folder = tmp_path_factory.mktemp("castings")
    ramp = recorded_press(tables, np.array([*TRUTH.values(), *NOMINAL.values()]), "standard", 4)
    nameless = replace(ramp, truth=None)
    for name in ("A1", "C9", "B0"):
        write_recording(nameless, folder / name)
    write_recording(nameless, folder / "zipped" / "A1.zip")
    write_recording(replace(nameless, phantom_serial="PH-8"), folder / "set" / "A1")
    write_recording(replace(ramp, truth=Inclusion(**TRUTH)), folder / "other" / "A2")
    return folder


def commissioned(folder, **changes):
    """Return a bundle of the design in whose folder another certificate stands, and that certificate."""
    shutil.copytree(MODELS / "standard", folder)
    changed = replace(read_calibration(SIMULATED_PROBE / "calibration.json"), **changes)
    certificate = replace(changed, id=certificate_id(changed))
    (folder / "calibration.json").write_text(certificate.to_json())
    return folder, certificate


def scored(*arguments):
    return json.loads(run_toolkit("evaluate", *arguments, "--json").stdout)


def test_the_certificate_in_the_bundles_folder_is_read_unless_another_is_named(folder, tmp_path):
    bundle, own = commissioned(tmp_path / "own", operator="N. N.")
    simulated = SIMULATED_PROBE / "calibration.json"
    press = folder / "standard"
    by_default, in_folder, named = (
        scored(press, *more)["each"][0]["estimate"]["calibration_id"]
        for more in ((), ("--standard-model", bundle), ("--standard-model", bundle, "--calibration", simulated))
    )
    assert in_folder == own.id
    assert by_default == named == read_calibration(simulated).id != own.id


def test_the_certificate_of_another_probe_leaves_a_recording_out(folder, tmp_path):
    bundle, _ = commissioned(tmp_path / "own", serial="TSIS-0007")
    done = CliRunner().invoke(app, ["evaluate", str(folder / "standard"), "--standard-model", str(bundle)])
    assert done.exit_code != 0
    assert "is left out: calibration is for probe TSIS-0007" in done.output


def test_a_recording_has_the_truth_of_the_phantom_that_it_is_named_as(castings, tmp_path):
    phantoms = phantoms_file(tmp_path / "phantoms.toml")
    for named in (castings / "A1", castings / "zipped" / "A1.zip"):
        found = scored(named, "--phantoms", phantoms)
        assert [one["truth"] for one in found["each"]] == [A1]
        assert found["unknowns"]["size_mm"]["bounded"] == 1


def test_a_recording_that_is_given_again_is_scored_once(castings, tmp_path):
    phantoms = phantoms_file(tmp_path / "phantoms.toml")
    named = [str(castings / "A1"), str(castings / "zipped" / "A1.zip")]
    done = CliRunner().invoke(app, ["evaluate", *named, "--phantoms", str(phantoms)])
    assert "1 presses" in done.output
    assert f"{named[1]} is left out: it is the recording {named[0]} again" in " ".join(done.output.split())


@pytest.mark.parametrize(("serial", "is_told"), [("PH-7", True), ("PH-8", False)])
def test_castings_that_the_probe_was_commissioned_on_are_told(tmp_path, capsys, serial, is_told):
    card = {"commissioned": {"phantoms": serial, "phantoms_left_out": [{"name": "A1"}, {"name": "A4"}]}}
    (tmp_path / "model.json").write_text(json.dumps(card))
    paths = [tmp_path / name for name in ("A1.zip", "A2", "again/A1")]
    evaluate_module._note_castings(paths, phantoms_file(tmp_path / "phantoms.toml"), tmp_path)
    told = " ".join(capsys.readouterr().err.split())
    assert ("2 of 3 recordings are of phantoms that this probe was commissioned on (A1)" in told) is is_told


def test_the_bound_is_taken_in_the_tissue_of_the_phantoms_file(castings, tmp_path):
    softer, stiffer = (
        evaluate_module._on_phantom(castings / "A1", read_phantoms(phantoms_file(tmp_path / f"{kpa}.toml", kpa)))
        for kpa in (4.0, 12.0)
    )
    assert stiffer.nuisances == {**NOMINAL, "tissue_modulus_kpa": 12.0, "slab_thickness_mm": 31.0}
    assert softer.nuisances["tissue_modulus_kpa"] == 4.0


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("C9", "phantom of C9 is none, but must be one of A1, A2, A3, A4, A5, A6"),
        ("B0", "phantom of B0 is a bare block"),
        ("set/A1", "phantom_serial of A1 is PH-8"),
        ("other/A2", "truth of A2 is 12 mm, 6 mm deep, 60 kPa, but must be 5 mm, 5 mm deep, 90 kPa"),
    ],
)
def test_what_contradicts_the_phantoms_is_left_out_by_name(castings, tmp_path, name, why):
    phantoms = phantoms_file(tmp_path / "phantoms.toml")
    done = CliRunner().invoke(app, ["evaluate", str(castings / name), "--phantoms", str(phantoms)])
    assert done.exit_code != 0
    assert f"{castings / name} is left out: {why}" in done.output


@pytest.mark.parametrize(
    ("arguments", "quantity"),
    [
        (("--phantoms", "phantoms.toml"), "phantoms"),
        (("--calibration", "own.json", "--light", "linear"), "light"),
        (("--calibration", "own.json", "--noise-free"), "calibration"),
        (("--light", "linear", "--posterior"), "light"),
        (("--light", "linear", "--mode", "standard"), "light"),
    ],
)
def test_options_that_contradict_each_other_are_refused(arguments, quantity):
    done = CliRunner().invoke(app, ["evaluate", *arguments])
    assert isinstance(done.exception, InvalidQuantity)
    assert done.exception.quantity == quantity


@pytest.mark.parametrize("name", ["quick", "standard"])
def test_a_bundle_that_is_named_and_not_there_is_refused_before_a_recording_is_read(folder, tmp_path, name):
    typo = tmp_path / "typo"
    done = CliRunner().invoke(app, ["evaluate", str(folder / "quick"), f"--{name}-model", str(typo)])
    assert str(done.exception).startswith(f"{name}_model is {typo}, but must be a folder with a model bundle")
    assert done.output == ""


def test_bundles_of_two_commissionings_are_refused_together_unless_one_mode_is_asked_for(folder, tmp_path):
    other = tmp_path / "other-quick"
    shutil.copytree(MODELS / "quick", other)
    edit_card(other, lambda card: card.update(surrogate_sha256="0" * 64))
    asked = ["evaluate", str(folder / "quick"), "--quick-model", str(other)]
    refused = CliRunner().invoke(app, asked)
    assert isinstance(refused.exception, BundleRefused)
    assert "other-quick: surrogate_sha256 is 0" in str(refused.exception)
    assert CliRunner().invoke(app, [*asked, "--mode", "quick"]).exit_code == 0
    edit_card(other, lambda card: card.update(serials=["TSIS-0007"]))
    answered = CliRunner().invoke(app, [*asked, str(folder / "standard")])
    assert answered.exit_code == 0, "no probe has both"
