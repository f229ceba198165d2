"""The way from a scene to a model, as docs/from_scene_to_model.py shows it, runs and says what it says it does."""

import os
import re
import subprocess
import sys

import pytest
from daemon_process import ROOT

SCRIPT = ROOT / "docs" / "from_scene_to_model.py"
CELLS = re.split(r"^# %%", SCRIPT.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """What the script prints of a small run: the fewest scenes that can be trained on, and two networks."""
    folder = tmp_path_factory.mktemp("way")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "MPLBACKEND": "Agg", "SCENES": "75", "TRIALS": "2"}
    done = subprocess.run(
        [sys.executable, str(SCRIPT)], cwd=folder, env=environment, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    written = {path.name for path in (folder / "build" / "from_scene_to_model").iterdir()}
    assert written == {"press.png", "sweep.nc", "model", "press"}
    return done.stdout


@pytest.mark.long
def test_the_way_ends_with_size_and_depth_beside_the_truth_and_a_modulus_that_is_not_determined(printed):
    answers = re.findall(r"^(\w+) +([\d.]+) +([\d.]+)   ([\d.]+) to ([\d.]+)(.*)$", printed, re.MULTILINE)
    assert [name for name, *_ in answers] == ["size_mm", "depth_mm", "youngs_modulus_kpa"]
    for name, truth, value, low, high, verdict in answers:
        assert float(low) <= float(value) <= float(high)
        if name == "youngs_modulus_kpa":
            assert verdict == "  (not determined)"
        else:
            assert float(value) == pytest.approx(float(truth), rel=0.2)
            assert float(low) < float(truth) < float(high)


@pytest.mark.long
def test_the_way_shows_that_the_modulus_hardly_moves_the_face(printed):
    correlations = [float(r) for r in re.findall(r"by a correlation of ([-+.\d]+)", printed)]
    assert correlations[0] > 0.6
    assert correlations[1] < -0.2
    assert abs(correlations[2]) < 0.2


def test_the_script_opens_as_a_notebook():
    """Percent format of jupytext: a markdown cell is comments alone, a code cell begins with code."""
    kinds = [cell.splitlines()[0].strip() for cell in CELLS]
    assert set(kinds) == {"", "[markdown]"}
    assert kinds[0] == "[markdown]"
    for kind, cell in zip(kinds, CELLS, strict=True):
        lines = [line for line in cell.splitlines()[1:] if line]
        assert all(line.startswith("#") for line in lines) == (kind == "[markdown]")
