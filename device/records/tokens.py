"""Tokens by which programs and browsers of other machines ask: kept as hashes, each with its scope, end and revocation.

A token is shown once, when it is made. It is 256 random bits, so its SHA-256 tells nobody what it was, and no slow hash
is needed. All of them are in memory: a request waits for no disk.
"""

from __future__ import annotations

import hashlib
import hmac
import logging
import secrets
import sqlite3
import threading
import uuid
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass, replace
from datetime import UTC, datetime, timedelta
from typing import Any

from device.access.scopes import Scope
from device.errors import UnknownResource
from device.records.audit import append, recorded, utc_now

log = logging.getLogger(__name__)

MARK = "tsis_"
"""What every token begins with, so that one is found where it should not be."""
TOKENS_TABLE = """
CREATE TABLE IF NOT EXISTS token
  (id TEXT PRIMARY KEY, hash TEXT UNIQUE NOT NULL, name TEXT NOT NULL, scope TEXT NOT NULL, made_at TEXT NOT NULL,
   expires_at TEXT NOT NULL, revoked_at TEXT);
"""


@dataclass(frozen=True)
class TokenRecord:
    """What is known of a token: who has it, what it may and until when (RFC 3339); not the token itself."""

    id: str
    hash: str
    name: str
    scope: Scope
    made_at: str
    expires_at: str
    revoked_at: str | None = None

    def is_valid(self, now: str) -> bool:
        """Return whether it may still be used."""
        return self.revoked_at is None and now < self.expires_at

    @property
    def left_s(self) -> float:
        """How long it still holds (s), unless it is revoked before; 0 when it holds no more."""
        return max(0.0, (datetime.fromisoformat(self.expires_at) - datetime.now(UTC)).total_seconds())

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object, without its hash."""
        return {name: value for name, value in asdict(self).items() if name != "hash"}


def note_revoked(db: sqlite3.Connection, token_id: str, at: str, reason: str = "") -> None:
    """Keep that a token holds no more since a time (RFC 3339), with its entry in the audit."""
    db.execute("UPDATE token SET revoked_at = ? WHERE id = ?", (at, token_id))
    append(db, "token_revoked", token_id, reason=reason, before={"revoked_at": None}, after={"revoked_at": at})


class Tokens:
    """The tokens of a store; all methods may be called from any thread."""

    def __init__(self, transaction: Callable[[], AbstractContextManager[sqlite3.Connection]]) -> None:
        """Take how a transaction of the store is begun, and read what there is."""
        self._transaction, self._lock = transaction, threading.Lock()
        self._listeners: list[Callable[[str], None]] = []
        with transaction() as db:
            rows = db.execute("SELECT id, hash, name, scope, made_at, expires_at, revoked_at FROM token")
            self._by_hash = {row[1]: TokenRecord(*row) for row in rows}

    def make(self, name: str, scope: Scope, *, days: int) -> tuple[TokenRecord, str]:
        """Keep a new token that holds for some days; return it and its secret, which is nowhere else."""
        secret = MARK + secrets.token_urlsafe(32)
        expires_at = recorded(datetime.now(UTC) + timedelta(days=days))
        made = TokenRecord(str(uuid.uuid4()), _hashed(secret), name, scope, utc_now(), expires_at)
        with self._transaction() as db:
            row = made.id, made.hash, made.name, made.scope, made.made_at, made.expires_at
            db.execute("INSERT INTO token VALUES (?, ?, ?, ?, ?, ?, NULL)", row)
            append(db, "token_made", made.id, after=made.as_record())
        with self._lock:
            self._by_hash[made.hash] = made
        return made, secret

    def of(self, secret: str) -> TokenRecord | None:
        """Return the token whose secret this is, None when there is none or it holds no more."""
        own = _hashed(secret)
        with self._lock:
            found = self._by_hash.get(own)
        is_its = found is not None and hmac.compare_digest(found.hash, own)
        return found if found and is_its and found.is_valid(utc_now()) else None

    def all(self) -> list[TokenRecord]:
        """Return every token there was, newest first."""
        with self._lock:
            return sorted(self._by_hash.values(), key=lambda one: one.made_at, reverse=True)

    def revoke(self, token_id: str) -> TokenRecord:
        """Let a token hold no more, from now on; raise `UnknownResource` when there is none, or it is revoked."""
        found = next((one for one in self.all() if one.id == token_id and one.revoked_at is None), None)
        if found is None:
            raise UnknownResource(f"There is no token {token_id} that holds.", "Look at the list: GET tokens.")
        revoked = replace(found, revoked_at=utc_now())
        with self._transaction() as db:
            note_revoked(db, token_id, str(revoked.revoked_at))
        with self._lock:
            self._by_hash[revoked.hash] = revoked
        for listener in self._listeners:
            listener(token_id)
        return revoked

    def on_revoked(self, listener: Callable[[str], None]) -> None:
        """Call `listener` with the id of a token as soon as it is revoked, in whatever thread revokes it."""
        self._listeners.append(listener)


def _hashed(secret: str) -> str:
    return hashlib.sha256(secret.encode("utf-8", "backslashreplace")).hexdigest()
