"""A recording is handed out as it was kept or not at all, and what a kill left is put in order at the next start."""

import os
import sqlite3

import pytest
from probe_card import RECORDING, add_measurement

from device.errors import DamagedRecordingError
from device.files.recording_file import write_recording
from device.records.manifest import manifest_of
from device.records.store import Store


@pytest.fixture
def folder(tmp_path):
    store = Store(tmp_path)
    for number in (1, 2, 3):
        add_measurement(store, number)
    store.close()
    return tmp_path


def opened(folder):
    store = Store(folder)
    store.close()
    return store.findings


def truncate(path):
    os.truncate(path, path.stat().st_size - 100)


def flip_one_bit(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


@pytest.mark.parametrize("harm", [truncate, flip_one_bit])
def test_a_recording_that_was_changed_is_not_handed_out_while_its_numbers_are(folder, harm):
    harm(folder / "recordings" / "r-2.zip")
    store = Store(folder)
    with pytest.raises(DamagedRecordingError, match="r-2 is damaged: not as it was kept") as refusal:
        store.recording_path("r-2")
    assert (refusal.value.code, refusal.value.status) == ("E604", 500)
    assert store.measurement("m-2")["force_n"] == 0.5
    assert store.recording_path("r-3").is_file()
    store.close()


def test_a_recording_of_another_size_and_a_missing_one_are_told_at_the_start(folder):
    truncate(folder / "recordings" / "r-1.zip")
    (folder / "recordings" / "r-3.zip").unlink()
    findings = opened(folder)
    assert (findings.missing, findings.resized) == (("r-3",), ("r-1",))
    [warning] = findings.warnings()
    assert (warning.code, warning.severity, warning.is_lasting) == ("E604", "warning", True)
    assert "2 recordings (r-3, r-1)" in warning.cause


def test_a_whole_start_tells_nothing(folder):
    assert opened(folder).warnings() == ()


def test_a_recording_that_a_kill_left_without_its_row_is_set_aside_and_told(folder):
    write_recording(RECORDING, folder / "recordings" / "r-0.zip")
    write_recording(RECORDING, folder / "recordings" / "r-9")
    findings = opened(folder)
    assert sorted(findings.orphans) == ["r-0.zip", "r-9"]
    assert [warning.code for warning in findings.warnings()] == ["E605"]
    assert sorted(path.name for path in (folder / "orphans").iterdir()) == ["r-0.zip", "r-9"]
    assert sorted(path.name for path in (folder / "recordings").iterdir()) == ["r-1.zip", "r-2.zip", "r-3.zip"]
    assert opened(folder).warnings() == ()


def test_recordings_beside_a_new_database_are_left_for_the_restore_that_may_bring_its_rows(tmp_path):
    write_recording(RECORDING, tmp_path / "recordings" / "r-0.zip")
    assert opened(tmp_path).orphans == ()
    assert (tmp_path / "recordings" / "r-0.zip").is_file()


def test_temporary_files_are_removed_and_counted(folder):
    (folder / "recordings" / "r-9.zip.tmp").write_bytes(b"PK half of it")
    (folder / "self-test.tmp").write_bytes(b"half")
    (folder / "restore.tmp" / "data").mkdir(parents=True)
    assert opened(folder).unfinished == 3
    assert [path.name for path in folder.glob("**/*.tmp")] == []


def test_a_recording_of_before_there_were_hashes_gets_its_own_as_it_is_found(folder):
    write_recording(RECORDING, folder / "recordings" / "r-2")
    (folder / "recordings" / "r-2.zip").unlink()
    with sqlite3.connect(folder / "tsis.sqlite") as db:
        db.execute("DELETE FROM kept_recording WHERE id = 'r-2'")
    db.close()
    store = Store(folder)
    assert store.recordings.unnoted() == ["r-2"]
    assert store.recording_path("r-2").is_dir()
    assert store.recordings.check("r-2")
    assert store.recordings.unnoted() == []
    flip_one_bit(folder / "recordings" / "r-2" / "frames" / "001.png")
    assert not store.recordings.check("r-2")
    with pytest.raises(DamagedRecordingError):
        store.recording_path("r-2")
    store.close()


def test_size_and_hash_are_kept_with_the_measurement_or_not_at_all(folder):
    store = Store(folder)
    store._db.execute("CREATE TRIGGER full BEFORE INSERT ON kept_recording BEGIN SELECT RAISE(ABORT, 'full'); END")
    with pytest.raises(Exception, match="full"):
        add_measurement(store, 4)
    assert [one["id"] for one in store.measurements(before_seq=99, limit=9)] == ["m-3", "m-2", "m-1"]
    assert set(manifest_of(store._db)) == {"r-1", "r-2", "r-3"}
    store.close()
