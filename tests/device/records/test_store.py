"""What was kept is there again after a restart, and what could not be kept is said so and leaves nothing behind."""

import errno
import os
import sqlite3
import types
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from device.errors import DamagedRecordingError, DiskFullError, ReusedKey, StorageError, UnknownResource
from device.files.recording_file import read_picture, read_recording, write_recording
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame
from device.records.asked_once import AskedOnce
from device.records.exams import ExamContent
from device.records.store import Store

CAMERA = CameraSettings(
    width_px=32, height_px=24, bits=8, mm_per_px_x=0.03, mm_per_px_y=0.04, exposure_us=4000.0, gain=1.0
)
FRAME = Frame(np.arange(768, dtype=np.uint8).reshape(24, 32), "press", 0.0, 0.5, (0.6, 0.6, 0.6, 0.6))
RECORDING = Recording("r-1", "TSIS-0007", "1.0", "2026-01-02T03:04:05Z", CAMERA, (FRAME, FRAME))


@pytest.fixture
def store(tmp_path):
    store = Store(tmp_path / "var")
    yield store
    store.close()


def add(store, number):
    record = {"id": f"m-{number}", "recording_id": f"r-{number}", "force_n": 0.5}
    return store.add_measurement(record, replace(RECORDING, id=f"r-{number}"))


def job(press_id, state):
    return {"id": press_id, "state": state, "progress": 0.5, "reason": "", "measurement_id": None}


def test_a_measurement_comes_back_with_its_sequence_number(store):
    kept = add(store, 1)
    unfiled = {"exam_id": None, "voided": None, "version": 1}
    assert kept == {"id": "m-1", "seq": 1, "recording_id": "r-1", "force_n": 0.5} | unfiled
    assert store.measurement("m-1") == kept


def test_the_recording_is_on_the_disk_beside_its_row(store):
    add(store, 1)
    found = read_recording(store.recording_path("r-1"))
    np.testing.assert_array_equal(found.frames[1].counts, FRAME.counts)


def test_a_recording_that_an_earlier_release_kept_as_a_folder_is_found_and_read(store):
    write_recording(RECORDING, store.folder / "recordings" / "r-1")
    found = store.recording_path("r-1")
    assert found.is_dir()
    np.testing.assert_array_equal(read_recording(found).frames[1].counts, FRAME.counts)
    (found / "recording.json").unlink()
    with pytest.raises(DamagedRecordingError, match="r-1 is missing"):
        store.recording_path("r-1")


def test_pngs_that_were_made_before_and_the_picture_are_what_is_kept(store):
    made = {id(frame): b"PNG of before" for frame in RECORDING.frames}
    store.add_measurement({"id": "m-1"}, RECORDING, encode=lambda frame: made[id(frame)], picture=b"picture")
    with zipfile.ZipFile(store.recording_path("r-1")) as archive:
        assert archive.read("r-1/frames/000.png") == b"PNG of before"
    assert read_picture(store.recording_path("r-1")) == b"picture"


def test_a_measurement_is_one_write_of_its_recording_and_one_of_its_folder(store, monkeypatch):
    """On a card each costs 10 to 30 ms; the database has its own."""
    synced, fsync = [], os.fsync
    monkeypatch.setattr(
        os, "fsync", lambda handle: synced.append(os.readlink(f"/proc/self/fd/{handle}")) or fsync(handle)
    )
    add(store, 1)
    assert [Path(one).name for one in synced] == ["r-1.zip.tmp", "recordings"]


class PowerCut(BaseException):
    """Nothing that is open is put in order any more."""


