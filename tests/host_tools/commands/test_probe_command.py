"""`host_tools probe`: a file to fill in, everything that is wrong with one at once, and what follows from it."""

import json
import re

import pytest
from toolkit_process import run_toolkit

from device.files.shipped import SIMULATED_PROBE
from device.simulation.scenario import read_scenario
from host_tools.scenes.probe_file import NAME, simulated_probe

OWN = SIMULATED_PROBE / NAME


@pytest.fixture
def wrong(tmp_path):
    """A file with a tolerance of zero, and LEDs outside the block."""
    path = tmp_path / "wrong.toml"
    text = OWN.read_text().replace("radius_mm_tolerance = 0.05", "radius_mm_tolerance = 0.0")
    path.write_text(text.replace("distance_mm = 12.0", "distance_mm = 15.0"))
    return path


def test_the_probe_that_comes_with_the_toolkit_is_checked_and_shown():
    checked, shown = run_toolkit("probe", "check", OWN), run_toolkit("probe", "show", OWN)
    assert (checked.returncode, shown.returncode) == (0, 0)
    assert "probe SIM-0001 can be built: 3 layers, 10 mm together" in checked.stdout
    rows = [line.split() for line in shown.stdout.splitlines()]
    assert ["layers[0].youngs_modulus_kpa", "60", "6", "kPa"] in rows
    assert ["cell.counts_per_n", "100000", "1000", "counts/N"] in rows
    assert ["thickness_of_the_layers", "10", "mm"] in rows
    assert ["frame_height", "17.938", "mm"] in rows


def test_both_print_json():
    checked = json.loads(run_toolkit("probe", "check", OWN, "--json").stdout)
    shown = json.loads(run_toolkit("probe", "show", OWN, "--json").stdout)
    own = {"serial": "SIM-0001", "sha256": simulated_probe().sha256}
    assert checked == {"accepted": True, "problems": [], **own, "advice": []}
    assert shown["probe"]["leds"]["height_mm"] == 5.0
    assert shown["follows"]["central_window_radius"] == {"value": pytest.approx(9.9), "unit": "mm"}
    assert shown["follows"]["frame_height_over_face"]["unit"] == ""


@pytest.mark.parametrize("verb", ["check", "show"])
def test_everything_wrong_is_named_with_exit_code_1(verb, wrong):
    told = run_toolkit("probe", verb, wrong)
    assert (told.returncode, told.stdout) == (1, "")
    assert len(told.stderr.splitlines()) == 2
    assert "face.radius_mm_tolerance is 0.0, but must be above 0: state one standard deviation" in told.stderr
    assert "leds.distance_mm is 15.0" in told.stderr
    as_json = run_toolkit("probe", verb, wrong, "--json")
    record = json.loads(as_json.stdout)
    assert (as_json.returncode, record["accepted"]) == (1, False)
    assert [one["quantity"] for one in record["problems"]] == ["face.radius_mm_tolerance", "leds.distance_mm"]


def test_a_probe_that_can_be_built_and_not_commissioned_is_told_so_before_it_is_cast(tmp_path):
    """A modulus of its inner layer where the outer one stands, as of layers the wrong way round."""
    path = tmp_path / "probe.toml"
    path.write_text(OWN.read_text().replace("youngs_modulus_kpa = 60.0", "youngs_modulus_kpa = 20.0"))
    checked = run_toolkit("probe", "check", path)
    assert (checked.returncode, "can be built" in checked.stdout) == (0, True)
    heading, *told = checked.stderr.splitlines()
    assert heading == "host_tools commission refuses it; look first whether its units are right:"
    assert told[0].startswith("layers[0].youngs_modulus_kpa is 20.0, but must be at least 48 and at most 75 kPa")
    record = json.loads(run_toolkit("probe", "check", path, "--json").stdout)
    assert (record["accepted"], record["problems"], record["advice"]) == (True, [], told)


def test_the_page_shows_what_is_said_of_a_wrong_file(wrong):
    page = (SIMULATED_PROBE.parents[1] / "docs" / "own_probe.md").read_text(encoding="utf-8")
    [shown] = re.findall(r"```text\n(.*?)```", page, re.DOTALL)
    assert run_toolkit("probe", "check", wrong).stderr == shown


def test_a_new_file_is_written_once_and_asks_for_what_is_missing(tmp_path):
    assert run_toolkit("probe", "new", "probe.toml", "--serial", "TSIS-0007", cwd=tmp_path).returncode == 0
    told = run_toolkit("probe", "check", "probe.toml", "--json", cwd=tmp_path)
    problems = json.loads(told.stdout)["problems"]
    assert all(one["quantity"].endswith("_tolerance") and one["value"] == "missing" for one in problems)
    again = run_toolkit("probe", "new", "probe.toml", cwd=tmp_path)
    assert again.returncode == 1
    assert "must be a new file" in again.stderr


@pytest.mark.parametrize("verb", ["new", "check", "show", "phantoms"])
def test_every_verb_has_help_with_an_example_of_probes(verb):
    assert f"Example: host_tools probe {verb}" in run_toolkit("probe", verb, "--help").stdout


