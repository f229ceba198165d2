"""What is to be at the hospital's archive: one row an object, from when somebody sent an exam until the archive has it.

A row is written in one transaction with its entry in the audit, and keeps the exam as it was said then. Its identifier
is computed from that, so the same thing asked for twice is one row. Whose rows an exam's correction, a move or a voided
measurement has made wrong is found by the versions that were seen. Patients' names, which only a worklist tells, are
kept apart, and erased.

States: `queued` until the archive has answered, `sent`, `confirmed` once it has said that it keeps it; `refused` by the
archive; `withdrawn` before it was ever sent, `recalled` after that.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Any, Literal

from device.records.audit import AuditedAct, append, utc_now
from device.records.exams import exam_of, filed

_Record = dict[str, Any]
OutboxState = Literal["queued", "sent", "confirmed", "refused", "withdrawn", "recalled"]
LIVE = ("queued", "sent", "confirmed", "refused")
"""States of what is meant to be at the archive."""
OUTBOX_TABLES = """
CREATE TABLE IF NOT EXISTS outbox
  (seq INTEGER PRIMARY KEY AUTOINCREMENT, uid TEXT UNIQUE NOT NULL, exam_id TEXT NOT NULL, measurement_id TEXT NOT NULL,
   exam_version INTEGER NOT NULL, filing_version INTEGER NOT NULL, state TEXT NOT NULL, record TEXT NOT NULL);