def test_wherever_the_power_fails_what_was_acknowledged_is_whole_and_the_rest_is_not_seen(tmp_path, monkeypatch):
    """Every synchronised write and every rename is such a place."""
    steps, kept, places = [0], [], 0

    def cut_before(real):
        def step(*arguments):
            steps[0] -= 1
            if steps[0] < 0:
                raise PowerCut
            return real(*arguments)

        return step

    monkeypatch.setattr(os, "fsync", cut_before(os.fsync))
    monkeypatch.setattr(Path, "rename", cut_before(Path.rename))
    while places == 0 or len(kept) == 0:
        store = Store(tmp_path)
        steps[0] = places
        try:
            kept.append(add(store, places + 1))
        except PowerCut:
            places += 1
        finally:
            steps[0] = 10**6
            store.close()
        again = Store(tmp_path)
        assert again.measurements(before_seq=2**62, limit=99) == kept
        for path in (again.folder / "recordings").iterdir():
            assert len(read_recording(path).frames) == 2
        again.close()
    assert places == 3  # the content, its name, the folder


def test_measurements_are_listed_newest_first_in_pages(store):
    for number in range(1, 6):
        add(store, number)
    first = store.measurements(before_seq=2**62, limit=2)
    assert [m["id"] for m in first] == ["m-5", "m-4"]
    assert [m["id"] for m in store.measurements(before_seq=first[-1]["seq"], limit=9)] == ["m-3", "m-2", "m-1"]
    assert store.measurements(before_seq=1, limit=9) == []


def test_all_is_there_again_after_a_restart_and_numbers_go_on(tmp_path):
    first = Store(tmp_path)
    kept = add(first, 1)
    first.save_press(job("p-1", "done"))
    first.close()
    second = Store(tmp_path)
    assert second.measurement("m-1") == kept
    assert second.press("p-1") == job("p-1", "done")
    assert add(second, 2)["seq"] == 2
    second.close()


def test_a_measurement_of_an_exam_is_kept_with_it_in_one_transaction(store):
    exam = store.exams.make(ExamContent(kind="phantom", operator="Ada"))
    kept = store.add_measurement({"id": "m-1"}, RECORDING, exam_id=exam["id"])
    assert kept["exam_id"] == exam["id"]
    assert store.measurement("m-1") == kept
    add(store, 2)
    assert [one["id"] for one in store.measurements(before_seq=9, limit=9, exam_id=exam["id"])] == ["m-1"]
    store._db.execute("CREATE TRIGGER no_filing BEFORE INSERT ON filing BEGIN SELECT RAISE(ABORT, 'full'); END")
    with pytest.raises(StorageError, match="full"):
        store.add_measurement({"id": "m-3"}, replace(RECORDING, id="r-3"), exam_id=exam["id"])
    assert [one["id"] for one in store.measurements(before_seq=9, limit=9)] == ["m-2", "m-1"]
    assert not (store.folder / "recordings" / "r-3.zip").exists()


def test_a_request_that_is_obeyed_once_has_its_first_answer_after_a_restart_too(tmp_path):
    once, answer = AskedOnce("k-1", "POST presses {}"), job("p-1", "waiting")
    first = Store(tmp_path)
    assert first.answer_to(once) is None
    first.save_press(answer, once)
    first.save_press(job("p-1", "done"))
    first.close()
    second = Store(tmp_path)
    assert second.answer_to(once) == answer
    assert second.press("p-1")["state"] == "done"
    second.close()


def test_a_key_that_came_with_another_request_is_refused_by_its_name(store):
    store.save_press(job("p-1", "waiting"), AskedOnce("k-1", "POST presses {}"))
    with pytest.raises(ReusedKey, match="'k-1' was sent before with another request") as refusal:
        store.answer_to(AskedOnce("k-1", 'POST presses {"mode": "quick"}'))
    assert (refusal.value.code, refusal.value.status) == ("E810", 409)


def test_a_press_whose_key_is_taken_is_not_kept(store):
    """One transaction: neither is there without the other."""
    once = AskedOnce("k-1", "POST presses {}")
    store.save_press(job("p-1", "waiting"), once)
    with pytest.raises(StorageError):
        store.save_press(job("p-2", "waiting"), once)
    with pytest.raises(UnknownResource):
        store.press("p-2")
    assert store.answer_to(once)["id"] == "p-1"


@pytest.mark.parametrize("ask", ["measurement", "press"])
def test_an_unknown_id_is_refused(store, ask):
    with pytest.raises(UnknownResource, match=f"There is no {ask} none") as refusal:
        getattr(store, ask)("none")
    assert (refusal.value.code, refusal.value.status) == ("E802", 404)


