"""The database as it is opened: what was asked of SQLite is read back, and what it holds is looked through.

A database that is damaged is left as it is. What can still be read of it is copied into memory, row by row, and that is
shown, so that nobody loses all measurements to one bad page; nothing is written to it any more.
Sources: SQLite, "PRAGMA quick_check" and "PRAGMA synchronous": with NORMAL the last acknowledged row may be gone after
a power cut (in 15 cuts 1 779 of 2 309 were).
"""

from __future__ import annotations

import json
import logging
import sqlite3
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from pathlib import Path

from device.errors import DamagedStoreError, NewerDataError, StorageError
from device.records.listing import INDEXES
from device.records.migrations import add_beside, bring_forward, form_of, is_whole
from device.records.schema import STORE_READS, STORE_WRITES, UNNUMBERED, store_schema

log = logging.getLogger(__name__)
DATABASE = "tsis.sqlite"
DURABLE = {"journal_mode": "wal", "synchronous": 2, "cell_size_check": 1, "secure_delete": 1}
"""What keeps acknowledged rows over a power cut, finds a bad page when it is read, and overwrites what is erased; 2 is
FULL."""
SET = {"journal_mode": "WAL", "synchronous": "FULL", "cell_size_check": "ON", "secure_delete": "ON"}
SALVAGED = (
    "measurement", "press", "counter", "exam", "filing", "audit", "asked_once", "token", "kept_recording", "outbox",
    "ordered_study", "patient_issuer", "scheduled",
)  # fmt: skip
BUSY_S = 10.0
MOST_MISSED = 10_000
"""So many numbers of rows in a row may be unreadable before the rest of a table is given up."""
MENDING = (
    "Stop the daemon, move the data folder away whole, to another medium, and restore the last backup: "
    "python -m device restore FILE."
)


@dataclass(frozen=True)
class OpenedDatabase:
    """A connection that any thread may use, and the fault when it is only what could be read of a damaged one."""

    connection: sqlite3.Connection
    damage: DamagedStoreError | None = None


def open_database(folder: Path) -> OpenedDatabase:
    """Open or create the database of a data folder and bring it to the present form.

    Raises `NewerDataError` when a newer release wrote it, before anything in it is changed; `StorageError` when SQLite
    does not do what keeps rows durable; `sqlite3.Error` when it is no database, or the disk refuses it.
    """
    with ExitStack() as opened:
        db = sqlite3.connect(folder / DATABASE, check_same_thread=False)
        opened.enter_context(closing(db))
        _require_readable(db, folder)
        if damage := _damage(db, folder):
            log.error("%s %s", damage.code, damage)
            return OpenedDatabase(_salvaged(db), damage)
        _make_durable(db, folder)
        bring_forward(db)
        _index(db)
        _number_in_file(db, folder)
        opened.pop_all()
    return OpenedDatabase(db)


def open_to_read(folder: Path) -> OpenedDatabase:
    """Open the database of a data folder without changing anything, also beside a daemon.

    Raises as `open_database`, and `StorageError` for one of an older form, which a start brings forward.
    """
    with ExitStack() as opened:
        address = f"{(folder / DATABASE).resolve().as_uri()}?mode=ro"
        db = sqlite3.connect(address, uri=True, timeout=BUSY_S, check_same_thread=False)
        opened.enter_context(closing(db))
        _require_readable(db, folder)
        if damage := _damage(db, folder):
            return OpenedDatabase(_salvaged(db), damage)
        if form_of(db) != STORE_WRITES or not is_whole(db):
            raise StorageError(f"The database in {folder} is of an older release.", "Start the daemon once.")
        opened.pop_all()
    return OpenedDatabase(db)


def _require_readable(db: sqlite3.Connection, folder: Path) -> None:
    """Raise `NewerDataError` when this release does not know the database's form."""
    form = form_of(db) or UNNUMBERED
    if form not in STORE_READS:
        known = " and ".join(map(str, STORE_READS))
        cause = f"The measurements in {folder} have schema {form}, and this release reads {known}."
        raise NewerDataError(cause, "Install the newer release again.")


def _make_durable(db: sqlite3.Connection, folder: Path) -> None:
    """Ask SQLite for what keeps rows over a power cut, and read back that it does so; raise `StorageError` if not."""
    for name, wanted in DURABLE.items():
        db.execute(f"PRAGMA {name} = {SET[name]}")
        [found] = db.execute(f"PRAGMA {name}").fetchone()
        if found != wanted:
            cause = f"SQLite's {name} in {folder} is {found!r}, but must be {wanted!r}: rows could be lost."
            raise StorageError(cause, "Let the setting `data` name a folder of the probe's own disk.")


def _damage(db: sqlite3.Connection, folder: Path) -> DamagedStoreError | None:
    """Return what is wrong with the pages of a database, if anything; raise `sqlite3.Error` when it is none at all."""
    db.execute("SELECT count(*) FROM sqlite_master").fetchone()
    try:
        found = [str(row[0]) for row in db.execute("PRAGMA quick_check(3)")]
    except sqlite3.DatabaseError as error:
        found = [str(error)]
    if found == ["ok"]:
        return None
    told = "; ".join(" ".join(one.split()) for one in found)
    return DamagedStoreError(f"The database {folder / DATABASE} is damaged: {told}.", MENDING)


def _salvaged(db: sqlite3.Connection) -> sqlite3.Connection:
    """Return a database in memory with every row that can still be read; it takes no other."""
    kept = sqlite3.connect(":memory:", check_same_thread=False)
    bring_forward(kept)
    for table in SALVAGED:
        rows = list(_readable_rows(db, table))
        for row in rows:
            columns, places = ", ".join(row), ", ".join("?" * len(row))
            kept.execute(f"INSERT OR IGNORE INTO {table} ({columns}) VALUES ({places})", tuple(row.values()))
        log.warning("of the damaged database's table %s %d rows were read", table, len(rows))
    add_beside(kept)  # of the rows that were read
    kept.commit()
    kept.execute("PRAGMA query_only = ON")
    return kept


def _readable_rows(db: sqlite3.Connection, table: str) -> Iterator[dict[str, object]]:
    """Yield the rows of a table by their numbers; those on a bad page are left out."""
    last, missed = 0, 0
    while missed < MOST_MISSED:
        try:
            found = db.execute(f"SELECT rowid, * FROM {table} WHERE rowid > ? ORDER BY rowid LIMIT 1", (last,))
            row = found.fetchone()
        except sqlite3.DatabaseError as error:
            if isinstance(error, sqlite3.OperationalError) and "no such table" in str(error):
                return
            last, missed = last + 1, missed + 1
            continue
        if row is None:
            return
        last, missed = row[0], 0
        named = dict(zip((column[0] for column in found.description[1:]), row[1:], strict=True))
        if _is_sound(named.get("record", "{}")):
            yield named


def _is_sound(record: object) -> bool:
    """Return whether a record is one: a bad page may read as anything."""
    try:
        return isinstance(record, str) and isinstance(json.loads(record), dict)
    except ValueError:
        return False


def _index(db: sqlite3.Connection) -> None:
    """Make what lists are looked up by, where it is missing; without it they are slower, and all else is the same."""
    try:
        db.executescript(INDEXES)
    except sqlite3.Error as error:  # as on a full disk, which must not keep the probe from starting
        log.warning("lists are slow without their indexes: %s", error)


def _number_in_file(db: sqlite3.Connection, folder: Path) -> None:
    """Bring the number of the form into the file itself, where an update reads it, and not only into its log."""
    if store_schema(folder / DATABASE) != STORE_WRITES:
        db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
