"""The number of the store's form: written where an update reads it, and refused when it is a newer release's."""

import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest
from daemon_process import ROOT

from device.errors import NewerDataError, StorageError
from device.records.asked_once import AskedOnce
from device.records.exams import EXAM_TABLES, ExamContent
from device.records.schema import STORE_READS, STORE_WRITES, store_schema
from device.records.store import Store


def database(folder, form):
    """What another release has left."""
    folder.mkdir(exist_ok=True)
    with closing(sqlite3.connect(folder / "tsis.sqlite")) as db:
        db.execute("PRAGMA journal_mode = WAL")
        db.execute("CREATE TABLE measurement (seq INTEGER PRIMARY KEY)")
        db.execute(f"PRAGMA user_version = {form}")
    return folder / "tsis.sqlite"


def test_a_new_store_has_the_number_of_its_form_in_the_file_while_it_is_open(tmp_path):
    store = Store(tmp_path)
    assert store_schema(tmp_path / "tsis.sqlite") == STORE_WRITES
    store.save_press({"id": "p-1", "state": "done"})
    assert store_schema(tmp_path / "tsis.sqlite") == STORE_WRITES
    store.close()


def test_a_database_from_before_there_were_numbers_is_of_the_first_form_and_gets_its_number(tmp_path):
    store = Store(tmp_path)
    store.save_press({"id": "p-1", "state": "done"})
    store._db.execute("PRAGMA user_version = 0")
    store.close()
    assert store_schema(tmp_path / "tsis.sqlite") == 1
    again = Store(tmp_path)
    assert again.press("p-1")["state"] == "done"
    assert again._db.execute("PRAGMA user_version").fetchone() == (STORE_WRITES,)
    again.close()


TABLES_OF_3 = """
CREATE TABLE measurement (seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT UNIQUE NOT NULL, record TEXT NOT NULL);
CREATE TABLE press (id TEXT PRIMARY KEY, ended INTEGER NOT NULL, record TEXT NOT NULL);
CREATE TABLE counter (name TEXT PRIMARY KEY, value REAL NOT NULL);
INSERT INTO measurement VALUES (7, 'm-7', '{"id": "m-7", "seq": 7, "recording_id": "r-7"}');
INSERT INTO press VALUES ('p-7', 1, '{"id": "p-7", "state": "done", "measurement_id": "m-7"}');
INSERT INTO counter VALUES ('light_on_s', 12.5);
"""
"""What releases of the forms 1 to 3 have left: the tables were the same."""


@pytest.mark.parametrize("form", [0, 1, 2, 3])
def test_what_an_older_release_wrote_is_read_whole_and_brought_to_the_new_form(tmp_path, form):
    with closing(sqlite3.connect(tmp_path / "tsis.sqlite")) as db:
        db.executescript(TABLES_OF_3)
        db.execute(f"PRAGMA user_version = {form}")
    store = Store(tmp_path)
    assert store_schema(tmp_path / "tsis.sqlite") == STORE_WRITES
    unfiled = {"exam_id": None, "voided": None, "version": 1}
    assert store.measurement("m-7") == {"id": "m-7", "seq": 7, "recording_id": "r-7"} | unfiled
    assert store.press("p-7") == {"id": "p-7", "state": "done", "measurement_id": "m-7"}
    assert store.light_on_s == 12.5
    once = AskedOnce("k-1", "POST presses {}")
    store.save_press({"id": "p-8", "state": "waiting"}, once)
    assert store.answer_to(once) == {"id": "p-8", "state": "waiting"}
    exam = store.exams.make(ExamContent(kind="patient", patient_ref="A-1", operator="Ada"))
    store.exams.move("m-7", exam["id"], version=1, by="Ada", reason="From before there were exams")
    assert store.measurement("m-7")["exam_id"] == exam["id"]
    store.close()


def test_a_conversion_that_a_power_cut_broke_off_is_done_again(tmp_path):
    """Tables first, the number last: until then it is a database of the older form with a table more."""
    with closing(sqlite3.connect(tmp_path / "tsis.sqlite")) as db:
        db.executescript(TABLES_OF_3 + EXAM_TABLES.split(";")[0] + "; PRAGMA user_version = 3;")
    store = Store(tmp_path)
    assert store_schema(tmp_path / "tsis.sqlite") == STORE_WRITES
    assert store.exams.make(ExamContent(kind="phantom", operator="Ada"))["seq"] == 1
    assert store.press("p-7")["state"] == "done"
    store.close()


def test_what_a_newer_release_wrote_is_refused_and_left_as_it_is(tmp_path):
    file = database(tmp_path, max(STORE_READS) + 1)
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "half.tmp").mkdir()
    before = file.read_bytes()
    with pytest.raises(
        NewerDataError,
        match=rf"have schema {max(STORE_READS) + 1}, and this release reads 1 .* and {max(STORE_READS)}\.",
    ) as refusal:
        Store(tmp_path)
    assert (refusal.value.code, isinstance(refusal.value, StorageError)) == ("E014", True)
    assert file.read_bytes() == before
    assert (tmp_path / "recordings" / "half.tmp").is_dir()


def test_a_release_reads_what_it_writes():
    assert STORE_WRITES in STORE_READS


@pytest.mark.parametrize("content", [b"", b"SQLite format 3\0", b"\0" * 200])
def test_what_is_no_database_has_no_form(tmp_path, content):
    assert store_schema(tmp_path / "none") is None
    (tmp_path / "tsis.sqlite").write_bytes(content)
    assert store_schema(tmp_path / "tsis.sqlite") is None


def test_the_builder_of_a_manifest_reads_the_numbers_without_the_daemons_packages():
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from device.records.schema import *; print(STORE_WRITES)"
    done = subprocess.run([sys.executable, "-I", "-S", "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == f"{STORE_WRITES}\n"