def test_an_id_is_only_ever_a_value_never_part_of_a_query(store):
    with pytest.raises(UnknownResource):
        store.measurement("x' OR '1'='1")


def test_the_state_of_a_press_is_replaced_by_the_newer(store):
    store.save_press(job("p-1", "capturing"))
    store.save_press(job("p-1", "done"))
    assert store.press("p-1")["state"] == "done"


@pytest.mark.parametrize("state", ["waiting", "capturing", "computing"])
def test_a_press_that_a_restart_interrupted_has_failed_at_the_next_opening(tmp_path, state):
    first = Store(tmp_path)
    first.save_press(job("p-1", state))
    first.close()
    second = Store(tmp_path)
    found = second.press("p-1")
    second.close()
    assert found["state"] == "failed"
    assert found["reason"] == "The daemon was restarted during the press: press again."


@pytest.mark.parametrize("state", ["done", "rejected", "cancelled", "failed"])
def test_a_press_that_had_ended_stays_as_it_ended(tmp_path, state):
    first = Store(tmp_path)
    first.save_press(job("p-1", state))
    first.close()
    second = Store(tmp_path)
    assert second.press("p-1") == job("p-1", state)
    second.close()


def test_commits_survive_a_power_cut(store):
    """FULL is 2: every commit is on the disk before it is acknowledged."""
    with sqlite3.connect(store.folder / "tsis.sqlite") as other:
        assert other.execute("PRAGMA journal_mode").fetchone() == ("wal",)
    other.close()
    assert store._db.execute("PRAGMA synchronous").fetchone() == (2,)


def test_a_folder_that_cannot_be_made_is_a_storage_error_with_its_path(tmp_path):
    (tmp_path / "var").write_text("a file is in the way")
    with pytest.raises(StorageError, match="var cannot be opened") as refusal:
        Store(tmp_path / "var")
    assert refusal.value.code == "E601"
    assert "`data`" in refusal.value.remedy


