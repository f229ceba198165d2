"""What the last backup of a data folder holds, as `device.care.backup` notes it there once it is read back."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

SAVED = "saved.json"


@dataclass(frozen=True)
class SavedUntil:
    """What the last backup holds: all measurements up to a number, but for recordings that were damaged or missing."""

    made_at: str
    newest_seq: int
    newest_id: str
    left_out: tuple[str, ...] = ()

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object."""
        return asdict(self)


def saved_until(db: sqlite3.Connection, folder: Path) -> SavedUntil | None:
    """Return what the last backup of a data folder holds, None when none of this very database is known.

    The file that says it stays where a database is moved away, or an older backup is restored. Raises `sqlite3.Error`.
    """
    saved = _said(folder)
    if saved is None:
        return None
    row = db.execute("SELECT id FROM measurement WHERE seq = ?", (saved.newest_seq,)).fetchone()
    return saved if row and row[0] == saved.newest_id else None


def _said(folder: Path) -> SavedUntil | None:
    try:
        said = json.loads((folder / SAVED).read_text(encoding="utf-8"))
        return SavedUntil(said["made_at"], int(said["newest_seq"]), said["newest_id"], tuple(said["left_out"]))
    except (OSError, ValueError, KeyError, TypeError):
        return None
