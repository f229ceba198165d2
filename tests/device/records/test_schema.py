"""The number of the store's form: written where an update reads it, and refused when it is a newer release's."""

import sqlite3
import subprocess
import sys
from contextlib import closing

import pytest
from daemon_process import ROOT

from device.errors import NewerDataError, StorageError
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


def test_what_a_newer_release_wrote_is_refused_and_left_as_it_is(tmp_path):
    file = database(tmp_path, max(STORE_READS) + 1)
    (tmp_path / "recordings").mkdir()
    (tmp_path / "recordings" / "half.tmp").mkdir()
    before = file.read_bytes()
    with pytest.raises(NewerDataError, match=r"have schema 3, and this release reads 1 and 2\.") as refusal:
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
