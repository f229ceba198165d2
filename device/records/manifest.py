"""What every recording was when it was kept: its size and its hash, in the transaction that keeps its measurement.

By these a recording that was cut short, changed or lost is told, whatever its file system says of it. The hashes find
damage, not forgery. A recording of before there were manifests gets its entry as it is found, and says so by its time.
"""

from __future__ import annotations

import hashlib
import json
import os
import sqlite3
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from device.records.audit import utc_now

MANIFEST_TABLE = """
CREATE TABLE IF NOT EXISTS kept_recording
  (id TEXT PRIMARY KEY, size_bytes INTEGER NOT NULL, sha256 TEXT NOT NULL, noted_at TEXT NOT NULL, removed TEXT);
"""
CHUNK = 1 << 16


@dataclass(frozen=True)
class Fingerprint:
    """Size (bytes) and sha256 of a recording's file; of a folder those of all its files, by their names."""

    size_bytes: int
    sha256: str


@dataclass(frozen=True)
class ManifestEntry:
    """What is known of a recording. `removed` says when and by which rule it was deleted, None while it is kept."""

    fingerprint: Fingerprint
    noted_at: str
    removed: dict[str, Any] | None = None


def fingerprint_of(path: Path, *, from_disk: bool = False) -> Fingerprint:
    """Return the fingerprint of a file or folder; `from_disk`, where the kernel lets go of what it has in memory."""
    if path.is_file():
        return _of_file(path, from_disk=from_disk)
    digest, size_bytes = hashlib.sha256(), 0
    for file in sorted(one for one in path.rglob("*") if one.is_file()):
        of_one = _of_file(file, from_disk=from_disk)
        size_bytes += of_one.size_bytes
        digest.update(f"{file.relative_to(path).as_posix()} {of_one.size_bytes} {of_one.sha256}\n".encode())
    return Fingerprint(size_bytes, digest.hexdigest())


def _of_file(path: Path, *, from_disk: bool) -> Fingerprint:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        if from_disk and hasattr(os, "posix_fadvise"):
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        while piece := file.read(CHUNK):
            digest.update(piece)
        size_bytes = file.tell()
    return Fingerprint(size_bytes, digest.hexdigest())


def note_kept(db: sqlite3.Connection, recording_id: str, found: Fingerprint) -> None:
    """Keep what a recording is now, unless that is known already."""
    row = recording_id, found.size_bytes, found.sha256, utc_now()
    db.execute("INSERT OR IGNORE INTO kept_recording VALUES (?, ?, ?, ?, NULL)", row)


def note_removed(db: sqlite3.Connection, recording_id: str, why: str) -> None:
    """Keep that a recording is deleted from now on, and by which rule."""
    removed = json.dumps({"at": utc_now(), "why": why})
    db.execute("UPDATE kept_recording SET removed = ? WHERE id = ?", (removed, recording_id))


def manifest_of(db: sqlite3.Connection, recording_id: str | None = None) -> dict[str, ManifestEntry]:
    """Return what is known of every recording, or of one, by id."""
    query, values = "SELECT id, size_bytes, sha256, noted_at, removed FROM kept_recording", []
    if recording_id is not None:
        query, values = f"{query} WHERE id = ?", [recording_id]
    rows = db.execute(query, values)
    return {
        name: ManifestEntry(Fingerprint(size_bytes, sha256), at, removed and json.loads(removed))
        for name, size_bytes, sha256, at, removed in rows
    }
