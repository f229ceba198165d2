"""What is to be at the hospital's archive: one row an object, from when somebody sent an exam until the archive has it.

A row is written in one transaction with its entry in the audit, and keeps the exam as it was said then. Its identifier
is computed from that, so the same thing asked for twice is one row. Whose rows an exam's correction, a move or a voided
measurement has made wrong is found by the versions that were seen. Patients' names, which only a worklist tells, are
kept apart, and erased.

Requests that it commit itself to keep objects, DICOM's transactions, stand in the rows, each until it is answered: the
answer may come days later, and after a restart.

States: `queued` until the archive has answered, `sent`, `confirmed` once it has said that it keeps it; `refused` by the
archive, or taken by it and not found there; `withdrawn` before it was ever sent, `recalled` after that.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Collection, Sequence
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
SCHEDULED_TABLE = "CREATE TABLE IF NOT EXISTS scheduled (exam_id TEXT PRIMARY KEY, scheduled_at TEXT NOT NULL);"
"""When the step of the worklist is scheduled, as the hospital writes it; of exams from before nothing is there."""
AFRESH = "'$.failed_alone', 0, '$.not_understood', 0"
AGAIN = f"state = 'queued', record = json_set(record, '$.problem', '', {AFRESH}, '$.rounds', 0)"
REFUSED_NOTES = "exam_id = ? AND state = 'refused' AND json_extract(record, '$.about.kind') = 'rejection'"
ASKED = "coalesce(json_extract(record, '$.asked'), 0)"
COUNTS = ("failed_alone", "not_understood", "rounds", "asked", "commitments")
"""Of an object, where it has any: in how many turns it failed while others were taken, and was not understood; how
often it was sent again because it was not found; when it was last asked for, by a number that grows; and by which
transactions it was, each with when the archive took it, "" unless it is known to have, None once it is closed."""
OPEN = "EXISTS (SELECT 1 FROM json_each(record, '$.commitments') WHERE value IS NOT NULL)"
AWAITED = "EXISTS (SELECT 1 FROM json_each(record, '$.commitments') WHERE value BETWEEN ? AND ?)"
MOST_TRANSACTIONS = 30
"""So many last ones of an object are known: a month of an archive that takes one a day and answers none."""
NAMED = "named "
"""Before an exam's id: the counter of when its patient's name was first seen by a clock that is right."""
NOT_NEEDED = "no longer needed for the archive"
IS_NAMED = "json_remove(patient, '$.issuer') != '{}'"
"""Of an ordered study: that it says more of the patient than who issued the number."""
UNNAMED = """CASE WHEN json_type(patient, '$.issuer') IS NULL THEN NULL
  ELSE json_object('issuer', json_extract(patient, '$.issuer')) END"""
"""What stays of a patient. A number without its issuer is another patient's to an archive that has several issuers, and
a note that recalls an object years later has to be filed to the patient of that object. An issuer is an office, no
person.
"""
_ROWS = "SELECT record, state FROM outbox"
IN_STUDY = """
SELECT ordered_study.record, patient, exam.record, EXISTS (
  SELECT 1 FROM outbox WHERE outbox.exam_id = exam.id AND json_extract(outbox.record, '$.tries') > 0
  AND json_extract(outbox.record, '$.about.study_uid') = :study)