CREATE INDEX IF NOT EXISTS outbox_by_state ON outbox (state);
CREATE INDEX IF NOT EXISTS outbox_by_exam ON outbox (exam_id);
CREATE TABLE IF NOT EXISTS ordered_study (exam_id TEXT PRIMARY KEY, record TEXT NOT NULL, patient TEXT);
"""
AGAIN = "state = 'queued', record = json_set(record, '$.problem', '')"
REFUSED_NOTES = "exam_id = ? AND state = 'refused' AND json_extract(record, '$.about.kind') = 'rejection'"
NAMED = "named "
"""Before an exam's id: the counter of when its patient's name was first seen by a clock that is right."""
NOT_NEEDED = "no longer needed for the archive"
_ROWS = "SELECT record, state FROM outbox"


@dataclass(frozen=True)
class OutboxItem:
    """An object that is to be at the archive: its identifier, what it is of, and what was seen when it was asked for.

    `about` is all that is needed to write it again.
    """

    uid: str
    exam_id: str
    measurement_id: str
    exam_version: int
    filing_version: int
    about: _Record


class Outbox:
    """The outbox of a store; all methods may be called from any thread."""

    def __init__(self, transaction: Callable[[], AbstractContextManager[sqlite3.Connection]]) -> None:
        """Take how a transaction of the store is begun."""
        self._transaction = transaction

    def add(self, exam_id: str, items: Sequence[OutboxItem], *, by: str, exam_version: int) -> None:
        """Queue the objects of one exam that are not there yet, and again those that were refused or withdrawn.

        So are notes of it that were refused: without them what is wrong stays at the archive as if it were right.
        Raises `StaleVersion` when the exam was changed since that version.
        """
        with self._transaction() as db:
            exam_of(db, exam_id, exam_version)
            new = [item.uid for item in items if self._insert(db, item)]
            notes = [uid for (uid,) in db.execute(f"SELECT uid FROM outbox WHERE {REFUSED_NOTES}", (exam_id,))]
            for uid in notes:
                db.execute(f"UPDATE outbox SET {AGAIN} WHERE uid = ?", (uid,))
            append(db, "exam_sent", exam_id, by=by, after={"objects": [*new, *notes]})

    def has_refused(self, exam_id: str) -> bool:
        """Return whether the archive has refused to be told that something of an exam is not right."""
        with self._transaction() as db:
            return bool(db.execute(f"SELECT 1 FROM outbox WHERE {REFUSED_NOTES} LIMIT 1", (exam_id,)).fetchone())

    def is_any_recalled(self, uids: Sequence[str]) -> bool:
        """Return whether the archive was told that one of these objects is not to be used: that is for good."""
        with self._transaction() as db:
            query = f"SELECT 1 FROM outbox WHERE state = 'recalled' AND uid IN ({','.join('?' * len(uids))}) LIMIT 1"
            return bool(db.execute(query, tuple(uids)).fetchone())

    def _insert(self, db: sqlite3.Connection, item: OutboxItem) -> bool:
        kept = db.execute("SELECT state FROM outbox WHERE uid = ?", (item.uid,)).fetchone()
        if kept and kept[0] not in ("refused", "withdrawn"):
            return False
        record = {
            "uid": item.uid, "exam_id": item.exam_id, "measurement_id": item.measurement_id, "tries": 0, "problem": "",
            "queued_at": utc_now(), "sent_at": None, "confirmed_at": None, "about": item.about,
        }  # fmt: skip
        row = item.uid, item.exam_id, item.measurement_id, item.exam_version, item.filing_version, json.dumps(record)
        if kept:
            seen = item.exam_version, item.filing_version, item.uid
            db.execute(f"UPDATE outbox SET {AGAIN}, exam_version = ?, filing_version = ? WHERE uid = ?", seen)
        else:
            columns = "uid, exam_id, measurement_id, exam_version, filing_version, state, record"
            db.execute(f"INSERT INTO outbox ({columns}) VALUES (?, ?, ?, ?, ?, 'queued', ?)", row)
        return True

    def in_state(self, state: OutboxState, *, limit: int) -> list[_Record]:
        """Return the oldest objects in a state, in the order in which they were asked for."""
        return self._select("WHERE state = ? ORDER BY seq LIMIT ?", state, limit)

    def of_exam(self, exam_id: str) -> list[_Record]:
        """Return the objects of an exam, oldest first."""
        return self._select("WHERE exam_id = ? ORDER BY seq", exam_id)

    def counts(self) -> dict[str, int]:
        """Return how many objects there are in each state that any is in."""
        with self._transaction() as db:
            return dict(db.execute("SELECT state, count(*) FROM outbox GROUP BY state"))

    def note_try(self, uid: str) -> None:
        """Say, before it is sent, that an object may be at the archive from now on."""
        with self._transaction() as db:
            db.execute("UPDATE outbox SET record = json_set(record, '$.tries', 1 + json_extract(record, '$.tries'))"
                       " WHERE uid = ?", (uid,))  # fmt: skip

    def settle(self, uid: str, state: OutboxState, problem: str = "", *, unless: str = "recalled") -> None:
        """Say what became of an object; one that was recalled meanwhile stays so."""
        at = {"sent": "sent_at", "confirmed": "confirmed_at"}.get(state)
        changes = "'$.problem', ?" + (f", '$.{at}', ?" if at else "")
        values = (problem, utc_now()) if at else (problem,)
        query = f"UPDATE outbox SET state = ?, record = json_set(record, {changes}) WHERE uid = ? AND state != ?"
        with self._transaction() as db:
            db.execute(query, (state, *values, uid, unless))

    def is_idle(self) -> bool:
        """Return whether nothing is to be sent, asked for or taken back."""
        with self._transaction() as db:
            waiting = db.execute("SELECT 1 FROM outbox WHERE state IN ('queued', 'sent') LIMIT 1").fetchone()
        return not waiting and not self.changed_since()

    def changed_since(self) -> list[tuple[_Record, _Record, _Record]]:
        """Return each object whose exam or measurement was changed since it was asked for, with both as they are now.

        Of the measurement: which exam it is filed under, whether it is void, and the version of that.
        """
        query = f"""
            SELECT outbox.record, outbox.state, exam.record, filing.exam_id, voided, filing.version FROM outbox
            JOIN exam ON exam.id = outbox.exam_id LEFT JOIN filing ON filing.measurement_id = outbox.measurement_id
            WHERE state IN {LIVE} AND (exam_version != exam.version OR filing_version != coalesce(filing.version, 1))
            ORDER BY outbox.seq"""
        with self._transaction() as db:
            rows = db.execute(query).fetchall()
        return [
            ({**json.loads(record), "state": state}, json.loads(exam), filed(*filing))
            for record, state, exam, *filing in rows
        ]

    def hold_on(self, uid: str, *, exam_version: int, filing_version: int) -> None:
        """Say that an object is right as it is, whatever was changed up to these versions."""
        with self._transaction() as db:
            row = exam_version, filing_version, uid
            db.execute("UPDATE outbox SET exam_version = ?, filing_version = ? WHERE uid = ?", row)

    def take_back(self, uid: str, recall: OutboxItem, why: str) -> None:
        """Withdraw an object that was never sent; recall any other: the archive is told by another object."""
        with self._transaction() as db:
            [(record,)] = db.execute("SELECT record FROM outbox WHERE uid = ?", (uid,))
            state: OutboxState = "recalled" if json.loads(record)["tries"] else "withdrawn"
            db.execute("UPDATE outbox SET state = ?, record = json_set(record, '$.problem', ?) WHERE uid = ?",
                       (state, why, uid))  # fmt: skip
            if state == "recalled":
                self._insert(db, recall)
            act: AuditedAct = "object_recalled" if state == "recalled" else "object_withdrawn"
            append(db, act, recall.exam_id, reason=why, after={"objects": [uid]})

    def order(self, db: sqlite3.Connection, exam_id: str, record: _Record, patient: _Record) -> None:
        """Keep what the worklist says of an exam that is being made, in the transaction that makes it."""
        row = exam_id, json.dumps(record), json.dumps(patient)
        db.execute("INSERT INTO ordered_study VALUES (?, ?, ?)", row)

    def ordered(self, exam_id: str) -> tuple[_Record, _Record] | None:
        """Return what the worklist has said of an exam, and of its patient: {} once that was erased."""
        with self._transaction() as db:
            row = db.execute("SELECT record, patient FROM ordered_study WHERE exam_id = ?", (exam_id,)).fetchone()
        return (json.loads(row[0]), json.loads(row[1] or "{}")) if row else None

    def erase_patients(self, *, sent_before: str, seen_before: str, has_archive: bool = True) -> int:
        """Erase who patients are, from the file as well; return of how many exams. Times are RFC 3339 UTC.

        Erased are those whose exam the archive has had since before the first time, or that was first seen here before
        the other one, unless any of it waits to be sent: where there is no archive nothing does. To be called while
        the clock is right: when an exam was made it may not have been.
        """
        query = """
            SELECT exam_id FROM ordered_study WHERE patient IS NOT NULL
            AND NOT (:waits AND exam_id IN (SELECT exam_id FROM outbox WHERE state IN ('queued', 'sent')))
            AND (exam_id IN (SELECT substr(name, :mark) FROM counter WHERE name LIKE :named AND value <= :seen)
              OR exam_id IN (SELECT exam_id FROM outbox WHERE state = 'confirmed')
              AND exam_id NOT IN (SELECT exam_id FROM outbox WHERE json_extract(record, '$.confirmed_at') >= :sent))"""
        with self._transaction() as db:
            db.execute(
                "INSERT OR IGNORE INTO counter SELECT ? || exam_id, ? FROM ordered_study WHERE patient IS NOT NULL",
                (NAMED, utc_now()),
            )
            of_query = {
                "seen": seen_before,
                "sent": sent_before,
                "waits": has_archive,
                "mark": 1 + len(NAMED),
                "named": f"{NAMED}%",
            }
            erased = db.execute(query, of_query).fetchall()
            for (exam_id,) in erased:
                db.execute("UPDATE ordered_study SET patient = NULL WHERE exam_id = ?", (exam_id,))
                db.execute("DELETE FROM counter WHERE name = ?", (NAMED + exam_id,))
                append(db, "patient_erased", exam_id, reason=NOT_NEEDED, after={"patient": None})
        if erased:
            with self._transaction() as db:
                db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return len(erased)

    def _select(self, where: str, *values: object) -> list[_Record]:
        with self._transaction() as db:
            return [{**json.loads(record), "state": state} for record, state in db.execute(f"{_ROWS} {where}", values)]
