"""What a daemon that is about to be restarted leaves for the next one."""

import json

import pytest

from device.instrument.watch.restart_note import IN_A_ROW_S, NAME, RestartNote

CAUSE = "the camera made no progress for 7.6 s"


def test_the_next_daemon_says_why_it_was_restarted_and_the_one_after_does_not(tmp_path):
    RestartNote(tmp_path).write(CAUSE)
    warning = RestartNote(tmp_path).warning()
    assert (warning.code, warning.severity) == ("E902", "warning")
    assert warning.cause == f"Restarted by the watchdog: {CAUSE}."
    assert RestartNote(tmp_path).warning() is None


def test_a_note_that_is_taken_back_tells_nothing(tmp_path):
    note = RestartNote(tmp_path)
    note.write(CAUSE)
    note.remove()
    note.remove()
    assert RestartNote(tmp_path).warning() is None


def test_restarts_are_counted_until_one_has_held_for_ten_minutes(tmp_path):
    now_s, times = [0.0], []
    for runs_s in (5.0, 5.0, IN_A_ROW_S, 5.0):
        note = RestartNote(tmp_path, lambda: now_s[0])
        times.append(note.times)
        now_s[0] += runs_s
        note.see_health()
        note.write(CAUSE)
    assert times == [0, 1, 2, 1]


def test_ten_minutes_at_fault_are_no_health(tmp_path):
    RestartNote(tmp_path).write(CAUSE)
    now_s = [0.0]
    note = RestartNote(tmp_path, lambda: now_s[0])
    now_s[0] = IN_A_ROW_S
    assert note.times == 1


@pytest.mark.parametrize("content", ["", "[]", "{}", json.dumps({"cause": CAUSE, "times": "often"})])
def test_a_note_that_cannot_be_read_counts_as_none(tmp_path, caplog, content):
    (tmp_path / NAME).write_text(content)
    note = RestartNote(tmp_path)
    assert note.times == 0
    assert "cannot be read" in caplog.text


def test_a_disk_that_does_not_take_it_is_logged(tmp_path, caplog):
    (tmp_path / "file").touch()
    RestartNote(tmp_path / "file" / "folder").write(CAUSE)
    assert "cannot be kept" in caplog.text
