"""`python -m device config` as typed: every problem with exit code 1, every value with the file that sets it."""

import json
import os
from pathlib import Path
from shutil import copytree

import pytest

from device.__main__ import main
from device.files.shipped import MODELS
from device.settings.catalogue import SETTINGS

CERTIFICATES = "var/lib/tsis/calibrations"


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run `config ...` below an empty root; return its exit code and the lines of stdout and stderr."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / CERTIFICATES).mkdir(parents=True)

    def run_line(*arguments):
        code = main(["--root", ".", *arguments])
        captured = capsys.readouterr()
        return code, captured.out.splitlines(), captured.err.splitlines()

    return run_line


@pytest.fixture
def write(tmp_path):
    def write_text(name, text):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)

    return write_text


def test_without_a_file_there_is_no_problem(run):
    assert run("config", "check") == (0, ["There is no settings file: the defaults hold."], [])


def test_files_that_hold_are_named(run, write):
    write("etc/tsis/config.toml", "[press]\ntarget_n = 0.6\n")
    assert run("config", "check") == (0, ["etc/tsis/config.toml: no problem"], [])


def test_every_problem_of_every_installed_file_is_a_line(run, write):
    write("usr/lib/tsis/config.toml", "[camera]\ngain = 99\n")
    write("etc/tsis/config.d/a.toml", "[press]\ntarget_m = 0.5\n")
    code, lines, errors = run("config", "check")
    assert (code, errors) == (1, [])
    vendor, drop_in = lines
    assert vendor.startswith("usr/lib/tsis/config.toml: camera.gain is 99, but must be at least 1 and at most 16")
    assert drop_in.startswith("etc/tsis/config.d/a.toml: press.target_m is 0.5, ")
    assert drop_in.endswith("did you mean press.target_n.")


def test_a_file_is_checked_without_the_installed_ones(run, write):
    write("etc/tsis/config.toml", "[camera]\ngain = 99\n")
    write("good.toml", "[camera]\ngain = 2\n")
    assert run("config", "check", "good.toml") == (0, ["good.toml: no problem"], [])


def test_problems_are_data_for_a_program(run, write):
    write("bad.toml", "[camera]\ngain = 99\n")
    code, [line], _ = run("config", "check", "--json", "bad.toml")
    assert code == 1
    assert json.loads(line) == {
        "files": ["bad.toml"],
        "problems": [
            {
                "file": "bad.toml",
                "setting": "camera.gain",
                "value": "99",
                "bound": "at least 1 and at most 16",
                "hint": "correct it",
            }
        ],
        "renamed": [],
        "unreadable": [],
        "faults": [],
        "not_checked": [],
    }


def test_names_of_an_earlier_version_are_told_beside_problems(run, write):
    write("old.toml", 'model = "m"\n[camera]\ngain = 99\n')
    told = "old.toml: model is called paper_model now: rename it"
    code, lines, _ = run("config", "check", "old.toml")
    assert (code, lines[-1]) == (1, told)
    _, [line], _ = run("config", "check", "--json", "old.toml")
    assert json.loads(line)["renamed"] == [told]


def test_what_is_changed_is_shown_with_value_unit_default_and_file(run, write):
    write("etc/tsis/config.toml", 'serial = "TSIS-0042"\n[press]\ntarget_n = 0.6\n[camera]\ngain = 1.0\n')
    write("etc/tsis/config.d/a.toml", "[press]\ntarget_n = 0.75\n")
    code, lines, _ = run("config", "show", "--changed")
    assert code == 0
    assert [line.split() for line in lines[1:]] == [
        ["serial", '"TSIS-0042"', '"TSIS-0000"', "etc/tsis/config.toml"],
        ["press.target_n", "0.75", "N", "0.5", "etc/tsis/config.d/a.toml"],
    ]


def test_all_settings_are_shown_with_the_defaults_among_them(run):
    code, lines, _ = run("config", "show")
    assert code == 0
    assert [line.split()[0] for line in lines] == ["setting", *SETTINGS]
    assert all(line.endswith("  default") for line in lines[1:])


