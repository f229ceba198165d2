"""Requests that are obeyed once, however often they are sent: each with the answer that it got.

The answer is kept in the transaction that obeys, so that neither is there without the other.
"""

from __future__ import annotations

import json
import sqlite3
from dataclasses import dataclass
from typing import Any

from device.errors import ReusedKey

ANSWERS_TABLE = """
CREATE TABLE IF NOT EXISTS asked_once (key TEXT PRIMARY KEY, request TEXT NOT NULL, answer TEXT NOT NULL);
"""


@dataclass(frozen=True)
class AskedOnce:
    """A request by the key that its client gave it, and what it asks for as one string."""

    key: str
    request: str


def first_answer(db: sqlite3.Connection, once: AskedOnce) -> dict[str, Any] | None:
    """Return what a request was answered with the first time, or None; raise `ReusedKey` when it was another."""
    row = db.execute("SELECT request, answer FROM asked_once WHERE key = ?", (once.key,)).fetchone()
    if row and row[0] != once.request:
        cause = f"The Idempotency-Key {once.key!r} was sent before with another request."
        raise ReusedKey(cause, "Give each new request a key of its own.")
    return json.loads(row[1]) if row else None


def keep_answer(db: sqlite3.Connection, once: AskedOnce, answer: dict[str, Any]) -> None:
    """Keep what a request is answered with."""
    db.execute("INSERT INTO asked_once VALUES (?, ?, ?)", (once.key, once.request, json.dumps(answer)))
