"""Every form that a store ever had is brought to the present one, also when the power fails in between."""

import json
import sqlite3
from contextlib import closing

import pytest

from device.errors import StorageError
from device.records import migrations
from device.records.audit import AUDIT_GUARDS, FIRST, chained
from device.records.exams import EXAM_TABLES
from device.records.manifest import MANIFEST_TABLE
from device.records.migrations import bring_forward, form_of
from device.records.outbox import OUTBOX_TABLES
from device.records.schema import STORE_READS, STORE_WRITES
from device.records.store import Store
from device.records.tokens import TOKENS_TABLE

TABLES_OF_1_TO_3 = """
CREATE TABLE measurement (seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT UNIQUE NOT NULL, record TEXT NOT NULL);
CREATE TABLE press (id TEXT PRIMARY KEY, ended INTEGER NOT NULL, record TEXT NOT NULL);
CREATE TABLE counter (name TEXT PRIMARY KEY, value REAL NOT NULL);
INSERT INTO measurement VALUES (7, 'm-7', '{"id": "m-7", "seq": 7, "recording_id": "r-7", "mode": "quick"}');
INSERT INTO press VALUES ('p-7', 1, '{"id": "p-7", "state": "done", "measurement_id": "m-7"}');
INSERT INTO counter VALUES ('light_on_s', 12.5);
"""
OF_4 = """
CREATE TABLE asked_once (key TEXT PRIMARY KEY, request TEXT NOT NULL, answer TEXT NOT NULL);
INSERT INTO asked_once VALUES ('k-7', 'POST presses {}', '{"id": "p-7"}');
"""
AUDIT_OF_4 = "CREATE TABLE audit (seq INTEGER PRIMARY KEY AUTOINCREMENT, subject TEXT NOT NULL, record TEXT NOT NULL);"
ENTRY = {"seq": 1, "what": "measurement_moved", "subject": "m-7"}
ROWS_OF_4 = f"""
{AUDIT_OF_4}
INSERT INTO exam VALUES (3, 'e-3', 1, '{{"id": "e-3", "seq": 3, "version": 1, "kind": "phantom"}}');
INSERT INTO filing VALUES ('m-7', 'e-3', NULL, 2);
INSERT INTO audit VALUES (1, 'm-7', '{{"what": "measurement_moved", "subject": "m-7"}}');
"""
WHOLE_4 = TABLES_OF_1_TO_3 + OF_4 + EXAM_TABLES + ROWS_OF_4
OF_5 = f"""
{TOKENS_TABLE}
ALTER TABLE audit ADD COLUMN hash TEXT;
UPDATE audit SET hash = '{chained(FIRST, ENTRY)}';
{AUDIT_GUARDS}
"""
EXAM_OF_7 = 'INSERT INTO exam VALUES ({0}, \'e-{0}\', 1, \'{{"id": "e-{0}", "version": 1, "patient_ref": "{1}"}}\');'
ORDER_OF_7 = 'INSERT INTO ordered_study VALUES (\'e-{0}\', \'{{"study_uid": "1.{0}", "patient_ref": "4711"}}\', {1});'
OF_HOSP, OF_NOBODY = """'{"name": "A", "issuer": "HOSP"}'""", """'{"name": "B", "issuer": ""}'"""
EXAMS_OF_7 = "".join(
    EXAM_OF_7.format(number, patient_ref) + ORDER_OF_7.format(number, patient)
    for number, patient_ref, patient in (
        (4, "4711", OF_HOSP), (5, "0815", OF_HOSP), (6, "4711", "NULL"), (7, "4711", OF_NOBODY),
    )
)  # fmt: skip
"""Exams of the worklist: as ordered, corrected to another patient since, erased, and of a worklist without issuers."""
LEFT_BEHIND = dict.fromkeys((0, 1, 2, 3), TABLES_OF_1_TO_3) | {
    4: WHOLE_4,
    5: WHOLE_4 + OF_5,
    6: WHOLE_4 + OF_5 + MANIFEST_TABLE,
}
"""What a release of each form has left; 0 is 1 without its number."""
WITHOUT_ADDITIONS = WHOLE_4 + OF_5 + MANIFEST_TABLE + OUTBOX_TABLES + EXAMS_OF_7
"""What a release of the present form has left that had no additions yet."""
ASKED_BY_OLDER = {
    1: ("SELECT seq, record FROM measurement WHERE id = 'm-7'", "SELECT ended, record FROM press WHERE id = 'p-7'"),
    4: (
        "SELECT record, exam_id, voided, version FROM measurement LEFT JOIN filing ON measurement_id = id",
        "SELECT request, answer FROM asked_once WHERE key = 'k-7'",
        "SELECT record FROM exam WHERE id = 'e-3'",
        "SELECT seq, record FROM audit WHERE subject = 'm-7'",
    ),
}
"""What the release of a form asks its database for; 2 and 3 ask as 1."""


def left_behind(path, form):
    db = sqlite3.connect(path)
    db.executescript(f"{LEFT_BEHIND.get(form, WITHOUT_ADDITIONS)} PRAGMA user_version = {form};")
    return db


def test_every_older_form_is_tried_here():
    assert {form or 1 for form in LEFT_BEHIND} == set(STORE_READS) - {STORE_WRITES}


