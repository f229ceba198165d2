"""What the updater's files say, also when they are damaged, and how a file is handed to it."""

import errno
import json
import os
from dataclasses import replace
from pathlib import Path

import pytest

from device.errors import BodyTooLarge, BusyError, DiskFullError, NotSetUp, RolledBack, StorageError
from device.records import updates as module
from device.records.updates import RELEASES, IncomingRelease, Updates, release_of
from device.update.incoming import clear_incoming, take_uploaded
from device.update.layout import UpdateLayout
from device.update.progress import ProgressReport
from device.update.state import PendingRelease, UpdateState, write_state

STATE = {
    "committed": "0.1.0+400",
    "previous": "0.0.9+390",
    "pending": None,
    "floor": 400,
    "bad": {"0.2.0+412": "camera gave no image"},
    "history": [
        {"release": "0.1.0+400", "event": "committed", "reason": ""},
        {"release": "0.2.0+412", "event": "rolled_back", "reason": "camera gave no image."},
    ],
}
IDLE = {"schema": "tsis.update/1", "state": "idle", "release": None, "progress": 0.0, "reason": "", "step": ""}


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "incoming").mkdir()
    return tmp_path


def told(folder, known=STATE, /, **progress):
    (folder / "state.json").write_text(json.dumps(known))
    (folder / "progress.json").write_text(json.dumps(IDLE | progress))
    return Updates(folder, "0.1.0+400")


def test_a_workstation_says_that_nothing_updates_it(tmp_path):
    record = Updates(tmp_path / "none", "0.1.0").now()
    assert (record.state, record.running, record.can_roll_back) == ("not_installed", "0.1.0", False)
    assert record.reason == "This software is not installed as a release."
    assert Updates(tmp_path / "none").warning() is None


def test_the_release_is_its_folder_or_on_a_workstation_the_version():
    assert release_of(RELEASES / "0.2.0+412") == "0.2.0+412"
    assert release_of(Path("/home/me/.venv")) == module.__version__


def test_the_record_says_what_runs_what_was_before_and_how_the_last_update_ended(folder):
    record = told(folder).now()
    assert (record.running, record.committed, record.previous, record.floor) == (
        "0.1.0+400", "0.1.0+400", "0.0.9+390", 400,
    )  # fmt: skip
    assert record.outcome == ("Version 0.2.0 did not work: camera gave no image. This probe went back to 0.1.0.")
    assert record.can_roll_back
    assert [entry["release"] for entry in record.history] == ["0.1.0+400", "0.2.0+412"]


def test_an_update_taken_back_is_a_lasting_warning_until_the_next_one_is_installed(folder):
    updates = told(folder)
    warning = updates.warning()
    assert (warning.code, warning.severity, warning.is_lasting) == ("E013", "warning", True)
    assert warning.cause == "Version 0.2.0 did not work: camera gave no image."
    assert warning.remedy == "This probe went back to 0.1.0. Measure as before."
    (folder / "progress.json").unlink()
    assert updates.warning().code == "E013"
    refused = told(folder, state="refused", release="0.1.0+399", reason="It is older.").now()
    assert refused.outcome == "Version 0.1.0 was refused: It is older. Nothing was changed."
    assert told(folder, state="refused").warning().code == "E013"
    first = STATE | {"history": []}
    assert told(folder, first, state="rolled_back", release="0.2.0+412", reason="x").warning().code == "E013"
    assert told(folder, first, state="committed", release="0.3.0+420").warning() is None
    newer = STATE | {"history": [*STATE["history"], {"release": "0.3.0+420", "event": "committed", "reason": ""}]}
    assert told(folder, newer).warning() is None
    assert told(folder, newer).now().outcome == "Version 0.3.0 is installed and works."


def test_the_warning_is_there_at_the_start_of_the_daemon_that_comes_back(folder):
    """The updater starts that one before it adds to its history, so that a full disk keeps nobody dark."""
    pending = {"release": "0.3.0+420", "tries": 1, "leaving": "light is not ready (E201)"}
    updates = told(folder, STATE | {"history": [], "pending": pending}, state="checking", release="0.3.0+420")
    assert updates.warning().cause == "Version 0.3.0 did not work: light is not ready (E201)."
    assert updates.now().as_record()["leaving"] == "light is not ready (E201)"


def test_an_update_under_way_says_how_far_it_is(folder):
    record = told(
        folder, STATE | {"pending": {"release": "0.3.0+420", "tries": 1}}, state="unpacking", progress=0.25
    ).now()
    assert (record.state, record.progress, record.pending, record.is_under_way) == (
        "unpacking", 0.25, "0.3.0+420", True,
    )  # fmt: skip
    assert not record.can_roll_back


@pytest.mark.parametrize(
    "content",
    [b"", b"{", b"[]", b"\xff\xfe", b"null", b'"x"', b"[" * 100_000, b'{"history": 3, "previous": [], "floor": "x"}'],
)
def test_a_bad_file_does_not_break_it(folder, content):
    updates = told(folder)
    for name in ("state.json", "progress.json"):
        (folder / name).write_bytes(content)
        assert updates.now().running == "0.1.0+400"
        json.dumps(updates.now().as_record())
        updates.warning()


def test_a_progress_beyond_its_bounds_is_none(folder):
    for value in (-1, 2, float("inf"), "0.5", True, None):
        assert told(folder, state="unpacking", progress=value).now().progress is None


def test_a_file_is_there_for_the_updater_only_when_it_is_whole(folder):
    updates = told(folder)
    incoming = updates.receive(12)
    incoming.write(b"one")
    assert not (folder / "incoming" / "update.release").exists()
    incoming.write(b"two")
    incoming.hand_over()
    incoming.discard()
    assert (folder / "incoming" / "update.release").read_bytes() == b"onetwo"
    assert [path.name for path in (folder / "incoming").iterdir()] == ["update.release"]
    assert updates.now().state == "waiting"
    with pytest.raises(BusyError, match="An update is under way"):
        updates.require_free()
    os.utime(folder / "progress.json", (2e9, 2e9))  # the updater has told of it
    assert updates.now().state == "idle"


