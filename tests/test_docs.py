"""The documents are executed: their scene files are scenes, and the commands they name exist."""

import json
import re
import shlex
import tomllib

import pytest
import typer
from daemon_process import ROOT
from typer.testing import CliRunner

from device.__main__ import _parser
from device.files.toml_record import from_table
from host_tools.__main__ import app
from host_tools.scenes.scene import Scene

FORWARD_MODEL = (ROOT / "docs" / "forward_model.md").read_text(encoding="utf-8")
MEASUREMENT = (ROOT / "docs" / "measurement.md").read_text(encoding="utf-8")
CONTRACTS = (ROOT / "docs" / "contracts.md").read_text(encoding="utf-8")
PAGES = sorted((ROOT / "docs").glob("*.md"))


def test_the_scene_file_of_the_forward_model_is_a_scene():
    text = re.search(r"```toml\n(.*?)```", FORWARD_MODEL, re.DOTALL).group(1)
    scene = from_table(Scene, tomllib.loads(text))
    assert scene.tissue.layers[0].name == "skin"
    assert scene.placement.offset_x_mm == 6.0


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_verb_and_option_that_a_page_names_exists(page):
    group = typer.main.get_command(app)
    for verb, rest in re.findall(r"`?host_tools ([a-z]+)([^`\n]*)", page.read_text(encoding="utf-8")):
        command = group.commands[verb]
        if hasattr(command, "commands"):
            command = command.commands[rest.split()[0]]
        known = {option for parameter in command.params for option in parameter.opts}
        assert set(re.findall(r"--[a-z-]+", rest)) <= known, f"{page.name}: host_tools {verb}{rest}"


def test_the_press_that_the_page_of_the_measurement_quotes_is_that_of_its_command():
    command = re.search(r"`host_tools (simulate [^`]*--json)`", MEASUREMENT).group(1)
    done = CliRunner().invoke(app, shlex.split(command))
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    inclusion_mm3, whole_mm3 = found["total_deformation_mm3"], found["raw"]["total_deformation_mm3"]
    assert f"changes it by {inclusion_mm3:.2f} of {whole_mm3:.1f} mm3" in MEASUREMENT
    assert f"an inclusion field of {found['max_deformation_mm']:.4f} mm in the middle" in MEASUREMENT
    assert f"from {found['w_mm'][0]:.2f} mm there to {found['w_mm'][-1]:.2f} mm at the rim" in MEASUREMENT


def test_the_daemons_commands_to_calibrate_a_new_probe_are_commands():
    section = CONTRACTS.split("### Calibrate a new probe\n")[1].split("\n## ")[0]
    commands = re.findall(r"^python -m device (.*)$", section, re.MULTILINE)
    assert [_parser().parse_args(shlex.split(one)).command for one in commands] == ["record", "calibration"]


def test_every_file_that_the_forward_model_names_exists():
    for path in re.findall(r"`(forward/[a-z_/]+\.py)`", FORWARD_MODEL):
        assert (ROOT / "host_tools" / path).is_file(), path
