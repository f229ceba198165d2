"""What is known while the daemon does not run, from sources each of which may be missing, old or damaged."""

import json

import pytest

from device.errors import ConfigError
from device.fallback.situation import NOTES, read_situation
from device.files.start_note import write_note

REFUSED = ConfigError("press.target_n is 99.", "Correct it.")
FAILED = {"LoadState": "loaded", "ActiveState": "activating", "Result": "exit-code", "ExecMainStatus": "1"}


class FakeProbe:
    """Commands and files of a probe."""

    def __init__(self, folder, monkeypatch):
        self.folder = folder
        for name in ("bin", "run/tsis", NOTES, "opt/tsis"):
            (folder / name).mkdir(parents=True)
        monkeypatch.setenv("PATH", f"{folder / 'bin'}:/usr/bin:/bin")
        self.command("systemctl", "exit 1")
        self.command("journalctl", "exit 1")

    def command(self, name, text):
        path = self.folder / "bin" / name
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)

    def unit(self, **values):
        lines = "".join(f"{name}={value}\\n" for name, value in {"LoadState": "loaded", **values}.items())
        self.command("systemctl", f"printf '{lines}'")

    def refused(self, pid):
        write_note(self.folder, [REFUSED.as_record()])
        path = self.folder / "run/tsis/start.json"
        path.write_text(json.dumps({**json.loads(path.read_text()), "pid": pid}))

    def runs(self, release):
        link = self.folder / "opt/tsis/current"
        link.unlink(missing_ok=True)
        link.symlink_to(f"releases/{release}")

    def note(self, name, **record):
        (self.folder / NOTES / name).write_text(json.dumps(record))

    @property
    def situation(self):
        return read_situation(self.folder)


@pytest.fixture
def probe(tmp_path, monkeypatch):
    return FakeProbe(tmp_path, monkeypatch)


def codes(situation):
    return [fault["code"] for fault in situation.faults]


def test_without_any_word_it_is_starting(probe):
    assert (probe.situation.headline, codes(probe.situation)) == ("The probe is starting", [])


def test_what_the_daemon_noted_is_told_also_without_systemd(probe):
    probe.refused(pid=7)
    assert probe.situation.faults == (REFUSED.as_record(),)


def test_it_is_told_between_two_starts_and_during_the_next_one(probe):
    probe.refused(pid=7)
    probe.unit(**FAILED, ExecMainPID=7, MainPID=0)
    between = probe.situation
    probe.unit(ActiveState="activating", Result="success", ExecMainPID=8, MainPID=8)
    assert codes(between) == ["E001"]
    assert probe.situation == between  # the page does not flicker


def test_a_daemon_that_starts_for_the_first_time_has_no_fault(probe):
    probe.unit(ActiveState="activating", Result="success", ExecMainPID=8, MainPID=8)
    assert probe.situation.headline == "The probe is starting"


def test_an_end_without_a_word_is_told_with_the_last_lines_of_the_log(probe):
    """An import fails: what an earlier process noted is not why."""
    probe.refused(pid=7)
    probe.runs("0.2.0+9")
    probe.unit(**FAILED, ExecMainPID=9, MainPID=0)
    probe.command("journalctl", "seq 1 50; echo 'No module named numpy'")
    assert codes(probe.situation) == ["E000"]
    assert "0.2.0+9 ended before it could say why (exit-code, 1)" in probe.situation.faults[0]["cause"]
    assert probe.situation.log[-1] == "No module named numpy"
    assert len(probe.situation.log) == 20


def test_what_another_release_noted_is_not_told(probe):
    probe.runs("0.1.0+3")
    probe.refused(pid=7)
    probe.runs("0.2.0+9")
    assert codes(probe.situation) == []


def test_a_daemon_that_was_stopped_is_no_fault(probe):
    probe.refused(pid=7)
    probe.unit(ActiveState="inactive", Result="success", ExecMainPID=7, MainPID=0)
    assert (probe.situation.headline, codes(probe.situation)) == ("The probe's software is stopped", [])


@pytest.mark.parametrize("state", ["verifying", "unpacking", "switching", "checking"])
def test_an_update_under_way_is_told_instead(probe, state):
    probe.refused(pid=7)
    probe.note("progress.json", schema="tsis.update/1", state=state)
    assert probe.situation.headline == "A release is being installed"


@pytest.mark.parametrize("state", ["idle", "committed", "rolled_back", "refused"])
def test_an_update_that_has_ended_is_not(probe, state):
    probe.note("progress.json", schema="tsis.update/1", state=state)
    assert probe.situation.headline == "The probe is starting"


@pytest.mark.parametrize(
    ("current", "committed", "previous", "good"),
    [
        ("0.2.0+9", "0.1.0+3", None, "0.1.0+3"),  # on trial
        ("0.2.0+9", "0.2.0+9", "0.1.0+3", "0.1.0+3"),
        ("0.2.0+9", "0.2.0+9", None, ""),
    ],
)
def test_the_last_good_release_is_another_than_the_one_that_does_not_start(probe, current, committed, previous, good):
    probe.runs(current)
    probe.note("state.json", schema="tsis.update_state/1", committed=committed, previous=previous)
    assert (probe.situation.release, probe.situation.last_good) == (current, good)
    assert probe.situation.may_roll_back == bool(good)
    probe.note("progress.json", schema="tsis.update/1", state="checking")
    assert not probe.situation.may_roll_back, "the updater may be going back by itself"


@pytest.mark.parametrize("text", ["", "{", "[]", "7"])
def test_damaged_files_of_the_updater_leave_less_to_say(probe, text):
    for name in ("state.json", "progress.json"):
        (probe.folder / NOTES / name).write_text(text)
    assert (probe.situation.release, probe.situation.last_good) == ("", "")


def test_a_unit_that_is_not_there_is_none(probe):
    probe.refused(pid=7)
    probe.unit(LoadState="not-found", ActiveState="inactive")
    assert codes(probe.situation) == ["E001"]