CAST = """
[[phantoms]]
name = "{name}"
surface = "dusted"
tissue_modulus_kpa = 5.0
tissue_modulus_kpa_tolerance = 0.1
tissue_modulus_kpa_measured_by = "indentation of a cast cylinder"
tissue_thickness_mm = 30.0
tissue_thickness_mm_tolerance = 0.2
tissue_thickness_mm_measured_by = "calliper"
"""
LESION = """size_mm = 10.0
size_mm_tolerance = 0.1
size_mm_measured_by = "calliper"
depth_mm = {depth_mm}
depth_mm_tolerance = 0.2
depth_mm_measured_by = "mould"
youngs_modulus_kpa = 80.0
youngs_modulus_kpa_tolerance = 4.0
youngs_modulus_kpa_measured_by = "indentation of a cast cylinder"
"""


def phantoms_text(blocks=3):
    lesions = [CAST.format(name=f"A{i}") + LESION.format(depth_mm=4.0 + i) for i in range(6)]
    return 'serial = "PH-7"\n' + "".join([*lesions, *(CAST.format(name=f"B{i}") for i in range(blocks))])


def test_a_set_of_phantoms_is_shown_with_tolerances_and_what_would_tell_more(tmp_path):
    path = tmp_path / "phantoms.toml"
    path.write_text(phantoms_text())
    done = run_toolkit("probe", "phantoms", path)
    assert done.returncode == 0, done.stderr
    rows = [" ".join(line.split()) for line in done.stdout.splitlines()]
    assert "A1 10 +- 0.1 5 +- 0.2 80 +- 4 5 +- 0.1 30 +- 0.2 dusted" in rows
    assert "B0 - - - 5 +- 0.1 30 +- 0.2 dusted" in rows
    assert "set PH-7: 6 with an inclusion, 3 bare blocks." in done.stdout
    assert len(done.stderr.splitlines()) == 2
    record = json.loads(run_toolkit("probe", "phantoms", path, "--json").stdout)
    assert (len(record["set"]["phantoms"]), len(record["advice"])) == (9, 2)


def test_what_is_wrong_with_phantoms_is_named_with_exit_code_1(tmp_path):
    path = tmp_path / "phantoms.toml"
    path.write_text(
        phantoms_text(blocks=2).replace('name = "A2"', 'name = "A1"').replace("depth_mm = 4.0", "depth_mm = 25.0")
    )
    told = run_toolkit("probe", "phantoms", path)
    assert (told.returncode, told.stdout) == (1, "")
    assert [line.split(" is ")[0] for line in told.stderr.splitlines()] == [
        "phantoms[2].name",
        "phantoms[0].depth_mm + size_mm",
        "bare blocks",
    ]


def test_nothing_is_written_of_phantoms_that_contradict_themselves(tmp_path):
    path = tmp_path / "phantoms.toml"
    path.write_text(phantoms_text().replace('name = "A2"', 'name = "A1"'))
    told = run_toolkit("calibrate", "missing", "--phantoms", path, "--out", tmp_path / "c.json")
    assert told.returncode == 1
    assert "phantoms[2].name" in told.stderr
    assert list(tmp_path.iterdir()) == [path]


def test_a_probes_file_becomes_a_scene_that_the_simulator_reads(tmp_path):
    text = OWN.read_text().replace("youngs_modulus_kpa = 60.0", "youngs_modulus_kpa = 66.0")
    (tmp_path / "own.toml").write_text(text)
    out = tmp_path / "scene.toml"
    told = run_toolkit("probe", "scene", tmp_path / "own.toml", "--out", out)
    assert told.returncode == 0, told.stderr
    assert read_scenario(out).world.layers.face_modulus_ratio == pytest.approx(1.1)
    assert run_toolkit("probe", "scene", OWN, "--out", out, "--number", 4).returncode == 0
    assert out.read_text().startswith("# Probe SIM-0001, number 4 within its tolerances.\n")
    drawn = read_scenario(out)
    told = run_toolkit("probe", "scene", OWN, "--out", out, "--number", 0)
    assert (told.returncode, read_scenario(out)) == (1, drawn)
    (tmp_path / "own.toml").write_text(text.replace("radius_mm = 11.0", "radius_mm = 10.5"))
    told = run_toolkit("probe", "scene", tmp_path / "own.toml", "--out", out)
    assert (told.returncode, read_scenario(out)) == (1, drawn)
    assert "radius_mm is 10.5, but must be 11.0, as the simulator's tables have it" in told.stderr


def test_a_scene_is_never_written_over_what_is_none(tmp_path):
    own = tmp_path / "probe.toml"
    own.write_text(OWN.read_text())
    refused = run_toolkit("probe", "scene", own, "--out", own)
    assert (refused.returncode, "must be a new file, or a scene of a probe" in refused.stderr) == (1, True)
    assert own.read_text() == OWN.read_text()
    for _ in range(2):
        assert run_toolkit("probe", "scene", own, "--out", tmp_path / "scene.toml").returncode == 0
