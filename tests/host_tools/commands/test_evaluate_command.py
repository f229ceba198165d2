"""`host_tools evaluate` on recordings of phantoms, each read by the mode that its frames are for."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from toolkit_process import run_toolkit
from typer.testing import CliRunner

from device.files.recording_file import write_recording
from device.files.shipped import SIMULATED_PROBE
from device.measurement.parameters import NOMINAL
from host_tools.__main__ import app
from host_tools.commands.evaluate import _random_presses
from host_tools.press_models.recorded_presses import recorded_press


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
    assert "2 presses" in done.output
    assert "nameless is left out: truth is missing" in done.output
    assert "truth inside 90 % intervals" in done.output


def test_json_holds_the_score_and_every_press(folder):
    named = [str(folder / name) for name in ("standard", "quick", "nameless")]
    found = json.loads(run_toolkit("evaluate", *named, "--json").stdout)
    assert (found["presses"], found["left_out"], found["answered"]) == (2, 1, 2)
    assert [one["name"] for one in found["each"]] == named[:2]
    size = found["unknowns"]["size_mm"]
    errors = [100 * abs(one["estimate"]["size_mm"]["value"] / 12.0 - 1) for one in found["each"]]
    assert size["mean_percent"] == pytest.approx(np.mean(errors))
    assert size["largest_percent"] == pytest.approx(max(errors))
    assert size["bounded"] == 1


def test_json_of_mode_paper_holds_its_phantoms_and_random_scenes():
    found = json.loads(run_toolkit("evaluate", "--scenes", 3, "--json").stdout)
    for table in found["phantoms"].values():
        truth, estimate = np.array(table["truth"]), np.array(table["estimate"])
        assert truth.shape == (9, 3)
        mean = 100 * np.abs(estimate / truth - 1).mean(axis=0)
        assert list(table["percent"]["mean"].values()) == pytest.approx(mean)
    assert found["random_scenes"]["scenes"] == 3


def test_a_truth_that_is_no_number_leaves_only_its_recording_out_and_names_it(folder, tmp_path):
    damaged = tmp_path / "damaged"
    shutil.copytree(folder / "standard", damaged)
    text = (damaged / "recording.json").read_text()
    (damaged / "recording.json").write_text(text.replace('"size_mm": 12.0', '"size_mm": NaN'))
    done = CliRunner().invoke(app, ["evaluate", str(damaged), str(folder / "standard")])
    assert done.exit_code == 0, done.output
    assert f"{damaged} is left out: size_mm is nan" in done.output
    assert "1 presses: " in done.output
    assert "; 1 left out" in done.output


def test_a_mode_that_the_frames_are_not_for_leaves_the_recording_out(folder):
    done = CliRunner().invoke(app, ["evaluate", "--mode", "precise", str(folder / "quick")])
    assert done.exit_code != 0
    assert "is left out" in done.output.replace("\n", " ")


def test_random_presses_of_a_mode_are_scored():
    done = CliRunner().invoke(app, ["evaluate", "--mode", "standard", "--scenes", "3"])
    assert done.exit_code == 0, done.output
    assert done.output.startswith("3 presses: ")
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
