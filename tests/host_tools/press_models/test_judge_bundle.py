"""A bundle judged anew: its card says what its answers are worth now, and all else stays byte by byte."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path
from threading import Lock

import pytest

from device.files.bundle_file import read_ramp_model
from device.files.shipped import MODELS
from host_tools.press_models.judge_bundle import judge_bundle
from host_tools.press_models.ramp_training import DRY_RUN

FEW = replace(DRY_RUN, evaluated=8, evaluated_scans=4, test_recordings=4, test_scans=4)
SAYS_OF_NETWORKS = "sha256", "surrogate_sha256", "golden", "range", "training_command", "training_range", "seed"


@pytest.fixture(scope="module")
def judged(tables, tmp_path_factory) -> Path:
    """Return the shipped bundle after a few presses and recordings have judged it."""
    folder = tmp_path_factory.mktemp("judged") / "standard"
    shutil.copytree(MODELS / "standard", folder)
    lock = Lock()  # as a terminal's printing has: no other process can take it along

    def say(step: str) -> None:
        with lock:
            print(step)

    judge_bundle(folder, tables, budget=FEW, seed=5, jobs=2, say=say)
    return folder


def test_networks_and_surrogate_stay_byte_by_byte_and_the_bundle_holds(judged: Path) -> None:
    assert {path.name for path in judged.iterdir()} == {path.name for path in (MODELS / "standard").iterdir()}
    for name in ("model.onnx", "range.onnx", "surrogate.npz"):
        assert (judged / name).read_bytes() == (MODELS / "standard" / name).read_bytes()
    before, after = (json.loads((folder / "model.json").read_text()) for folder in (MODELS / "standard", judged))
    assert {name: after[name] for name in SAYS_OF_NETWORKS} == {name: before[name] for name in SAYS_OF_NETWORKS}
    read_ramp_model(judged).prove()


@pytest.mark.parametrize(("mode", "presses"), [("standard", 8), ("precise", 4)])
def test_the_card_states_the_new_presses_and_keeps_the_dial(judged: Path, mode: str, presses: int) -> None:
    before, after = (
        json.loads((folder / "model.json").read_text())["modes"][mode] for folder in (MODELS / "standard", judged)
    )
    assert (after["simulated"]["presses"], after["recorded"]["presses"]) == (presses, 4)
    assert sum(after["simulated"]["size_mm"]["cells"]["presses"]) == presses
    assert 0 <= after["recorded"]["joint_region"]["size_and_depth"] <= 1
    assert 0.2 < after["misfit_ratio"] < 3
    assert after["dial"] == before["dial"]
    assert ("half_width_by_ramps" in after) == (mode == "precise")


def test_the_card_says_how_many_presses_judged(judged: Path) -> None:
    effort = json.loads((judged / "model.json").read_text())["effort"]
    assert (effort["judged"], effort["evaluated_scans"], effort["test_recordings"], effort["test_scans"]) == (
        8,
        4,
        4,
        4,
    )
    assert effort["presses"] == 30_000  # of the training, which nothing repeats
