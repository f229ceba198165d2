"""Good files are kept for a start with bad ones, which says so; without any good ones there is no start."""

import logging
import tomllib
from pathlib import Path

import pytest

from device.errors import ConfigError
from device.files.plain_settings import LAST_GOOD, below
from device.settings.last_good import start_settings
from device.settings.layers import read_layers


@pytest.fixture
def read(tmp_path):
    """Read settings whose data folder is the test's own."""

    def read_text(text, data=tmp_path / "var"):
        (tmp_path / "probe.toml").write_text(f'data = "{data}"\n' + text)
        return read_layers([tmp_path / "probe.toml"])

    return read_text


@pytest.fixture
def kept(tmp_path):
    return tmp_path / "var" / LAST_GOOD


def test_good_files_are_used_without_a_warning(read):
    settings = start_settings(read("[press]\ntarget_n = 0.6\n"))
    assert settings.config.press.target_n == 0.6
    assert settings.warning is None


def test_what_good_files_set_is_kept_and_nothing_else(read, kept):
    start_settings(read("[press]\ntarget_n = 0.6\n[light]\nratio = [1, 0.5, 0.5, 0.5]\naddress = 0x61\n")).keep()
    assert tomllib.loads(kept.read_text()) == {
        "data": str(kept.parent),
        "light": {"address": 0x61, "ratio": [1, 0.5, 0.5, 0.5]},
        "press": {"target_n": 0.6},
    }


def test_with_bad_files_the_last_good_settings_are_used_with_a_warning_of_its_own_code(read, kept, caplog):
    good = start_settings(read('serial = "TSIS-0042"\n[press]\ntarget_n = 0.6\n'))
    good.keep()
    with caplog.at_level(logging.ERROR):
        settings = start_settings(read("[press]\ntarget_n = 99\nsteady_n = 9\n"))
    assert settings.config == good.config
    assert (settings.warning.code, settings.warning.severity) == ("E002", "warning")
    assert "press.target_n" in settings.warning.cause
    assert "and 1 more" in settings.warning.cause
    assert str(kept) in settings.warning.cause
    assert ["press.target_n is 99" in line or "press.steady_n is 9" in line for line in caplog.messages] == [True, True]


def test_a_start_on_the_last_good_settings_leaves_them_as_they_are(read, kept):
    start_settings(read("[press]\ntarget_n = 0.6\n")).keep()
    before = kept.read_text()
    start_settings(read("[press]\ntarget_n = 99\n")).keep()
    assert kept.read_text() == before


def test_the_next_good_start_replaces_the_last_good_settings(read, kept):
    for target_n in (0.6, 0.7):
        start_settings(read(f"[press]\ntarget_n = {target_n}\n")).keep()
    assert tomllib.loads(kept.read_text())["press"] == {"target_n": 0.7}


def test_the_same_settings_are_not_written_again(read, kept):
    """A start costs the memory card no write."""
    start_settings(read("")).keep()
    before = kept.stat().st_ino
    start_settings(read("")).keep()
    assert kept.stat().st_ino == before


def test_without_last_good_settings_bad_files_are_refused_with_every_problem(read):
    with pytest.raises(ConfigError) as refusal:
        start_settings(read("[press]\ntarget_n = 99\nsteady_n = 9\n"))
    assert refusal.value.code == "E001"
    assert len(refusal.value.cause.splitlines()) == 2


@pytest.mark.parametrize("content", ["[press", "[press]\ntarget_n = 98\n"])
def test_last_good_settings_that_are_bad_themselves_are_told_with_the_others(read, kept, content):
    kept.parent.mkdir()
    kept.write_text(content)
    with pytest.raises(ConfigError) as refusal:
        start_settings(read("[press]\ntarget_n = 99\n"))
    of_files, of_last = refusal.value.cause.splitlines()
    assert "target_n is 99" in of_files
    assert of_last.startswith(f"{kept}: ")


def test_an_older_release_comes_back_on_last_good_settings_of_which_a_newer_one_knew_more(read, kept, caplog):
    """Its files and what was kept of them both have the setting that only the newer release knows."""
    kept.parent.mkdir()
    kept.write_text('[press]\ntarget_n = 0.6\nnew_thing = 3\n[new_section]\nat = "x"\n')
    with caplog.at_level(logging.WARNING):
        settings = start_settings(read("[press]\ntarget_n = 0.7\nnew_thing = 3\n"))
    assert settings.config.press.target_n == 0.6
    passed_over = [line for line in caplog.messages if line.startswith(f"passed over: {kept}: ")]
    assert [line.split()[3] for line in passed_over] == ["press.new_thing", "new_section"]
    assert "press.new_thing" in settings.warning.cause


def test_below_a_root_the_last_good_settings_are_those_of_that_card(read, tmp_path):
    """The card of a dead probe, mounted on the workstation or on another probe."""
    card = tmp_path / "card"
    for root, serial in ((Path("/"), "TSIS-0008"), (card, "TSIS-0007")):
        path = below(root, tmp_path / "var" / LAST_GOOD)
        path.parent.mkdir(parents=True)
        path.write_text(f'serial = "{serial}"\n')
    assert start_settings(read("[press]\ntarget_n = 99\n"), card).config.serial == "TSIS-0007"


def test_a_name_of_an_earlier_version_is_told(read, caplog):
    assert start_settings(read('model = "m"\n')).config.paper_model == Path("m")
    assert "model is called paper_model now: rename it" in caplog.text


def test_a_folder_that_cannot_be_written_does_not_keep_the_probe_from_running(read, tmp_path, caplog):
    (tmp_path / "file").write_text("")
    start_settings(read("", data=tmp_path / "file")).keep()
    assert "cannot be kept" in caplog.text