def test_a_stated_file_is_above_the_installed_ones(run, write):
    write("etc/tsis/config.toml", "[light]\nratio = [0.1, 0.1, 0.1, 0.1]\n")
    write("mine.toml", "[light]\nratio = [0.2, 0.2, 0.2, 0.2]\n")
    code, [line], _ = run("--config", "mine.toml", "config", "show", "--changed", "--json")
    assert code == 0
    assert json.loads(line) == [
        {
            "setting": "light.ratio",
            "value": [0.2] * 4,
            "unit": "",
            "default": [0.6] * 4,
            "file": "mine.toml",
        }
    ]


def test_bad_files_are_not_shown_but_refused_with_all_problems(run, write):
    write("etc/tsis/config.toml", "[press]\ntarget_n = 99\nsteady_n = 2\n")
    code, lines, errors = run("config", "show")
    assert (code, lines, len(errors)) == (1, [], 2)


@pytest.mark.parametrize("arguments", [("config",), ("config", "set"), ("config", "show", "--json", "--markdown")])
def test_wrong_usage_is_exit_code_2(run, arguments):
    with pytest.raises(SystemExit) as usage:
        run(*arguments)
    assert usage.value.code == 2


def test_a_file_that_is_named_and_not_there_is_no_fine_machine(run, write):
    named = '[webhook]\ntls_authority = "/etc/tsis/ca.pem"\n'
    write("etc/tsis/config.toml", named)
    code, lines, _ = run("config", "check")
    assert (code, lines[0]) == (1, "webhook.tls_authority names /etc/tsis/ca.pem: it is not there.")
    assert not [line for line in lines if "no problem" in line]
    write("etc/tsis/ca.pem", "")
    code, lines, _ = run("config", "check")
    assert (code, lines[0]) == (0, "etc/tsis/config.toml: no problem")


def test_a_file_that_is_checked_before_it_is_installed_may_name_what_is_elsewhere(run, write):
    write("new.toml", '[webhook]\ntls_authority = "/etc/tsis/ca.pem"\n')
    code, [line], _ = run("config", "check", "--json", "new.toml")
    told = {"setting": "webhook.tls_authority", "path": "/etc/tsis/ca.pem", "problem": "it is not there"}
    assert (code, json.loads(line)["unreadable"]) == (0, [told])


def test_a_model_that_the_settings_name_and_is_not_there_keeps_the_daemon_from_starting(run, write):
    write("etc/tsis/config.toml", 'serial = "TSIS-0007"\nstandard_model = "/srv/nowhere"\n')
    code, [line], _ = run("config", "check")
    assert code == 1
    assert line.startswith("E001 standard_model is srv/nowhere, which holds no model of mode standard for TSIS-0007. ")
    _, [line], _ = run("config", "check", "--json")
    [fault] = json.loads(line)["faults"]
    assert (fault["code"], fault["title"]) == ("E001", "Settings refused")


def test_a_certificate_and_a_quick_model_of_another_probe_are_told_at_once(run, write, tmp_path):
    copytree(MODELS / "quick", tmp_path / "srv/quick")
    certificate = (MODELS / "simulated_probe/calibration.json").read_text()
    write("srv/calibration.json", certificate)
    named = 'quick_model = "/srv/quick"\ncalibration = "/srv/calibration.json"\n'
    write("etc/tsis/config.toml", 'serial = "TSIS-0007"\n' + named)
    code, lines, _ = run("config", "check")
    told = "\n".join(lines)
    assert code == 1
    assert "E403 calibration is for probe SIM-0001, but must be for probe TSIS-0007" in told
    assert "E001 quick_model is srv/quick, which holds no model of mode quick for TSIS-0007. " in told
    assert "no problem" not in told
    write("etc/tsis/config.toml", 'serial = "SIM-0001"\n' + named)
    assert run("config", "check") == (0, ["etc/tsis/config.toml: no problem"], [])


def test_what_this_user_may_not_look_at_is_no_fault_of_the_probe(run, write, monkeypatch):
    write("etc/tsis/config.toml", "[press]\ntarget_n = 0.6\n")
    with monkeypatch.context() as patched:
        patched.setattr(os, "access", lambda path, mode: str(path) != CERTIFICATES)
        code, lines, _ = run("config", "check")
    told = f"Models and certificate are not checked: this user cannot read {CERTIFICATES}. Use sudo."
    assert (code, lines) == (0, ["etc/tsis/config.toml: no problem", told])
    Path(CERTIFICATES).rmdir()
    code, [line], _ = run("config", "check")
    assert (code, line.startswith(f"E402 The folder of calibrations {CERTIFICATES} is not there. ")) == (1, True)
