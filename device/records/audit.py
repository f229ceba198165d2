"""The audit: what people and the probe did, each entry chained to the one before, so that none is changed unseen.

An entry's hash is SHA-256 over the hash before it and the entry as canonical JSON, its number among it. SQLite refuses
to change or delete an entry; who goes around that breaks the chain, or leaves a gap at its end, and the row is named.
Whoever writes the whole chain anew is found only by a hash that was kept elsewhere: each is logged, for the journal,
and `python -m device audit verify --head` compares one.
"""

from __future__ import annotations

import hashlib
import json
import logging
import re
import sqlite3
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from device.errors import AuditChanged
from device.measurement.quantities import InvalidQuantity

log = logging.getLogger(__name__)

_Record = dict[str, Any]
AuditedAct = Literal[
    "exam_made", "exam_changed", "measurement_moved", "measurement_voided", "press_begun", "press_ended", "token_made",
    "token_revoked", "settings_changed", "exam_sent", "object_withdrawn", "object_recalled", "recording_deleted",
    "patient_erased",
]  # fmt: skip
"""All that is ever written into it."""
AUDIT_TABLE = """
CREATE TABLE IF NOT EXISTS audit
  (seq INTEGER PRIMARY KEY AUTOINCREMENT, subject TEXT NOT NULL, record TEXT NOT NULL, hash TEXT);
CREATE INDEX IF NOT EXISTS audit_by_subject ON audit (subject);
"""
AUDIT_GUARDS = """
CREATE TRIGGER IF NOT EXISTS audit_is_never_changed BEFORE UPDATE ON audit
  BEGIN SELECT RAISE(ABORT, 'an entry of the audit is never changed'); END;
CREATE TRIGGER IF NOT EXISTS audit_is_never_deleted BEFORE DELETE ON audit
  BEGIN SELECT RAISE(ABORT, 'an entry of the audit is never deleted'); END;
"""
FIRST = "0" * 64
"""What stands before the first entry."""
HEAD = re.compile(r"\d{1,18}:[0-9a-f]{64}", re.ASCII)
"""A head as it is printed, `SEQ:HASH`."""
PROBE = "probe"
CLIENT: ContextVar[str] = ContextVar("client", default=PROBE)
"""Who asks for what is being done: the own screen, a token's name, or the probe by itself."""
ENTRY_REMEDY = "Keep the data folder as it is, compare it with a backup, and tell who is responsible for the probe."


@contextmanager
def done_for(client: str) -> Iterator[None]:
    """While it is held, entries say that this client asked for it."""
    token = CLIENT.set(client)
    try:
        yield
    finally:
        CLIENT.reset(token)


@dataclass(frozen=True)
class AuditHead:
    """How far the chain goes: the number of its last entry, 0 of none, and its hash."""

    seq: int
    hash: str

    def __str__(self) -> str:
        return f"{self.seq}:{self.hash}"


NO_ENTRY = AuditHead(0, FIRST)
"""Where every chain begins."""


def chain_older_audit(db: sqlite3.Connection) -> None:
    """Chain the audit of a release that had no chain, as it is found, in a transaction that is under way."""
    if "hash" in [column[1] for column in db.execute("PRAGMA table_info(audit)")]:
        return
    for trigger in ("audit_is_never_changed", "audit_is_never_deleted"):
        db.execute(f"DROP TRIGGER IF EXISTS {trigger}")
    db.execute("ALTER TABLE audit ADD COLUMN hash TEXT")
    _chain_all(db)


def _chain_all(db: sqlite3.Connection) -> None:
    before = FIRST
    for seq, record in db.execute("SELECT seq, record FROM audit ORDER BY seq").fetchall():
        before = chained(before, {"seq": seq, **json.loads(record)})
        db.execute("UPDATE audit SET hash = ? WHERE seq = ?", (before, seq))


def chained(before: str, entry: _Record) -> str:
    """Return the hash of an entry, its `seq` among it, after the one with the hash `before`."""
    canonical = json.dumps(entry, sort_keys=True, separators=(",", ":"), ensure_ascii=True)
    return hashlib.sha256(f"{before}{canonical}".encode()).hexdigest()


def append(
    db: sqlite3.Connection,
    what: AuditedAct,
    subject: str,
    *,
    by: str = "",
    reason: str = "",
    before: _Record | None = None,
    after: _Record,
) -> None:
    """Write an entry in the transaction that does what it tells; `by` is the client unless somebody is named."""
    client = CLIENT.get()
    told = {"at": utc_now(), "by": by or client, "client": client, "what": what, "subject": subject, "reason": reason}
    record = {**told, "before": before, "after": after}
    seq = _last_seq(db) + 1
    last = db.execute("SELECT hash FROM audit ORDER BY seq DESC LIMIT 1").fetchone()
    own = chained(last[0] if last else FIRST, {"seq": seq, **record})
    db.execute("INSERT INTO audit (seq, subject, record, hash) VALUES (?, ?, ?, ?)", (seq, subject, _text(record), own))
    log.info("audit seq=%d what=%s subject=%s hash=%s", seq, what, subject, own)


def _text(record: _Record) -> str:
    return json.dumps(record)


def _last_seq(db: sqlite3.Connection) -> int:
    """Return the last number that SQLite gave, whether its entry is still there or not."""
    row = db.execute("SELECT seq FROM sqlite_sequence WHERE name = 'audit'").fetchone()
    return int(row[0]) if row else 0


