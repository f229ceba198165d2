"""`python -m device config` as typed: every problem with exit code 1, every value with the file that sets it."""

import json

import pytest

from device.__main__ import main
from device.settings.catalogue import SETTINGS


@pytest.fixture
def run(capsys, tmp_path, monkeypatch):
    """Run `config ...` below an empty root; return its exit code and the lines of stdout and stderr."""
    monkeypatch.chdir(tmp_path)

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