@pytest.mark.parametrize("form", sorted(LEFT_BEHIND))
def test_an_older_form_is_read_whole_and_goes_on(tmp_path, form):
    left_behind(tmp_path / "tsis.sqlite", form).close()
    store = Store(tmp_path)
    found = store.measurement("m-7")
    assert (found["seq"], found["recording_id"]) == (7, "r-7")
    assert (found["exam_id"], found["version"]) == (("e-3", 2) if form >= 4 else (None, 1))
    assert store.press("p-7")["measurement_id"] == "m-7"
    assert store.light_on_s == 12.5
    assert [entry["subject"] for entry in store.audit.entries(before_seq=99, limit=9)] == ["m-7"] * (form >= 4)
    assert store.audit.warning() is None
    assert store.recordings.unnoted() == ["r-7"]
    store.close()


@pytest.mark.parametrize("form", sorted(LEFT_BEHIND))
def test_a_release_of_an_older_form_finds_in_the_new_one_what_it_left_there(tmp_path, form):
    """What came with a newer form lies beside: the rows can be had back with the older release's own queries."""
    with closing(left_behind(tmp_path / "tsis.sqlite", form)) as db:
        asked = [query for of, queries in ASKED_BY_OLDER.items() if of <= max(form, 1) for query in queries]
        before = [db.execute(query).fetchall() for query in asked]
        bring_forward(db)
        assert form_of(db) == STORE_WRITES
        assert [db.execute(query).fetchall() for query in asked] == before
    assert all(rows for rows in before)


def test_an_older_exam_has_the_issuer_that_its_order_named_as_long_as_it_is_of_that_patient(tmp_path):
    left_behind(tmp_path / "tsis.sqlite", STORE_WRITES).close()
    store = Store(tmp_path)
    issuers = {name: store.exams.exam(name)["patient_issuer"] for name in ("e-3", "e-4", "e-5", "e-6", "e-7")}
    assert issuers == {"e-3": None, "e-4": "HOSP", "e-5": None, "e-6": None, "e-7": None}
    store.close()


def test_the_release_before_goes_on_where_this_one_was_and_this_one_finds_what_it_wrote(tmp_path):
    """Its own statements, of which none names the columns: it was rolled back to, and updated once more."""
    left_behind(tmp_path / "tsis.sqlite", STORE_WRITES).close()
    Store(tmp_path).close()
    with closing(sqlite3.connect(tmp_path / "tsis.sqlite")) as db:
        assert form_of(db) == STORE_WRITES
        db.execute(
            "INSERT INTO exam (id, version, record) VALUES ('e-8', 1, ?)",
            ('{"id": "e-8", "version": 1, "patient_ref": "9"}',),
        )
        order = "e-8", '{"study_uid": "1.8", "patient_ref": "9"}', '{"name": "C", "issuer": "OTHER"}'
        db.execute("INSERT INTO ordered_study VALUES (?, ?, ?)", order)
        db.commit()
    store = Store(tmp_path)
    assert (store.exams.exam("e-8")["patient_issuer"], store.exams.exam("e-4")["patient_issuer"]) == ("OTHER", "HOSP")
    assert store.outbox.scheduled_at("e-8") == ""
    store.close()


def test_what_the_release_before_wrote_is_read_beside_nothing_until_a_start_has_added_what_it_lacks(tmp_path):
    left_behind(tmp_path / "tsis.sqlite", STORE_WRITES).close()
    (tmp_path / "recordings").mkdir()
    with pytest.raises(StorageError, match="of an older release"):
        Store(tmp_path, to_read=True)
    Store(tmp_path).close()
    Store(tmp_path, to_read=True).close()


@pytest.mark.parametrize("form", sorted(LEFT_BEHIND))
def test_a_step_that_breaks_off_leaves_the_form_before_it(tmp_path, monkeypatch, form):
    """One transaction a step: the number and the tables are there together or not at all."""
    torn = {STORE_WRITES: (*migrations.STEPS[STORE_WRITES], "SELECT no_such_function();")}
    with closing(left_behind(tmp_path / "tsis.sqlite", form)) as db:
        with monkeypatch.context() as patched:
            patched.setattr(migrations, "STEPS", {**migrations.STEPS, **torn})
            with pytest.raises(sqlite3.Error, match="no_such_function"):
                bring_forward(db)
            assert form_of(db) == STORE_WRITES - 1
            tables = {row[0] for row in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
            assert "outbox" not in tables
        bring_forward(db)
        assert form_of(db) == STORE_WRITES


def test_a_step_that_the_disk_refuses_is_a_storage_error_and_changes_nothing(tmp_path, monkeypatch):
    left_behind(tmp_path / "tsis.sqlite", 4).close()
    torn = {5: ("CREATE TABLE half (x);\nSELECT no_such_function();",)}
    monkeypatch.setattr(migrations, "STEPS", {**migrations.STEPS, **torn})
    with pytest.raises(StorageError, match="cannot be opened"):
        Store(tmp_path)
    with closing(sqlite3.connect(tmp_path / "tsis.sqlite")) as db:
        assert form_of(db) == 4
        assert json.loads(db.execute("SELECT record FROM exam").fetchone()[0])["id"] == "e-3"
        assert db.execute("SELECT count(*) FROM sqlite_master WHERE name = 'half'").fetchone() == (0,)