def test_a_damaged_database_is_a_storage_error_and_is_left_as_it_is(tmp_path):
    (tmp_path / "tsis.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises(StorageError, match="cannot be opened"):
        Store(tmp_path)
    assert (tmp_path / "tsis.sqlite").read_bytes().startswith(b"no database")


def test_a_store_that_could_not_be_opened_does_not_keep_the_folder(tmp_path):
    (tmp_path / "tsis.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises(StorageError) as refusal:
        Store(tmp_path)
    (tmp_path / "tsis.sqlite").unlink()
    Store(tmp_path).close()
    assert "cannot be opened" in refusal.value.cause


class BrokenDisk:
    """Takes nothing, and says why with an error number; has 30 MB left."""

    def __init__(self, number):
        self.number = number

    def free_bytes(self, folder):
        return 30_000_000

    def file(self, path):
        raise OSError(self.number, os.strerror(self.number))


@pytest.mark.parametrize(
    ("number", "kind", "code"), [(errno.ENOSPC, DiskFullError, "E602"), (errno.EIO, StorageError, "E601")]
)
def test_a_recording_that_cannot_be_written_leaves_no_row_and_no_file(tmp_path, number, kind, code):
    store = Store(tmp_path, BrokenDisk(number))
    with pytest.raises(kind, match=os.strerror(number)) as refusal:
        add(store, 1)
    assert refusal.value.code == code
    assert store.measurements(before_seq=2**62, limit=9) == []
    assert list((store.folder / "recordings").iterdir()) == []
    store.close()


def test_a_recording_that_cannot_be_read_back_leaves_no_row_and_no_file(tmp_path, monkeypatch):
    store = Store(tmp_path)

    def failing(path):
        raise OSError(errno.EIO, os.strerror(errno.EIO), str(path))

    monkeypatch.setattr("device.records.store.fingerprint_of", failing)
    with pytest.raises(StorageError, match="cannot be read back"):
        add(store, 1)
    assert store.measurements(before_seq=2**62, limit=9) == []
    assert list((store.folder / "recordings").iterdir()) == []
    store.close()


def test_less_space_than_asked_for_is_a_full_disk_with_both_numbers(tmp_path):
    store = Store(tmp_path, BrokenDisk(errno.EIO))
    store.require_space(30.0)
    with pytest.raises(DiskFullError, match="has 30 MB left, below 31 MB"):
        store.require_space(31.0)
    store.close()


def test_space_that_nobody_can_tell_is_no_space(store):
    store.folder = store.folder / "gone"
    with pytest.raises(StorageError, match="is gone"):
        store.require_space(1.0)


def test_a_database_that_cannot_grow_is_a_full_disk(store):
    """SQLite's own SQLITE_FULL: the database may not have one page more than it has."""
    store._db.execute("PRAGMA max_page_count = 1")
    with pytest.raises(DiskFullError, match="full") as refusal:
        store.save_press(job("p-1", "done") | {"reason": "x" * 100_000})
    assert refusal.value.code == "E602"


def test_a_recording_that_is_kept_already_is_not_lost_to_a_second_of_its_id(store):
    add(store, 1)
    with pytest.raises(StorageError):
        store.add_measurement({"id": "m-2"}, RECORDING)
    assert len(read_recording(store.recording_path("r-1")).frames) == 2
    assert [m["id"] for m in store.measurements(before_seq=2**62, limit=9)] == ["m-1"]


def test_a_row_that_the_database_does_not_take_is_a_storage_error(store):
    add(store, 1)
    with pytest.raises(StorageError, match="did not take the record"):
        store.add_measurement({"id": "m-1"}, replace(RECORDING, id="r-2"))
    assert store.measurement("m-1")["seq"] == 1
    assert [path.name for path in (store.folder / "recordings").iterdir()] == ["r-1.zip"]


def test_a_second_daemon_on_the_same_folder_is_refused_and_ends_no_press(store):
    store.save_press(job("p-1", "capturing"))
    with pytest.raises(StorageError, match="in use by another daemon"):
        Store(store.folder)
    assert store.press("p-1")["state"] == "capturing"


def test_the_folder_is_free_again_once_its_daemon_has_closed(tmp_path):
    for _ in range(2):
        Store(tmp_path).close()


def test_what_a_power_cut_left_half_written_is_gone_at_the_next_opening(tmp_path):
    Store(tmp_path).close()
    (tmp_path / "recordings" / "r-8.tmp" / "frames").mkdir(parents=True)
    (tmp_path / "recordings" / "r-9.zip.tmp").write_bytes(b"PK half of it")
    Store(tmp_path).close()
    assert list((tmp_path / "recordings").iterdir()) == []


def test_a_recording_that_has_gone_missing_is_a_storage_error_with_its_id(store):
    add(store, 1)
    store.recording_path("r-1").unlink()
    with pytest.raises(DamagedRecordingError, match="r-1 is missing"):
        store.recording_path("r-1")


def test_the_hours_of_light_add_up_over_restarts(tmp_path):
    for kept_s in (0.0, 2.5):
        store = Store(tmp_path)
        assert store.light_on_s == kept_s
        store.add_light_on_s(1.0)
        store.add_light_on_s(1.5)
        store.close()


def test_a_store_proves_itself_by_reading_and_when_asked_by_a_durable_write(store):
    journal = store.folder / "tsis.sqlite-wal"
    store.prove(writing=False)
    before_bytes = journal.stat().st_size
    store.prove(writing=False)
    assert journal.stat().st_size == before_bytes
    store.prove(writing=True)
    assert journal.stat().st_size > before_bytes


def test_a_disk_that_became_read_only_is_told_without_a_write(store, monkeypatch):
    """As the kernel remounts a failing card."""
    read_only = types.SimpleNamespace(f_flag=os.ST_RDONLY)
    monkeypatch.setattr(os, "statvfs", lambda _: read_only)
    with pytest.raises(StorageError, match="can only be read"):
        store.prove(writing=False)