def verify_chain(db: sqlite3.Connection) -> AuditHead:
    """Return the head of a chain that holds; raise `AuditChanged`, with the first row that does not."""
    seq, before = 0, FIRST
    for seq, (found, subject, text, own) in enumerate(
        db.execute("SELECT seq, subject, record, hash FROM audit ORDER BY seq"), 1
    ):
        if found != seq:
            raise _changed(f"Row {seq} of the audit is missing: the next one is {found}.")
        record = _read(text)
        if record is None or record.get("subject") != subject or chained(before, {"seq": seq, **record}) != own:
            raise _changed(f"Row {seq} of the audit is not as it was written.")
        before = own
    if (last := _last_seq(db)) != seq:
        raise _changed(f"The audit ends with row {seq}, but {last} were written.")
    return AuditHead(seq, before)


def require_head(db: sqlite3.Connection, head: str) -> None:
    """Raise `AuditChanged` unless the chain went through a head, `SEQ:HASH`, that was kept elsewhere.

    Raises `InvalidQuantity` for what is no head.
    """
    if not HEAD.fullmatch(head):
        raise InvalidQuantity("head", repr(head[:80]), "SEQ:HASH", "give what was printed and kept, whole")
    wanted = _head(head)
    if not _is_head(db, wanted):
        raise _changed(f"Row {wanted.seq} of the audit has not the hash {wanted.hash}.")


def _head(text: str) -> AuditHead:
    seq, _, own = text.partition(":")
    return AuditHead(int(seq), own)


def _is_head(db: sqlite3.Connection, head: AuditHead) -> bool:
    """Return whether the chain went through a head."""
    if head.seq == 0:
        return head == NO_ENTRY
    return bool(db.execute("SELECT 1 FROM audit WHERE seq = ? AND hash = ?", (head.seq, head.hash)).fetchone())


def _read(text: str) -> _Record | None:
    try:
        record = json.loads(text)
    except ValueError:
        return None
    return record if isinstance(record, dict) else None


def _changed(cause: str) -> AuditChanged:
    return AuditChanged(cause, ENTRY_REMEDY)


class Audit:
    """The audit of a store; all methods may be called from any thread."""

    def __init__(self, transaction: Callable[[], AbstractContextManager[sqlite3.Connection]]) -> None:
        """Take how a transaction of the store is begun."""
        self._transaction = transaction

    def append(self, what: AuditedAct, subject: str, **said: Any) -> None:
        """Write an entry of what is no record of the store; its fields as in `append` above."""
        with self._transaction() as db:
            append(db, what, subject, **said)

    def verify(self) -> AuditHead:
        """Return the head of the chain; raise `AuditChanged` when it does not hold."""
        with self._transaction() as db:
            return verify_chain(db)

    def newest(self) -> AuditHead:
        """Return the head of the chain as it stands; nothing is verified."""
        with self._transaction() as db:
            row = db.execute("SELECT seq, hash FROM audit ORDER BY seq DESC LIMIT 1").fetchone()
        return AuditHead(*row) if row else NO_ENTRY

    def known(self, head: str) -> AuditHead:
        """Return a head, `SEQ:HASH`, that the chain went through, and `NO_ENTRY` for whatever else.

        A number alone would name another entry once a backup was restored; with its hash it never does.
        """
        if not HEAD.fullmatch(head):
            return NO_ENTRY
        said = _head(head)
        with self._transaction() as db:
            return said if _is_head(db, said) else NO_ENTRY

    def warning(self) -> AuditChanged | None:
        """Return what the screen has to say of the chain, None when it holds."""
        try:
            head = self.verify()
        except AuditChanged as change:
            log.error("%s %s", change.code, change)
            return change
        log.info("audit whole head=%s", head)
        return None

    def entries(
        self,
        *,
        subject: str | None = None,
        since: str | None = None,
        until: str | None = None,
        before_seq: int,
        limit: int,
    ) -> list[_Record]:
        """Return what was done, to one subject or to all, newest first, each with its hash.

        `since` and `until`: RFC 3339 in UTC with milliseconds, as entries have it; the second is not in it any more.
        """
        where = {
            "subject = ?": subject,
            "json_extract(record, '$.at') >= ?": since,
            "json_extract(record, '$.at') < ?": until,
        }
        asked = {condition: value for condition, value in where.items() if value}
        conditions = " AND ".join(["seq < ?", *asked])
        query = f"SELECT seq, hash, record FROM audit WHERE {conditions} ORDER BY seq DESC LIMIT ?"
        with self._transaction() as db:
            rows = db.execute(query, (before_seq, *asked.values(), limit))
            return [{"seq": seq, "hash": own, **json.loads(record)} for seq, own, record in rows]

    def note_in_use(self, present: _Record) -> None:
        """Write which settings, certificate and software are in use, if they are others than the last time."""
        with self._transaction() as db:
            query = "SELECT record FROM audit WHERE subject = 'settings' ORDER BY seq DESC LIMIT 1"
            row = db.execute(query).fetchone()
            was = _in_use(json.loads(row[0])) if row else {}
            names = [name for name in {**was, **present} if was.get(name) != present.get(name)]
            if names:
                before, after = ({name: one.get(name) for name in names} for one in (was, present))
                append(
                    db,
                    "settings_changed",
                    "settings",
                    before=before if row else None,
                    after={**after, "whole": present},
                )


def _in_use(entry: _Record) -> _Record:
    whole = entry["after"].get("whole", {})
    return dict(whole)


def utc_now() -> str:
    """Return the wall clock as RFC 3339 with milliseconds, UTC."""
    return recorded(datetime.now(UTC))


def recorded(moment: datetime) -> str:
    """Return a moment with its offset as records have it: RFC 3339 with milliseconds, UTC."""
    return moment.astimezone(UTC).isoformat(timespec="milliseconds").replace("+00:00", "Z")
