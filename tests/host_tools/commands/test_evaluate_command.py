"""`host_tools evaluate` on recordings of phantoms, each read by the mode that its frames are for."""

import shutil
from dataclasses import replace

import numpy as np
import pytest
from typer.testing import CliRunner

from device.files.recording_file import write_recording
from device.measurement.parameters import NOMINAL
from host_tools.__main__ import app
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