FROM ordered_study JOIN exam ON exam.id = ordered_study.exam_id
WHERE json_extract(ordered_study.record, '$.study_uid') = :study AND exam.id != :exam"""
"""Other exams that were ordered with a study, and whether the archive may have anything of them in it."""
SAID_ALIKE = {
    "patient_ref": "patient's number", "issuer": "issuer of the number", "name": "patient's name",
    "birth_date": "date of birth", "sex": "sex", "order_number": "order number",
}  # fmt: skip
"""What a worklist says of patient and order that is one for all objects of a study, in words."""
DESCRIBING = ("name", "birth_date", "sex")


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

    def next_to_send(self, *, limit: int) -> list[_Record]:
        """Return queued objects, those that were tried least first: what fails must not keep others waiting."""
        return self._select("WHERE state = 'queued' ORDER BY json_extract(record, '$.tries'), seq LIMIT ?", limit)

    def next_to_ask_for(self, *, limit: int) -> list[_Record]:
        """Return objects that were sent, those that were never asked for or longest ago first."""
        return self._select(f"WHERE state = 'sent' ORDER BY {ASKED}, seq LIMIT ?", limit)

    def next_to_commit(self, *, limit: int, since: str, until: str) -> list[_Record]:
        """Return objects that were sent and are in no open transaction of between two times, in the same order.

        One of after the present was begun by a clock that was wrong, and is not waited for.
        """
        where = f"WHERE state = 'sent' AND NOT {AWAITED} ORDER BY {ASKED}, seq LIMIT ?"
        return self._select(where, since, until, limit)

    def awaits_commitment(self) -> bool:
        """Return whether an object may still be confirmed by a report: one that was given up for its silence, too."""
        with self._transaction() as db:
            query = f"SELECT 1 FROM outbox WHERE state IN ('queued', 'sent', 'refused') AND {OPEN} LIMIT 1"
            return bool(db.execute(query).fetchone())

    def has_confirmed(self, *, since: str) -> bool:
        """Return whether the archive has said of any object since a time (RFC 3339 UTC) that it keeps it."""
        confirmed = "state = 'confirmed' AND json_extract(record, '$.confirmed_at') >= ?"
        with self._transaction() as db:
            return bool(db.execute(f"SELECT 1 FROM outbox WHERE {confirmed} LIMIT 1", (since,)).fetchone())

    def objects(self, uids: Collection[str]) -> list[_Record]:
        """Return those of these objects that there are."""
        return self._select(f"WHERE uid IN ({','.join('?' * len(uids))}) ORDER BY seq", *uids)

    def begin_transaction(self, transaction_uid: str, uids: Sequence[str]) -> None:
        """Say, before the archive is asked, that it may answer this transaction from now on."""
        with self._transaction() as db:
            for uid, record in _commitments(db, uids):
                last = dict([*record.items(), (transaction_uid, "")][-MOST_TRANSACTIONS:])
                _keep_commitments(db, uid, last)

    def await_transaction(self, transaction_uid: str, uids: Sequence[str]) -> None:
        """Say that the archive has taken a transaction now: unless it is answered already, that is waited for."""
        with self._transaction() as db:
            for uid, record in _commitments(db, uids):
                if record.get(transaction_uid) == "":
                    _keep_commitments(db, uid, {**record, transaction_uid: utc_now()})

    def forget_transaction(self, transaction_uid: str, uids: Sequence[str]) -> None:
        """Say that the archive has refused to begin a transaction."""
        with self._transaction() as db:
            for uid, record in _commitments(db, uids):
                _keep_commitments(db, uid, {one: at for one, at in record.items() if one != transaction_uid})

    def close_transactions(self, uids: Sequence[str]) -> None:
        """Say that nothing is asked of objects any more; which transactions there were stays known."""
        with self._transaction() as db:
            for uid, record in _commitments(db, uids):
                _keep_commitments(db, uid, dict.fromkeys(record))

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

    def note_asked(self, uids: Sequence[str]) -> None:
        """Say that the archive is asked for these now: by a number that grows, for the clock may be wrong."""
        with self._transaction() as db:
            [(now,)] = db.execute(f"SELECT 1 + coalesce(max({ASKED}), 0) FROM outbox WHERE state = 'sent'")
            change = "UPDATE outbox SET record = json_set(record, '$.asked', ?) WHERE uid = ?"
            db.executemany(change, [(now, uid) for uid in uids])

    def note(self, uid: str, **said: str | int) -> None:
        """Say something of an object in whatever state it is: its `problem`, or one of `COUNTS`."""
        places = "".join(f", '$.{name}', ?" for name in said)
        with self._transaction() as db:
            db.execute(f"UPDATE outbox SET record = json_set(record{places}) WHERE uid = ?", (*said.values(), uid))

    def settle(
        self, uid: str, state: OutboxState, problem: str = "", *, unless: Sequence[OutboxState] = ("recalled",)
    ) -> None:
        """Say what became of an object; one that was recalled meanwhile stays so, or that is in another such state."""
        at = {"sent": "sent_at", "confirmed": "confirmed_at"}.get(state)
        changes = "'$.problem', ?" + (f", '$.{at}', ?" if at else "")
        changes += f", {AFRESH}" if state == "sent" else ""
        values = (problem, utc_now()) if at else (problem,)
        where = f"uid = ? AND state NOT IN ({','.join('?' * len(unless))})"
        query = f"UPDATE outbox SET state = ?, record = json_set(record, {changes}) WHERE {where}"
        with self._transaction() as db:
            db.execute(query, (state, *values, uid, *unless))

    def is_idle(self) -> bool:
        """Return whether nothing is to be sent, asked for, heard of or taken back."""
        with self._transaction() as db:
            waiting = db.execute("SELECT 1 FROM outbox WHERE state IN ('queued', 'sent') LIMIT 1").fetchone()
        return not waiting and not self.changed_since() and not self.awaits_commitment()

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

    def order(self, db: sqlite3.Connection, exam_id: str, record: _Record, patient: _Record, scheduled_at: str) -> None:
        """Keep what the worklist says of an exam that is being made, in the transaction that makes it."""
        db.execute("INSERT INTO ordered_study VALUES (?, ?, ?)", (exam_id, json.dumps(record), json.dumps(patient)))
        db.execute("INSERT INTO scheduled VALUES (?, ?)", (exam_id, scheduled_at))

    def order_as(self, db: sqlite3.Connection, exam_id: str, like: str) -> None:
        """Keep of an exam that is being made what the worklist has said of another one; what was erased stays so."""
        for table, columns in (("ordered_study", "record, patient"), ("scheduled", "scheduled_at")):
            db.execute(f"INSERT INTO {table} SELECT ?, {columns} FROM {table} WHERE exam_id = ?", (exam_id, like))

    def scheduled_at(self, exam_id: str) -> str:
        """Return when an exam's step was scheduled, as the worklist has said it; "" when that is not known."""
        with self._transaction() as db:
            row = db.execute("SELECT scheduled_at FROM scheduled WHERE exam_id = ?", (exam_id,)).fetchone()
        return str(row[0]) if row else ""

    def ordered(self, exam_id: str) -> tuple[_Record, _Record] | None:
        """Return what the worklist has said of an exam, and of its patient: no more than the issuer once erased."""
        with self._transaction() as db:
            row = db.execute("SELECT record, patient FROM ordered_study WHERE exam_id = ?", (exam_id,)).fetchone()
        return (json.loads(row[0]), json.loads(row[1] or "{}")) if row else None

    def ordered_with(self, study_uid: str) -> list[_Record]:
        """Return the exams that were ordered with a study, in the order in which they were begun."""
        query = """SELECT exam.record FROM ordered_study JOIN exam ON exam.id = exam_id
            WHERE json_extract(ordered_study.record, '$.study_uid') = ? ORDER BY exam.seq"""
        with self._transaction() as db:
            return [json.loads(record) for (record,) in db.execute(query, (study_uid,))]

    def erase_patients(self, *, sent_before: str, seen_before: str, has_archive: bool = True) -> int:
        """Erase who patients are, from the file as well; return of how many exams. Times are RFC 3339 UTC.

        Name, date of birth and sex go; who issued the number stays with the number, which the exam keeps as well.
        Erased are those whose exam the archive has had since before the first time, or that was first seen here before
        the other one, unless any of it waits to be sent: where there is no archive nothing does. To be called while
        the clock is right: when an exam was made it may not have been. A time to come is now from then on.
        """
        query = f"""
            SELECT exam_id FROM ordered_study WHERE {IS_NAMED}
            AND NOT (:waits AND exam_id IN (SELECT exam_id FROM outbox WHERE state IN ('queued', 'sent')))
            AND (exam_id IN (SELECT substr(name, :mark) FROM counter WHERE name LIKE :named AND value <= :seen)
              OR exam_id IN (SELECT exam_id FROM outbox WHERE state = 'confirmed')
              AND exam_id NOT IN (SELECT exam_id FROM outbox WHERE json_extract(record, '$.confirmed_at') >= :sent))"""
        with self._transaction() as db:
            db.execute(
                f"INSERT OR IGNORE INTO counter SELECT ? || exam_id, ? FROM ordered_study WHERE {IS_NAMED}",
                (NAMED, utc_now()),
            )
            _take_back_times_to_come(db)
            of_query = {
                "seen": seen_before,
                "sent": sent_before,
                "waits": has_archive,
                "mark": 1 + len(NAMED),
                "named": f"{NAMED}%",
            }
            erased = db.execute(query, of_query).fetchall()
            for (exam_id,) in erased:
                db.execute(f"UPDATE ordered_study SET patient = {UNNAMED} WHERE exam_id = ?", (exam_id,))
                db.execute("DELETE FROM counter WHERE name = ?", (NAMED + exam_id,))
                append(db, "patient_erased", exam_id, reason=NOT_NEEDED, after={"patient": None})
        if erased:
            with self._transaction() as db:
                db.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        return len(erased)

    def _select(self, where: str, *values: object) -> list[_Record]:
        with self._transaction() as db:
            return [{**json.loads(record), "state": state} for record, state in db.execute(f"{_ROWS} {where}", values)]


