"""The ways out: a file for the updater, whole and once, and the support file's own command."""

import subprocess

import pytest

from device.errors import BusyError, DeviceError, NotSetUp
from device.fallback import actions
from device.fallback.actions import ROLL_BACK, has_support, roll_back, support_file
from device.fallback.situation import Situation

GOOD = Situation("", "", release="0.2.0+9", last_good="0.1.0+3")


@pytest.fixture
def incoming(tmp_path):
    folder = (tmp_path / ROLL_BACK).parent
    folder.mkdir(parents=True)
    return folder


def test_the_updater_sees_one_file_appear(tmp_path, incoming):
    roll_back(tmp_path, GOOD)
    assert [path.name for path in incoming.iterdir()] == ["roll_back"]


def test_asked_twice_it_says_so(tmp_path, incoming):
    roll_back(tmp_path, GOOD)
    with pytest.raises(BusyError, match="already"):
        roll_back(tmp_path, GOOD)
    assert [path.name for path in incoming.iterdir()] == ["roll_back"]


@pytest.mark.parametrize("good", ["", "0.2.0+9"])
def test_without_another_release_nothing_is_asked(tmp_path, incoming, good):
    with pytest.raises(NotSetUp):
        roll_back(tmp_path, Situation("", "", release="0.2.0+9", last_good=good))
    assert list(incoming.iterdir()) == []


def test_a_probe_without_an_updater_says_so(tmp_path):
    with pytest.raises(DeviceError, match="The updater cannot be asked: No such file"):
        roll_back(tmp_path, GOOD)


def test_a_support_file_is_offered_where_its_command_is(monkeypatch):
    monkeypatch.setattr(actions, "SUPPORT", "device.commands.led_off")
    assert has_support()
    for missing in ("device.commands.none_such", "device.none_such.support"):
        monkeypatch.setattr(actions, "SUPPORT", missing)
        assert not has_support()


def answers(monkeypatch, code, content=None, stderr=""):
    def run(command, **_):
        if content is not None:
            with open(command[-1], "wb") as file:
                file.write(content)
        return subprocess.CompletedProcess(command, code, "", stderr)

    monkeypatch.setattr(subprocess, "run", run)


def test_the_support_file_is_what_its_command_writes(monkeypatch):
    answers(monkeypatch, 0, b"PK")
    assert support_file() == b"PK"


@pytest.mark.parametrize(("code", "content", "stderr"), [(1, None, "Traceback\nNo disk."), (0, None, "")])
def test_a_command_that_writes_none_is_a_fault(monkeypatch, code, content, stderr):
    answers(monkeypatch, code, content, stderr)
    with pytest.raises(DeviceError, match="The support file was not written: (No disk|.*No such file)"):
        support_file()
