"""What the last backup of a data folder holds, as `device.care.backup` notes it there once it is read back."""

from __future__ import annotations

import json
import sqlite3
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from device.files.durable import write_durably

SAVED = "saved.json"
SAME_DISK = "same_disk.json"
"""Where backups lie that were made on the data folder's own medium: those save nothing, and hold patients' data."""

NO_CLOCK = "2000"
OLDEST = """
SELECT json_extract(record, '$.taken_at') AS at FROM measurement WHERE seq > ? AND at > ? AND at <= ?
ORDER BY seq LIMIT 1
"""


@dataclass(frozen=True)
class SavedUntil:
    """What the last backup holds: all measurements up to a number, but for recordings that were damaged or missing.

    `path`: where it was written, "" of one of an earlier release.
    """

    made_at: str
    newest_seq: int
    newest_id: str
    left_out: tuple[str, ...] = ()
    path: str = ""

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object."""
        return asdict(self)


def saved_until(db: sqlite3.Connection, folder: Path) -> SavedUntil | None:
    """Return what the last backup of a data folder holds, None when none of this very database is known.

    The file that says it stays where a database is moved away, or an older backup is restored. Raises `sqlite3.Error`.
    """
    saved = said_saved(folder)
    if saved is None:
        return None
    row = db.execute("SELECT id FROM measurement WHERE seq = ?", (saved.newest_seq,)).fetchone()
    return saved if row and row[0] == saved.newest_id else None


@dataclass(frozen=True)
class Unsaved:
    """How many measurements no backup holds, since when (RFC 3339), and when the last backup was made; None: unknown.

    `since` is when the oldest of them was taken, or the last backup made, if that is later.
    """

    count: int
    since: str | None
    saved_at: str | None


def unsaved(db: sqlite3.Connection, folder: Path, now: str) -> Unsaved:
    """Return what no backup of a data folder holds. Raises `sqlite3.Error`.

    What was taken by a clock that was ahead of `now`, or had no time at all (1970), says nothing of its age.
    """
    saved = saved_until(db, folder)
    newest_seq = saved.newest_seq if saved else 0
    [count] = db.execute("SELECT count(*) FROM measurement WHERE seq > ?", (newest_seq,)).fetchone()
    oldest = db.execute(OLDEST, (newest_seq, NO_CLOCK, now)).fetchone()
    made_at = (saved.made_at,) if saved and saved.made_at <= now else ()
    return Unsaved(count, max((oldest[0], *made_at)) if oldest else None, saved.made_at if saved else None)


def said_saved(folder: Path) -> SavedUntil | None:
    """Return what a data folder says of its last backup, of whichever database that was; None when it says nothing."""
    try:
        said = json.loads((folder / SAVED).read_text(encoding="utf-8"))
        datetime.fromisoformat(said["made_at"])
        newest = int(said["newest_seq"]), said["newest_id"]
        return SavedUntil(said["made_at"], *newest, tuple(said["left_out"]), str(said.get("path", "")))
    except (OSError, ValueError, KeyError, TypeError):
        return None


def same_disk_backups(folder: Path) -> tuple[str, ...]:
    """Return where backups were written on a data folder's own medium, as far as it says."""
    try:
        said = json.loads((folder / SAME_DISK).read_text(encoding="utf-8"))
        return tuple(map(str, said["backups"]))
    except (OSError, ValueError, KeyError, TypeError):
        return ()


def note_same_disk(folder: Path, path: str) -> None:
    """Note a backup on the data folder's own medium; raise `OSError` when that cannot be written."""
    noted = dict.fromkeys((*same_disk_backups(folder), path))
    write_durably(folder / SAME_DISK, json.dumps({"backups": list(noted)}).encode())
