"""Measurements, presses and exams as lists: newest first, page by page, of an exam, a time, a mode or an outcome.

And what of them was made or changed lately, oldest first. Their order is that in which they were kept, never that of a
clock, which may have been set.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Literal

from device.measurement.quantities import Bound
from device.records.exams import WITH_ISSUER, exam_of, filed, told_exam

_Record = dict[str, Any]
_MEASUREMENTS = "measurement LEFT JOIN filing ON measurement_id = id"
NEWEST = 2**63 - 1
"""Above every number of a record: the largest integer SQLite holds."""
ROWS = Bound(1, 100_000, "")
"""How many a command may ask for at once."""


@dataclass(frozen=True)
class Wanted:
    """Which records a list is of; what is None does not matter.

    `since` and `until`: RFC 3339 in UTC with milliseconds, as the records have it; the second is not in it any more.
    `outcome`: the status of a measurement's estimate, or the state of a press. `after_seq`: the number of the last
    measurement that whoever asks has.
    """

    exam_id: str | None = None
    since: str | None = None
    until: str | None = None
    mode: str | None = None
    outcome: str | None = None
    after_seq: int | None = None


@dataclass(frozen=True)
class Page:
    """Records, and the number below which those of the next page are; None when there are no more."""

    records: list[_Record]
    next_before: int | None


@dataclass(frozen=True)
class Change:
    """A measurement or an exam as it is now, and the audit's entry by which it came to be or changed.

    Of the entry: its number, its hash, when it was written (RFC 3339 UTC), and what was done.
    """

    number: int
    hash: str
    at: str
    what: str
    kind: Literal["measurement", "exam"]
    record: _Record


@dataclass(frozen=True)
class KeptCounts:
    """How many records there are; presses by their state."""

    presses: dict[str, int]
    measurements: int
    exams: int


INDEXES = """
CREATE INDEX IF NOT EXISTS measurement_by_time ON measurement (json_extract(record, '$.taken_at'));
CREATE INDEX IF NOT EXISTS measurement_by_mode
  ON measurement (json_extract(record, '$.mode'), json_extract(record, '$.taken_at'));
CREATE INDEX IF NOT EXISTS measurement_by_outcome
  ON measurement (json_extract(record, '$.estimate.status'), json_extract(record, '$.taken_at'));
CREATE INDEX IF NOT EXISTS press_by_time ON press (json_extract(record, '$.asked_at'));
CREATE INDEX IF NOT EXISTS press_by_exam ON press (json_extract(record, '$.exam_id'));
CREATE INDEX IF NOT EXISTS exam_by_time ON exam (json_extract(record, '$.made_at'));
CREATE INDEX IF NOT EXISTS exam_by_patient ON exam (json_extract(record, '$.patient_ref'));
CREATE INDEX IF NOT EXISTS exam_by_order ON exam (json_extract(record, '$.order_number'));
"""
"""What lists are looked up by; no part of the store's form, since any release reads and keeps them without knowing."""


