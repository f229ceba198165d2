"""What a daemon that is about to be restarted leaves for the next one."""

import json

import pytest

from device.instrument.watch.restart_note import IN_A_ROW_S, NAME, RestartNote, note_end

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
    note.take_back()
    note.take_back()
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


@pytest.mark.parametrize(
    ("boot", "cause"),
    [("A", "The daemon was killed while it ran."), ("B", "The probe lost its power, or its board was restarted")],
)
def test_an_end_that_was_no_stop_is_told_once_and_says_whether_the_board_went_off_too(tmp_path, boot, cause):
    RestartNote(tmp_path, boot=lambda: "A").begin()
    after = RestartNote(tmp_path, boot=lambda: boot)
    warning = after.warning()
    assert (warning.code, warning.severity) == ("E903", "warning")
    assert warning.cause.startswith(cause)
    assert after.times == 0
    assert RestartNote(tmp_path).warning() is None


def test_a_daemon_that_was_stopped_leaves_nothing_to_tell(tmp_path):
    note = RestartNote(tmp_path)
    note.begin()
    note.remove()
    assert not (tmp_path / NAME).exists()


def test_the_watchdogs_cause_is_told_in_place_of_the_end_that_it_brought(tmp_path):
    note = RestartNote(tmp_path)
    note.begin()
    note.write(CAUSE)
    note_end(tmp_path, {"SERVICE_RESULT": "watchdog"})
    assert RestartNote(tmp_path).warning().code == "E902"


def test_a_cause_that_was_taken_back_leaves_the_daemon_running(tmp_path):
    note = RestartNote(tmp_path)
    note.begin()
    note.write(CAUSE)
    note.take_back()
    assert RestartNote(tmp_path).warning().code == "E903"


@pytest.mark.parametrize(
    ("result", "status", "cause"),
    [
        ("watchdog", "ABRT", "The daemon froze as a whole, and its watchdog ended it."),
        ("oom-kill", "KILL", "The board's memory ran out, and the daemon was killed."),
        ("signal", "KILL", "The daemon was killed by the signal KILL."),
        ("core-dump", "SEGV", "The daemon crashed with the signal SEGV."),
        ("exit-code", "1", "The daemon failed with exit code 1."),
        ("", "", "The daemon was killed while it ran."),
    ],
)
def test_what_systemd_knows_of_the_end_is_in_the_warning(tmp_path, result, status, cause):
    RestartNote(tmp_path).begin()
    note_end(tmp_path, {"SERVICE_RESULT": result, "EXIT_STATUS": status})
    assert RestartNote(tmp_path).warning().cause == cause


@pytest.mark.parametrize("content", [None, "", "[]", "{}"])
def test_without_a_note_there_is_nothing_to_complete(tmp_path, content):
    if content is not None:
        (tmp_path / NAME).write_text(content)
    note_end(tmp_path, {"SERVICE_RESULT": "signal", "EXIT_STATUS": "KILL"})
    assert (tmp_path / NAME).exists() is (content is not None)
    assert RestartNote(tmp_path).warning() is None
