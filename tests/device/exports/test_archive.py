"""An archive of recordings is whole for those who unpack it, is never held, and says what it had to leave out."""

import csv
import io
import zipfile

import numpy as np
import pytest
from kept_measurements import keep

from device.exports.archive import PIECE_BYTES, archive_of
from device.exports.selection import Selection
from device.files.recording_file import read_recording, write_recording
from device.records import store as records
from device.records.store import Store


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path / "var")
    yield opened
    opened.close()


def archive(store):
    opened = zipfile.ZipFile(io.BytesIO(b"".join(archive_of(store, Selection(store)))))
    assert opened.testzip() is None
    return opened


def table(opened, name):
    return list(csv.DictReader(io.StringIO(opened.read(name).decode(), newline="")))


def test_it_holds_the_table_and_every_recording_byte_by_byte(store, tmp_path):
    for number in (1, 2):
        keep(store, number, picture=b"png")
    with archive(store) as opened:
        assert opened.namelist() == ["measurements.csv", "recordings/r-2.zip", "recordings/r-1.zip", "missing.csv"]
        for number in (1, 2):
            assert opened.read(f"recordings/r-{number}.zip") == store.recording_path(f"r-{number}").read_bytes()
        assert [row["recording_id"] for row in table(opened, "measurements.csv")] == ["r-2", "r-1"]
        assert table(opened, "missing.csv") == []


def test_a_folder_of_an_earlier_release_is_in_it_and_can_be_read(store, tmp_path, monkeypatch):
    monkeypatch.setattr(records, "note_kept", lambda *of_it: None)  # it kept no sums
    keep(store, 1)
    path = store.recording_path("r-1")
    kept = read_recording(path)
    write_recording(kept, path.with_suffix(""))
    path.unlink()
    with archive(store) as opened:
        opened.extractall(tmp_path / "unpacked")
    unpacked = read_recording(tmp_path / "unpacked" / "recordings" / "r-1")
    np.testing.assert_array_equal(unpacked.frames[0].counts, kept.frames[0].counts)


def test_a_recording_that_is_gone_is_named_and_the_others_are_there(store):
    for number in (1, 2, 3):
        keep(store, number)
    store.recording_path("r-2").unlink()
    with archive(store) as opened:
        assert [name for name in opened.namelist() if name.startswith("recordings/")] == [
            "recordings/r-3.zip", "recordings/r-1.zip"
        ]  # fmt: skip
        [missing] = table(opened, "missing.csv")
    assert (missing["measurement_id"], missing["recording_id"]) == ("m-2", "r-2")
    assert "r-2" in missing["why"]


def test_no_piece_is_larger_than_a_part_of_a_recording(store):
    keep(store, 1, picture=bytes(5 * PIECE_BYTES))
    pieces = list(archive_of(store, Selection(store)))
    assert max(map(len, pieces)) < 1.1 * PIECE_BYTES
    assert sum(map(len, pieces)) > 5 * PIECE_BYTES


def test_a_client_that_goes_leaves_no_file_open(store):
    keep(store, 1, picture=bytes(5 * PIECE_BYTES))
    sending = archive_of(store, Selection(store))
    next(sending)
    sending.close()
    assert store.recording_path("r-1").is_file()
