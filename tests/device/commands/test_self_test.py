"""`python -m device self-test` of the virtual probe, as typed: every check is a line, one failure is exit code 1."""

import json

import pytest
from simulated_time_probe import simulate_time

from device.__main__ import main


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run a command line in an empty folder, with a scene, in simulated time; return exit code, stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    simulate_time(monkeypatch)

    def run_line(*arguments, scene=""):
        (tmp_path / "scene.toml").write_text(scene)
        code = main([*arguments, "--simulate", "--scene", "scene.toml"])
        captured = capsys.readouterr()
        return code, captured.out.splitlines(), captured.err.splitlines()

    return run_line


def test_a_sound_probe_passes_and_what_was_not_tested_says_what_it_takes(run):
    code, lines, told = run("self-test")
    assert code == 0
    assert lines[-1] == "simulated probe: passed"
    assert [line for line in lines if " failed " in line] == []
    [side] = [line for line in lines if "LED +x" in line]
    assert "not tested" in side
    assert "reference block" in side
    assert told == ["Keep the probe free"]


def test_what_failed_is_listed_with_all_else_as_data(run):
    code, [line], _ = run("self-test", "--json", scene="[sensor]\nread_noise_e = 200.0\n")
    answer = json.loads(line)
    assert (code, answer["simulated"], answer["verdict"]) == (1, True, "failed")
    [failed] = [result for result in answer["results"] if result["verdict"] == "failed"]
    assert (failed["part"], failed["check"], failed["unit"]) == ("Camera", "noise", "counts")
    assert failed["value"] > 1.5
    assert {result["part"] for result in answer["results"]} == {
        "Storage", "Model", "Camera", "Light", "Load cell", "Clock",
    }  # fmt: skip


def test_parts_that_do_not_open_are_failures_by_name(run):
    scene = '[cell]\nzero_counts = 60000.0\n[[faults]]\nkind = "bundle_tampered"\n'
    code, [line], _ = run("self-test", "--json", scene=scene)
    assert code == 1
    results = json.loads(line)["results"]
    assert [(result["part"], result["code"]) for result in results] == [("Load cell", "E306"), ("Model", "E401")]


def test_a_weight_that_the_cell_does_not_bear_is_one_sentence(run):
    code, lines, told = run("self-test", "--weight-n", "99")
    assert (code, lines) == (1, [])
    assert told[-1].startswith("weight_n is 99")
