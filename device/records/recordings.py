"""The recordings beside the database: written once, handed out only as they were kept, looked through at each start.

One that is missing or changed is told by its id and never handed out as whole. What a kill left is put in order: a half
written one is removed; a whole one that no measurement names, for the kill came before its row, is set aside in
`orphans`. One that retention has removed in the database only is removed.
"""

from __future__ import annotations

import errno
import logging
import sqlite3
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

from device.errors import DamagedRecordingError, DeletedRecording, OrphanedRecordings
from device.files.durable import sync_directory
from device.files.recording_file import remove_recording
from device.records.manifest import Fingerprint, ManifestEntry, fingerprint_of, manifest_of, note_kept

log = logging.getLogger(__name__)
RECORDINGS, ORPHANS = "recordings", "orphans"
OF_THE_DAEMON = (errno.EMFILE, errno.ENFILE, errno.ENOMEM)
"""What the daemon lacks just now, and no recording does."""
RESTORE = "Restore it from a backup."
MOST_NAMED = 3
"""So many ids are named of many; the log has them all."""
Transaction = Callable[[], AbstractContextManager[sqlite3.Connection]]


@dataclass(frozen=True)
class StartFindings:
    """What a start has found: recordings by id, and how many half written files it has removed."""

    missing: tuple[str, ...] = ()
    resized: tuple[str, ...] = ()
    orphans: tuple[str, ...] = ()
    unfinished: int = 0

    def warnings(self) -> tuple[DamagedRecordingError | OrphanedRecordings, ...]:
        """Return what the operator is told of it."""
        told: list[DamagedRecordingError | OrphanedRecordings] = []
        if damaged := (*self.missing, *self.resized):
            told.append(damaged_recordings(damaged))
        if self.orphans:
            cause = f"{_counted(self.orphans)} without a measurement: a press that was never told of as done."
            told.append(OrphanedRecordings(cause, f"They lie in `{ORPHANS}` of the data folder; no result is missing."))
        return tuple(told)


def damaged_recording(recording_id: str) -> DamagedRecordingError:
    """Return the fault of a recording that is not as it was kept."""
    return DamagedRecordingError(f"The recording {recording_id} is damaged: not as it was kept.", RESTORE)


def damaged_recordings(identifiers: tuple[str, ...]) -> DamagedRecordingError:
    """Return the warning of recordings that are missing or not as they were kept."""
    cause = f"{_counted(identifiers)} missing or not as it was kept; the numbers measured from it are."
    return DamagedRecordingError(cause, f"{RESTORE} If it comes back, have the probe's card replaced.")


