"""A database of any form that this code reads to the form that it writes, one form after the other.

Each step is one transaction with the number of the form that it reaches: a power cut leaves the form before or the next
one, never something between. What the forms are is said in `schema`; every older one is made in the tests.
"""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Callable, Iterator
from types import MappingProxyType

from device.records.asked_once import ANSWERS_TABLE
from device.records.audit import AUDIT_GUARDS, AUDIT_TABLE, chain_older_audit
from device.records.exams import EXAM_TABLES, ISSUER_TABLE, ISSUERS_OF_ORDERS
from device.records.manifest import MANIFEST_TABLE
from device.records.outbox import OUTBOX_TABLES, SCHEDULED_TABLE
from device.records.schema import STORE_WRITES
from device.records.tokens import TOKENS_TABLE

FIRST_TABLES = """
CREATE TABLE IF NOT EXISTS measurement
  (seq INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT UNIQUE NOT NULL, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS press (id TEXT PRIMARY KEY, ended INTEGER NOT NULL, record TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS counter (name TEXT PRIMARY KEY, value REAL NOT NULL);
"""
_Step = str | Callable[[sqlite3.Connection], None]
STEPS: MappingProxyType[int, tuple[_Step, ...]] = MappingProxyType(
    {
        1: (FIRST_TABLES,),
        4: (ANSWERS_TABLE, EXAM_TABLES),
        5: (TOKENS_TABLE, AUDIT_TABLE, chain_older_audit, AUDIT_GUARDS),
        6: (MANIFEST_TABLE,),
        7: (OUTBOX_TABLES,),
    }
)
"""What is done to reach each form; to reach 2 and 3 nothing, for only recordings changed."""
ADDITIONS: tuple[_Step, ...] = (ISSUER_TABLE, SCHEDULED_TABLE, ISSUERS_OF_ORDERS)
"""What lies beside the tables of a form: a release of that form neither reads nor writes it.

It is made at every start. So the way back to that release and forth again stays open, and what it wrote is filled in.
"""
ADDED_TABLES = re.findall(r"CREATE TABLE IF NOT EXISTS (\w+)", "".join(map(str, ADDITIONS)))


def form_of(db: sqlite3.Connection) -> int:
    """Return the number of a database's form, 0 for one without a number."""
    return int(db.execute("PRAGMA user_version").fetchone()[0])


def bring_forward(db: sqlite3.Connection) -> None:
    """Bring a database to the form that this code writes; raise `sqlite3.Error` when a step is refused."""
    for form in range(form_of(db) + 1, STORE_WRITES + 1):
        with db:
            db.execute("BEGIN IMMEDIATE")
            for step in STEPS.get(form, ()):
                _take(db, step)
            db.execute(f"PRAGMA user_version = {form:d}")
    with db:
        db.execute("BEGIN IMMEDIATE")
        add_beside(db)


def add_beside(db: sqlite3.Connection) -> None:
    """Make what is missing of `ADDITIONS`, in a transaction that is under way."""
    for step in ADDITIONS:
        _take(db, step)


def is_whole(db: sqlite3.Connection) -> bool:
    """Return whether a database has the tables of `ADDITIONS`: one that the release before wrote has none yet."""
    there = {name for (name,) in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")}
    return there.issuperset(ADDED_TABLES)


def _take(db: sqlite3.Connection, step: _Step) -> None:
    if not isinstance(step, str):
        step(db)
        return
    for statement in _statements(step):
        db.execute(statement)


def _statements(script: str) -> Iterator[str]:
    """Yield the statements of a script: `executescript` would end the transaction that is under way."""
    statement = ""
    for line in script.splitlines(keepends=True):
        statement += line
        if sqlite3.complete_statement(statement):
            yield statement
            statement = ""
