"""The database of measurements to a copy of one moment, also while a daemon writes it, and what such a copy holds.

Source: SQLite, "Online Backup API": the copy is that of one transaction, whatever is written meanwhile.
"""

from __future__ import annotations

import json
import os
import shutil
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory

from device.care.archive import PRIVATE, BackupEntry
from device.errors import StorageError
from device.records.database import DATABASE
from device.records.manifest import manifest_of
from device.records.schema import MANIFEST_SINCE, UNNUMBERED

BUSY_S = 10.0
DAMAGED = "Copy the folder of recordings away by hand, and send the support file: python -m device support FILE."


@dataclass(frozen=True)
class StoreFacts:
    """What a database holds: schema, number of measurements and presses, and the recordings that it names and keeps.

    `newest`: number and id of the last measurement; `hashes`: sha256 of each recording, where it was kept.
    """

    schema: int
    measurements: int
    presses: int
    recordings: tuple[str, ...]
    newest: tuple[int, str] | None = None
    hashes: Mapping[str, str] = field(default_factory=dict)

    def damaged(self, entries: Iterable[BackupEntry]) -> Iterator[str]:
        """Yield the recordings that are among a backup's files and are not as they were kept."""
        for entry in entries:
            name = entry.name.removeprefix("data/recordings/").removesuffix(".zip")
            if entry.name.endswith(".zip") and name in self.hashes and entry.sha256 != self.hashes[name]:
                yield name


def copy_database(folder: Path, target: Path) -> StoreFacts:
    """Copy the database of a data folder to a new file and look at the copy; raise `StorageError` when it is damaged.

    A folder that cannot be written, as on a card that is mounted to be read, is copied first: SQLite would have to
    write beside a database that was not closed.
    """
    try:
        if os.access(folder, os.W_OK):
            _copy(folder / DATABASE, target)
        else:
            with TemporaryDirectory(dir=target.parent) as own:
                for name in (DATABASE, f"{DATABASE}-wal"):
                    if (folder / name).exists():
                        _make_private(Path(own) / name)
                        shutil.copyfile(folder / name, Path(own) / name)
                _copy(Path(own) / DATABASE, target)
        return facts_of(target)
    except sqlite3.Error as error:
        raise StorageError(f"The database {folder / DATABASE} cannot be copied: {error}.", DAMAGED) from error


def facts_of(database: Path) -> StoreFacts:
    """Return what a database holds once it has proved whole; raise `StorageError` when it is not."""
    try:
        with closing(_opened(database)) as db:
            [verdict] = db.execute("PRAGMA integrity_check(1)").fetchone()
            if verdict != "ok":
                raise StorageError(f"The database {database} is damaged: {verdict}.", DAMAGED)
            [schema] = db.execute("PRAGMA user_version").fetchone()
            rows = [json.loads(row) for (row,) in db.execute("SELECT record FROM measurement")]
            newest = db.execute("SELECT seq, id FROM measurement ORDER BY seq DESC LIMIT 1").fetchone()
            manifest = manifest_of(db) if schema >= MANIFEST_SINCE else {}
            [presses] = db.execute("SELECT count(*) FROM press").fetchone()
    except (sqlite3.Error, ValueError) as error:
        raise StorageError(f"The database {database} cannot be read: {error}.", DAMAGED) from error
    deleted = {name for name, entry in manifest.items() if entry.removed}
    named = dict.fromkeys(str(row["recording_id"]) for row in rows if row.get("recording_id", "") not in {"", *deleted})
    hashes = {name: entry.fingerprint.sha256 for name, entry in manifest.items() if name not in deleted}
    return StoreFacts(schema or UNNUMBERED, len(rows), presses, tuple(named), newest, hashes)


def _make_private(path: Path) -> None:
    """Make an empty file that nobody but its owner reads: a backup that is killed leaves it."""
    os.close(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE))


def _copy(source: Path, target: Path) -> None:
    _make_private(target)
    with closing(_opened(source)) as db, closing(sqlite3.connect(target)) as copy:
        db.backup(copy)
        copy.execute("PRAGMA journal_mode = DELETE")  # one file, with nothing beside it


def _opened(database: Path) -> sqlite3.Connection:
    """Open a database that is there: to be written, for one that was not closed is put in order first."""
    return sqlite3.connect(f"file:{database.resolve().as_posix()}?mode=rw", uri=True, timeout=BUSY_S)
