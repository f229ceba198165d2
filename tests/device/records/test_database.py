"""A database with a bad page is told and left as it is, and what can be read of it is shown."""

import os
import sqlite3
from contextlib import closing
from dataclasses import replace

import pytest
from probe_card import RECORDING, add_measurement

from device.errors import DamagedStoreError, StorageError
from device.records import database
from device.records.exams import ExamContent
from device.records.store import Store

PAGE = 4096
MANY = 15


@pytest.fixture
def folder(tmp_path):
    """A data folder whose table of measurements has many pages, all of them in the file itself."""
    store = Store(tmp_path)
    for number in range(1, MANY + 1):
        add_measurement(store, number)
        record = {"id": f"x-{number}", "recording_id": f"s-{number}", "note": "long " * 200}
        store.add_measurement(record, replace(RECORDING, id=f"s-{number}"))
    store.exams.make(ExamContent(kind="phantom", operator="Ada"))
    store.close()
    return tmp_path


def pages_of(folder, table):
    """Return the numbers of the leaf pages of a table, from SQLite's own statistics where it has them."""
    with closing(sqlite3.connect(folder / "tsis.sqlite")) as db:
        [(root,)] = db.execute("SELECT rootpage FROM sqlite_master WHERE name = ?", (table,))
    whole = (folder / "tsis.sqlite").read_bytes()
    kind = whole[(root - 1) * PAGE]
    assert kind == 5, "an interior page of a table"  # https://www.sqlite.org/fileformat2.html#b_tree_pages
    count = int.from_bytes(whole[(root - 1) * PAGE + 3 : (root - 1) * PAGE + 5], "big")
    cells = [(root - 1) * PAGE + 12 + 2 * i for i in range(count)]
    offsets = [(root - 1) * PAGE + int.from_bytes(whole[at : at + 2], "big") for at in cells]
    return [int.from_bytes(whole[at : at + 4], "big") for at in offsets]


def spoil(folder, page):
    with (folder / "tsis.sqlite").open("r+b") as file:
        file.seek((page - 1) * PAGE)
        file.write(os.urandom(PAGE))


def test_a_page_of_random_bytes_is_told_and_all_other_rows_are_shown(folder):
    pages = pages_of(folder, "measurement")
    spoil(folder, pages[len(pages) // 2])
    before = (folder / "tsis.sqlite").read_bytes()
    store = Store(folder)
    with pytest.raises(DamagedStoreError, match=r"tsis\.sqlite is damaged") as fault:
        store.require_space(1.0)
    assert (fault.value.code, "restore" in fault.value.remedy) == ("E603", True)
    shown = store.measurements(before_seq=2**62, limit=999)
    assert 2 * MANY - 8 <= len(shown) < 2 * MANY
    assert {one["seq"] for one in shown} >= {1, 2 * MANY}
    assert store.measurement(shown[0]["id"]) == shown[0]
    assert store.recording_path(shown[0]["recording_id"]).is_file()
    assert len(store.exams.exams(kind="phantom", before_seq=9, limit=9)) == 1
    store.close()
    assert (folder / "tsis.sqlite").read_bytes() == before


def test_one_number_of_two_issuers_stays_two_patients_in_a_damaged_database_of_the_release_before(folder):
    store = Store(folder)
    for issuer in ("HOSP", "OTHER"):
        order = {"study_uid": "1.2", "patient_ref": "4711", "order_number": ""}
        keep = lambda db, exam_id: store.outbox.order(db, exam_id, order, {"issuer": issuer}, "")  # noqa: B023, E731
        store.exams.make(ExamContent(kind="patient", patient_ref="4711", operator="Ada"), None, keep, issuer)
    store.close()
    with closing(sqlite3.connect(folder / "tsis.sqlite")) as db:
        db.executescript("DROP TABLE patient_issuer; DROP TABLE scheduled;")
    spoil(folder, pages_of(folder, "measurement")[1])
    store = Store(folder)
    found = store.exams.exams(kind="patient", before_seq=99, limit=9)
    assert [exam["patient_issuer"] for exam in found] == ["OTHER", "HOSP"]
    store.close()


@pytest.mark.parametrize(
    "write",
    [
        lambda store: add_measurement(store, 999),
        lambda store: store.save_press({"id": "p-999", "state": "done"}),
        lambda store: store.add_light_on_s(1.0),
        lambda store: store.exams.make(ExamContent(kind="phantom", operator="Ada")),
        lambda store: store.prove(writing=True),
    ],
    ids=["measurement", "press", "light", "exam", "proof"],
)
def test_nothing_is_written_to_a_damaged_database_or_beside_it(folder, write):
    spoil(folder, pages_of(folder, "measurement")[1])
    store = Store(folder)
    kept = sorted((folder / "recordings").iterdir())
    with pytest.raises(DamagedStoreError):
        write(store)
    assert sorted((folder / "recordings").iterdir()) == kept
    store.close()


def test_recordings_of_rows_that_cannot_be_read_stay_where_they_are(folder):
    spoil(folder, pages_of(folder, "measurement")[1])
    Store(folder).close()
    assert len(list((folder / "recordings").iterdir())) == 2 * MANY
    assert not (folder / "orphans").exists()


def test_a_press_that_was_broken_off_is_told_also_of_a_damaged_database(folder):
    store = Store(folder)
    store.save_press({"id": "p-1000", "state": "capturing"})
    store.close()
    spoil(folder, pages_of(folder, "measurement")[1])
    store = Store(folder)
    assert [(job["state"], job["light_on_s"]) for job in store.interrupted] == [("failed", None)]
    store.close()


def test_what_keeps_rows_over_a_power_cut_is_read_back(tmp_path, monkeypatch):
    store = Store(tmp_path)
    found = {name: store._db.execute(f"PRAGMA {name}").fetchone()[0] for name in database.DURABLE}
    store.close()
    assert found == {"journal_mode": "wal", "synchronous": 2, "cell_size_check": 1, "secure_delete": 1}
    monkeypatch.setattr(database, "SET", {**database.SET, "synchronous": "NORMAL"})
    with pytest.raises(StorageError, match="synchronous in .* is 1, but must be 2") as refusal:
        Store(tmp_path)
    assert "`data`" in refusal.value.remedy