def is_as_ordered(exam: _Record, patient_ref: str, order_number: str) -> bool:
    """Return whether an exam is still of the patient and order that the worklist had named."""
    return (exam["patient_ref"], exam["order_number"] or "") == (patient_ref, order_number)


def own_study(db: sqlite3.Connection, exam: _Record) -> _Record:
    """Return `own_study`, which says why an exam may not share the study that was ordered with it; {} when it may.

    A study is of one patient and one order (DICOM PS3.3 A.1.2 and C.7.2.1), and an archive puts aside what says
    something else of either under one study. A worklist may: the hospital merged or corrected the patient between two
    exams of an order. Whether a new name or date of birth under the same number is a correction or another person the
    probe cannot know, and what it has sent it cannot change: so neither shares the study. Once apart an exam stays so.
    """
    kept = db.execute("SELECT record, patient FROM ordered_study WHERE exam_id = ?", (exam["id"],)).fetchone()
    if kept is None or exam.get("own_study"):
        return {}
    order = json.loads(kept[0])
    if not _is_of(exam, order):
        return {}
    others = [
        _said(json.loads(record), patient)
        for record, patient, other, is_sent in db.execute(IN_STUDY, {"study": order["study_uid"], "exam": exam["id"]})
        if is_sent or _shares(json.loads(other), json.loads(record))
    ]
    if not (differing := _contradictions(_said(order, kept[1]), others)):
        return {}
    what = ", ".join(differing)
    said = f"The ordered study has an exam with another {what}: this exam is sent as a study of its own."
    return {"own_study": f"{said} Have the archive match it by hand."}