def test_one_that_is_given_up_leaves_nothing_and_a_leftover_is_removed(folder):
    updates = told(folder)
    (folder / "incoming" / ".upload-old").write_bytes(b"of a daemon that was killed")
    of_ssh = IncomingRelease(folder / "incoming")
    (kept,) = (folder / "incoming").glob(".upload-????????")
    incoming = updates.receive(None)
    incoming.write(b"one")
    with pytest.raises(BusyError, match="Another file"):
        updates.receive(None)
    incoming.discard()
    assert list((folder / "incoming").iterdir()) == [kept]  # is still being taken
    of_ssh.discard()
    updates.receive(None).discard()


def test_a_file_that_waits_for_the_updater_is_not_replaced(folder):
    incoming = told(folder).receive(None)
    incoming.write(b"mine")
    (folder / "incoming" / "update.release").write_bytes(b"another")
    with pytest.raises(BusyError, match="another file waits"):
        incoming.hand_over()
    assert [path.read_bytes() for path in (folder / "incoming").iterdir()] == [b"another"]


@pytest.mark.parametrize("state", ["verifying", "unpacking", "switching", "checking"])
def test_nothing_is_taken_while_an_update_is_under_way(folder, state):
    with pytest.raises(BusyError):
        told(folder, state=state).receive(10)
    with pytest.raises(BusyError):
        told(folder, state=state).ask_to_roll_back()


def test_a_file_that_cannot_be_one_is_refused_before_anything_is_written(folder, monkeypatch):
    updates = told(folder)
    with pytest.raises(BodyTooLarge, match="at most") as refused:
        updates.receive(module.LARGEST_BYTES + 1)
    assert (refused.value.code, refused.value.status) == ("E809", 413)
    monkeypatch.setattr(module, "SPARE_BYTES", 10**18)
    with pytest.raises(DiskFullError, match="does not fit"):
        updates.receive(10)
    assert list((folder / "incoming").iterdir()) == []


def test_one_that_grows_too_large_is_refused(folder, monkeypatch):
    monkeypatch.setattr(module, "LARGEST_BYTES", 5)
    incoming = told(folder).receive(None)
    incoming.write(b"12345")
    with pytest.raises(BodyTooLarge, match="at most 5"):
        incoming.write(b"6")
    incoming.discard()


@pytest.mark.parametrize(("number", "kind"), [(errno.ENOSPC, DiskFullError), (errno.EROFS, StorageError)])
def test_a_disk_that_refuses_is_a_fault_of_the_store(folder, monkeypatch, number, kind):
    def refuse(_handle):
        raise OSError(number, os.strerror(number))

    incoming = told(folder).receive(None)
    incoming.write(b"1")
    monkeypatch.setattr(module.os, "fsync", refuse)
    with pytest.raises(kind):
        incoming.hand_over()
    incoming.discard()
    assert list((folder / "incoming").iterdir()) == []


def test_the_way_back_is_a_file_too_and_only_where_there_is_one(folder):
    told(folder).ask_to_roll_back()
    assert (folder / "incoming" / "roll_back").exists()
    with pytest.raises(BusyError):
        told(folder).ask_to_roll_back()
    (folder / "incoming" / "roll_back").unlink()
    with pytest.raises(NotSetUp, match="no release before"):
        told(folder, STATE | {"previous": None}).ask_to_roll_back()
    assert list((folder / "incoming").iterdir()) == []


def test_without_an_updater_nothing_is_taken(tmp_path):
    with pytest.raises(NotSetUp, match="not installed as a release") as refused:
        Updates(tmp_path / "none").receive(10)
    assert (refused.value.code, refused.value.status) == ("E812", 409)


def test_what_the_updater_writes_is_what_is_read(tmp_path):
    """By the updater's own code: a release that is being left, then was, then another one that is committed."""
    layout = UpdateLayout(tmp_path)
    (layout.incoming).mkdir(parents=True)
    updates = Updates(layout.notes, "0.1.0+400")
    assert updates.now().state == "not_installed"
    before = UpdateState(committed="0.1.0+400", previous="0.0.9+390", floor=400).noted("0.1.0+400", "committed")
    reason = "camera is not ready (E101)"
    write_state(layout, replace(before, pending=PendingRelease("0.2.0+412", tries=1, leaving=reason)))
    report = ProgressReport(layout)
    report.release = "0.2.0+412"
    report.tell("checking", 0.7, "health")
    record = updates.now()
    assert (record.state, record.progress, record.step) == ("checking", 0.7, "health")
    assert updates.warning().cause == f"Version 0.2.0 did not work: {reason}."
    write_state(layout, before.noted("0.2.0+412", "rolled_back", reason))
    report.end("rolled_back", RolledBack(f"0.2.0+412 was left: {reason}", "Send the log."))
    words = f"Version 0.2.0 did not work: {reason}. This probe went back to 0.1.0."
    assert (updates.now().outcome, updates.now().can_roll_back) == (words, True)
    write_state(layout, replace(before, committed="0.3.0+420").noted("0.3.0+420", "committed"))
    report.release = "0.3.0+420"
    report.end("committed")
    assert updates.warning() is None
    assert updates.now().outcome == "Version 0.3.0 is installed and works."
    incoming = updates.receive(3)
    incoming.write(b"abc")
    clear_incoming(layout)  # of an updater that starts meanwhile
    incoming.hand_over()
    assert take_uploaded(layout)