class Listing:
    """The lists of a store; all methods may be called from any thread."""

    def __init__(self, transaction: Callable[[], AbstractContextManager[sqlite3.Connection]]) -> None:
        """Take how a transaction of the store is begun."""
        self._transaction = transaction

    def measurements(self, wanted: Wanted, *, before: int = NEWEST, limit: int) -> Page:
        """Return measurements as `Store.measurement` does, of the exam that each belongs to now."""
        where = {
            "exam_id = ?": wanted.exam_id,
            "json_extract(record, '$.taken_at') >= ?": wanted.since,
            "json_extract(record, '$.taken_at') < ?": wanted.until,
            "json_extract(record, '$.mode') = ?": wanted.mode,
            "json_extract(record, '$.estimate.status') = ?": wanted.outcome,
            "seq > ?": self._known(wanted.after_seq),
        }
        rows = self._rows("seq, record, exam_id, voided, version", _MEASUREMENTS, "seq", where, before, limit)
        return _page([(seq, {**json.loads(record), **filed(*filing)}) for seq, record, *filing in rows], limit)

    def presses(self, wanted: Wanted, *, before: int = NEWEST, limit: int) -> Page:
        """Return press jobs; one that is under way is the first. Those of releases that kept no time are in none."""
        where = {
            "json_extract(record, '$.exam_id') = ?": wanted.exam_id,
            "json_extract(record, '$.asked_at') >= ?": wanted.since,
            "json_extract(record, '$.asked_at') < ?": wanted.until,
            "json_extract(record, '$.mode') = ?": wanted.mode,
            "json_extract(record, '$.state') = ?": wanted.outcome,
        }
        rows = self._rows("rowid, record", "press", "rowid", where, before, limit)
        return _page([(number, json.loads(record)) for number, record in rows], limit)

    def exams(
        self,
        wanted: Wanted,
        *,
        kind: str,
        patient_ref: str | None = None,
        patient_issuer: str | None = None,
        order_number: str | None = None,
        before: int = NEWEST,
        limit: int,
    ) -> Page:
        """Return the exams of one kind, of a patient or an order where one is given, by when they were made.

        A reference alone is that of every issuer; `patient_issuer` narrows it to one, or to none by `NO_ISSUER`.
        """
        where = {
            "json_extract(record, '$.kind') = ?": kind,
            "json_extract(record, '$.patient_ref') = ?": patient_ref,
            "coalesce(issuer, '') = ?": patient_issuer,
            "json_extract(record, '$.order_number') = ?": order_number,
            "json_extract(record, '$.made_at') >= ?": wanted.since,
            "json_extract(record, '$.made_at') < ?": wanted.until,
        }
        rows = self._rows("seq, record, issuer", WITH_ISSUER, "seq", where, before, limit)
        return _page([(seq, told_exam(*told)) for seq, *told in rows], limit)

    def _known(self, after_seq: int | None) -> int | None:
        """Return the number itself, 0 of one that no measurement has come to: a backup was restored since."""
        if after_seq is None:
            return None
        with self._transaction() as db:
            [newest] = db.execute("SELECT coalesce(max(seq), 0) FROM measurement").fetchone()
        return after_seq if after_seq <= newest else 0

    def counts(self) -> KeptCounts:
        """Return how many records of each kind there are."""
        with self._transaction() as db:
            states = db.execute("SELECT json_extract(record, '$.state'), count(*) FROM press GROUP BY 1").fetchall()
            of_tables = (db.execute(f"SELECT count(*) FROM {name}").fetchone()[0] for name in ("measurement", "exam"))
            return KeptCounts(dict(states), *of_tables)

    def measurements_of(self, exam_id: str) -> tuple[int, int]:
        """Return how many measurements of an exam count, and how many are void."""
        with self._transaction() as db:
            query = "SELECT count(*), count(voided) FROM filing WHERE exam_id = ?"
            in_it, void = db.execute(query, (exam_id,)).fetchone()
            return in_it - void, void

    def newest_change(self) -> int:
        """Return the number of the audit's last entry, 0 when there is none."""
        with self._transaction() as db:
            return int(db.execute("SELECT coalesce(max(seq), 0) FROM audit").fetchone()[0])

    def changes(self, *, after: int, limit: int) -> list[Change]:
        """Return what was made or changed after an entry of the audit, oldest first."""
        where = f"seq > ? AND {_TOLD} AND {_IS_THERE}"
        query = f"SELECT seq, hash, subject, record FROM audit WHERE {where} ORDER BY seq LIMIT ?"
        with self._transaction() as db:
            rows = db.execute(query, (after, limit)).fetchall()
            return [_change(db, seq, own, subject, json.loads(record)) for seq, own, subject, record in rows]

    def told(self, whom: str) -> int | None:
        """Return the number of the last change that somebody elsewhere was told of, None of nobody."""
        with self._transaction() as db:
            row = db.execute("SELECT value FROM counter WHERE name = ?", (_counter(whom),)).fetchone()
            return int(row[0]) if row else None

    def note_told(self, whom: str, number: int) -> None:
        """Keep that somebody elsewhere was told of the changes up to a number."""
        with self._transaction() as db:
            db.execute("INSERT OR REPLACE INTO counter VALUES (?, ?)", (_counter(whom), number))

    def _rows(
        self, columns: str, table: str, number: str, where: Mapping[str, str | int | None], before: int, limit: int
    ) -> list[Any]:
        """Return one row more than the page has, if there is one: then there is a next page.

        Numbers alone are put in order, and then the records of the page read: a record may have a hundred features.
        """
        asked = {condition: value for condition, value in where.items() if value is not None}
        # To find those of a time SQLite would go through all records in their order; a + keeps it from that.
        by = f"+{number}" if any("< ?" in condition or ">= ?" in condition for condition in asked) else number
        conditions = " AND ".join([f"{by} < ?", *asked])
        of_page = f"SELECT {number} FROM {table} WHERE {conditions} ORDER BY {by} DESC LIMIT ?"
        query = f"SELECT {columns} FROM {table} WHERE {number} IN ({of_page}) ORDER BY {number} DESC"
        with self._transaction() as db:
            return db.execute(query, (before, *asked.values(), limit + 1)).fetchall()


_TOLD = (
    "(json_extract(record, '$.what') IN ('exam_made', 'exam_changed', 'measurement_moved', 'measurement_voided')"
    " OR json_extract(record, '$.what') = 'press_ended'"
    " AND json_extract(record, '$.after.measurement_id') IS NOT NULL)"
)
"""The audit's entries of exams and measurements: the end of a press names the measurement that it made.

So does that of a recording which a rule deleted; its measurement is as it was.
"""

_IS_THERE = (
    "(subject IN (SELECT id FROM exam) OR"
    " coalesce(json_extract(record, '$.after.measurement_id'), subject) IN (SELECT id FROM measurement))"
)
"""What a damaged database has lost can be told to nobody."""


def _counter(whom: str) -> str:
    return f"told {whom}"


def _change(db: sqlite3.Connection, seq: int, own: str, subject: str, entry: _Record) -> Change:
    at, what = entry["at"], entry["what"]
    if what.startswith("exam_"):
        return Change(seq, own, at, what, "exam", exam_of(db, subject))
    query = f"SELECT record, exam_id, voided, version FROM {_MEASUREMENTS} WHERE id = ?"
    identifier = entry["after"].get("measurement_id") or subject
    record, *filing = db.execute(query, (identifier,)).fetchone()
    return Change(seq, own, at, what, "measurement", {**json.loads(record), **filed(*filing)})


def _page(numbered: list[tuple[int, _Record]], limit: int) -> Page:
    shown = numbered[:limit]
    return Page([record for _, record in shown], shown[-1][0] if len(numbered) > limit else None)