def _is_of(exam: _Record, order: _Record) -> bool:
    return bool(order.get("study_uid")) and is_as_ordered(exam, order["patient_ref"], order["order_number"])


def _shares(exam: _Record, order: _Record) -> bool:
    return not exam.get("own_study") and _is_of(exam, order)


def _said(order: _Record, patient: str | None) -> _Record:
    """Return what the worklist has said of patient and order; what was erased of the patient is not there."""
    return {"patient_ref": order["patient_ref"], "order_number": order["order_number"], **json.loads(patient or "{}")}


def _contradictions(said: _Record, others: list[_Record]) -> list[str]:
    """Return in words what one of the others says otherwise."""
    return [words for name, words in SAID_ALIKE.items() if any(_contradict(name, said, one) for one in others)]


def _contradict(name: str, said: _Record, other: _Record) -> bool:
    """Return whether two say something of one name that cannot both be; what was erased contradicts nothing.

    Nor does a name, a date of birth or a sex that is empty; but a number without an issuer is filed as another one.
    """
    one, two = said.get(name), other.get(name)
    if name in DESCRIBING:
        one, two = (_plain(text or "") or None for text in (one, two))
    return None not in (one, two) and one != two


def _plain(text: str) -> str:
    """Return a text without what stands behind a value of DICOM and says nothing (PS3.5 section 6.2)."""
    return "=".join(group.rstrip("^ ") for group in text.split("=")).rstrip("=")


def _commitments(db: sqlite3.Connection, uids: Sequence[str]) -> list[tuple[str, dict[str, str | None]]]:
    """Return each of these objects that there is with the transactions in which it was asked for."""
    query = f"SELECT uid, json_extract(record, '$.commitments') FROM outbox WHERE uid IN ({','.join('?' * len(uids))})"
    return [(uid, json.loads(said or "{}")) for uid, said in db.execute(query, tuple(uids)).fetchall()]


def _keep_commitments(db: sqlite3.Connection, uid: str, commitments: dict[str, str | None]) -> None:
    change = "UPDATE outbox SET record = json_set(record, '$.commitments', json(?)) WHERE uid = ?"
    db.execute(change, (json.dumps(commitments), uid))


def _take_back_times_to_come(db: sqlite3.Connection) -> None:
    """Let what was first seen or confirmed later than now be so now: the clock was ahead, maybe by years."""
    now = utc_now()
    db.execute("UPDATE counter SET value = ? WHERE name LIKE ? AND value > ?", (now, f"{NAMED}%", now))
    confirmed = "json_extract(record, '$.confirmed_at')"
    db.execute(f"UPDATE outbox SET record = json_set(record, '$.confirmed_at', ?) WHERE {confirmed} > ?", (now, now))