class KeptRecordings:
    """The recordings of a store. All methods may be called from any thread."""

    def __init__(self, folder: Path, transaction: Transaction) -> None:
        """Take the data folder and how a transaction of its store is begun."""
        self._data, self.folder, self._transaction = folder, folder / RECORDINGS, transaction

    def place_of(self, recording_id: str) -> Path:
        """Return where a new recording is written."""
        return self.folder / f"{recording_id}.zip"

    def path(self, recording_id: str) -> Path:
        """Return where a recording lies, a .zip or a folder, once it was read and found to be as it was kept.

        Raises `DamagedRecordingError` when it is missing or is not, `DeletedRecording` for what a rule has deleted.
        """
        with self._transaction() as db:
            known = manifest_of(db, recording_id).get(recording_id)
        if known and known.removed:
            cause = f"The recording {recording_id} was deleted at {known.removed['at']}: {known.removed['why']}."
            raise DeletedRecording(cause, "Its numbers are kept; the recording may be in a backup.")
        path = self._found(recording_id)
        if path is None:
            raise DamagedRecordingError(f"The recording {recording_id} is missing.", RESTORE)
        if known and _read(path) != known.fingerprint:
            raise damaged_recording(recording_id)
        return path

    def check(self, recording_id: str) -> bool:
        """Return whether the disk has a recording as it was kept; one of before there were manifests gets its entry."""
        with self._transaction() as db:
            known = manifest_of(db, recording_id).get(recording_id)
        path = self._found(recording_id)
        if known and known.removed:
            return True
        found = path and _read(path, from_disk=True)
        if known or not found:
            return bool(known and found == known.fingerprint)
        with self._transaction() as db:
            note_kept(db, recording_id, found)
        return True

    def remove(self, recording_id: str) -> None:
        """Remove the file of a recording that the manifest says is deleted; a start does what a kill leaves of that."""
        if path := self._found(recording_id):
            remove_recording(path)
            sync_directory(self.folder)

    def newest(self) -> list[str]:
        """Return the recordings that measurements name, newest first."""
        query = "SELECT json_extract(record, '$.recording_id') FROM measurement ORDER BY seq DESC"
        with self._transaction() as db:
            return [row[0] for row in db.execute(query) if row[0]]

    def unnoted(self) -> list[str]:
        """Return the recordings that measurements name and the manifest does not: of before there was one."""
        with self._transaction() as db:
            known = manifest_of(db)
        return [name for name in self.newest() if name not in known]

    def look_through(self) -> StartFindings:
        """Put in order what a kill left, and compare what there is with the manifest by name and size."""
        unfinished = self._remove_unfinished()
        named = dict.fromkeys(self.newest())
        with self._transaction() as db:
            manifest = manifest_of(db)
        files = {path.name.removesuffix(".zip"): path for path in self.folder.iterdir()}
        self._finish_removing(manifest, files)
        kept = {name for name in (*named, *manifest) if not (name in manifest and manifest[name].removed)}
        there = [name for name in named if name in kept and name in files]
        findings = StartFindings(
            missing=tuple(name for name in named if name in kept and name not in files),
            resized=tuple(name for name in there if _is_resized(files[name], manifest)),
            # Without any measurement the database is a new one, and a restore may be under way.
            orphans=self._set_aside([files[name] for name in files if name not in kept]) if named else (),
            unfinished=unfinished,
        )
        _tell(findings)
        return findings

    def _remove_unfinished(self) -> int:
        """Remove what a kill or a power cut left half written; nobody was ever told of it."""
        unfinished = [*self.folder.glob("*.tmp"), *self._data.glob("*.tmp")]
        for path in unfinished:
            remove_recording(path)
        return len(unfinished)

    def _finish_removing(self, manifest: dict[str, ManifestEntry], files: dict[str, Path]) -> None:
        for name in [name for name in files if name in manifest and manifest[name].removed]:
            remove_recording(files.pop(name))

    def _set_aside(self, paths: list[Path]) -> tuple[str, ...]:
        aside = self._data / ORPHANS
        for path in paths:
            aside.mkdir(exist_ok=True)
            path.rename(aside / path.name)
        if paths:
            sync_directory(aside)
            sync_directory(self.folder)
        return tuple(path.name for path in paths)

    def _found(self, recording_id: str) -> Path | None:
        path = self.place_of(recording_id)
        folder = path.with_suffix("")
        if path.is_file():
            return path
        return folder if (folder / "recording.json").is_file() else None


def _read(path: Path, *, from_disk: bool = False) -> Fingerprint | None:
    """Return the fingerprint of a recording, None where it cannot be read; raise `OSError` where that says nothing."""
    try:
        return fingerprint_of(path, from_disk=from_disk)
    except OSError as error:
        if error.errno in OF_THE_DAEMON:
            raise
        log.error("%s cannot be read: %s", path, error)
        return None


def _is_resized(path: Path, manifest: dict[str, ManifestEntry]) -> bool:
    """Return whether a .zip is of another size than was kept; a folder's is looked at when it is read."""
    known = manifest.get(path.name.removesuffix(".zip"))
    return known is not None and path.is_file() and path.stat().st_size != known.fingerprint.size_bytes


def _tell(findings: StartFindings) -> None:
    for what, names in (("missing", findings.missing), ("of another size", findings.resized)):
        for name in names:
            log.error("the recording %s is %s", name, what)
    for name in findings.orphans:
        log.warning("the recording %s belongs to no measurement: set aside in %s", name, ORPHANS)
    if findings.unfinished:
        log.info("%d half written files were removed", findings.unfinished)


def _counted(names: tuple[str, ...]) -> str:
    shown = ", ".join(name.removesuffix(".zip") for name in names[:MOST_NAMED])
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{len(names)} recording{'s' if len(names) > 1 else ''} ({shown}{more})"
