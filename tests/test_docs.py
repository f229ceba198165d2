"""The documents are executed: their scene files are scenes, and the commands they name exist."""

import json
import re
import shlex
import tomllib

import pytest
import typer
from daemon_process import ROOT
from prose import sentences, words
from typer.testing import CliRunner

from device.__main__ import _parser
from device.files.toml_record import from_table
from host_tools.__main__ import app
from host_tools.scenes.scene import Scene

FORWARD_MODEL = (ROOT / "docs" / "forward_model.md").read_text(encoding="utf-8")
MEASUREMENT = (ROOT / "docs" / "measurement.md").read_text(encoding="utf-8")
CONTRACTS = (ROOT / "docs" / "contracts.md").read_text(encoding="utf-8")
PAGES = sorted((ROOT / "docs").glob("*.md"))
WRITTEN = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES]
MOST_WORDS = 40
PLACES = re.compile(r"`((?:device|host_tools|tests|models|docs|scenarios|protocols|systemd|requirements)/[\w./*-]*)`")


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


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.name)
def test_no_sentence_is_longer_than_a_reader_can_hold(page):
    long = {sentence: words(sentence) for sentence in sentences(page.read_text(encoding="utf-8"))}
    assert {sentence: count for sentence, count in long.items() if count > MOST_WORDS} == {}


@pytest.mark.parametrize("page", WRITTEN, ids=lambda page: page.name)
def test_every_file_and_room_that_a_page_names_exists(page):
    """A room is named by its folder with a slash at the end."""
    named = PLACES.findall(page.read_text(encoding="utf-8"))
    missing = [place for place in named if not (list(ROOT.glob(place)) if "*" in place else (ROOT / place).exists())]
    assert missing == []
    assert len(named) > 5 or page.name not in ("architecture.md", "contracts.md")


def test_every_room_stands_in_the_architecture_with_what_it_may_import():
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").split("## Which room knows which")[1]
    for program in ("device", "host_tools"):
        for room in (ROOT / program).glob("*/__init__.py"):
            assert f"`{program}/{room.parent.name}/`" in page, room.parent.name


def test_every_page_stands_in_the_index_and_begins_with_what_it_answers():
    index = (ROOT / "docs" / "README.md").read_text(encoding="utf-8")
    for page in WRITTEN:
        if page in PAGES and page.name != "README.md":
            assert f"]({page.name})" in index, page.name
            assert re.search("This page (answers|says)", page.read_text(encoding="utf-8")[:400]), page.name


def test_what_the_sentences_of_a_page_are():
    text = (
        "# Title\n\nOne two. Three\nfour `a.b c`.\n\n- item one\n- item two\n\n| a | table |\n\n```\ncode here\n```\n"
    )
    assert list(sentences(text)) == ["One two.", "Three four Code.", "item one", "item two"]
    assert words("0.3 % of [it] - all") == 4
