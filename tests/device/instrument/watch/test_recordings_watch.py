"""A recording that goes bad while the daemon runs is found by reading it, told once, and never ends the looking."""

from __future__ import annotations

import errno
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest
from daemon_process import wait_for
from probe_card import add_measurement

from device.instrument.watch import recordings_watch
from device.instrument.watch.clock_watch import ClockWatch
from device.instrument.watch.recordings_watch import RecordingsWatch
from device.records import recordings
from device.records.store import Store


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    opened = Store(tmp_path)
    for number in (1, 2, 3):
        add_measurement(opened, number)
    yield opened
    opened.close()


def spoil(store: Store, name: str) -> None:
    path = store.folder / "recordings" / f"{name}.zip"
    content = bytearray(path.read_bytes())
    content[100] ^= 1
    path.write_bytes(content)


def test_a_bit_that_has_flipped_since_the_last_start_is_found_soon_and_told_once(store: Store) -> None:
    spoil(store, "r-2")
    watch = RecordingsWatch(store, ClockWatch(2.0))
    assert watch.taken() == ()
    watch.start()
    [warning] = wait_for(watch.taken, bool)
    watch.close()
    assert (warning.code, warning.is_lasting) == ("E604", True)
    assert "1 recording (r-2)" in warning.cause
    assert watch.taken() == ()


def test_one_more_is_told_together_with_those_that_the_start_has_found(store: Store) -> None:
    (store.folder / "recordings" / "r-1.zip").unlink()
    store.close()
    again = Store(store.folder)
    with closing(again):
        watch = RecordingsWatch(again, ClockWatch(2.0))
        assert watch.taken() == ()
        spoil(again, "r-3")
        for name in again.recordings.newest():
            watch.look(name)
        [warning] = watch.taken()
        assert "2 recordings (r-1, r-3)" in warning.cause


def test_recordings_of_before_there_were_hashes_get_theirs_without_being_asked(store: Store) -> None:
    with sqlite3.connect(store.folder / "tsis.sqlite") as db:
        db.execute("DELETE FROM kept_recording")
    db.close()
    watch = RecordingsWatch(store, ClockWatch(2.0))
    watch.start()
    wait_for(store.recordings.unnoted, lambda names: not names)
    watch.close()
    assert watch.taken() == ()


def test_a_disk_that_cannot_be_read_once_is_looked_at_again(store: Store, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recordings_watch, "LATER_S", 0.01)
    look_through, failures = store.recordings.newest, iter([OSError(errno.EIO, "Input/output error")])

    def newest() -> list[str]:
        for failure in failures:
            raise failure
        return look_through()

    monkeypatch.setattr(store.recordings, "newest", newest)
    spoil(store, "r-2")
    watch = RecordingsWatch(store, ClockWatch(2.0))
    watch.start()
    [warning] = wait_for(watch.taken, bool)
    watch.close()
    assert "r-2" in warning.cause


def test_a_recording_that_no_descriptor_was_left_for_is_not_called_damaged(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(path: Path, **_: bool) -> None:
        raise OSError(errno.EMFILE, "Too many open files")

    watch = RecordingsWatch(store, ClockWatch(2.0))
    monkeypatch.setattr(recordings, "fingerprint_of", fail)
    with pytest.raises(OSError, match="Too many open files"):
        watch.look("r-1")
    assert watch.taken() == ()


def test_a_recording_of_before_there_were_hashes_that_cannot_be_read_is_damaged(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    with sqlite3.connect(store.folder / "tsis.sqlite") as db:
        db.execute("DELETE FROM kept_recording")
    db.close()

    def fail(path: Path, **_: bool) -> None:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr(recordings, "fingerprint_of", fail)
    assert not store.recordings.check("r-1")
    assert "r-1" in store.recordings.unnoted()
