"""A backup back to a card, whole or not at all, and nothing that is there is lost.

First everything is written beside its place and read again; only then are files moved into place, the database last:
until that moment no measurement of the backup is to be seen, and the same command again finishes what a power cut left.
What stood in a place is moved into the folder `before-restore`, never deleted. The daemon must not run meanwhile.
"""

from __future__ import annotations

import fcntl
import json
import os
import pwd
import re
import shutil
import sqlite3
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import chain, count
from pathlib import Path
from typing import Any

from device.care.archive import Archive, BackupEntry
from device.care.places import MODEL_SETTINGS
from device.care.snapshot import StoreFacts, facts_of
from device.errors import BusyError, DiskFullError, StorageError
from device.files.durable import sync_directory, write_durably
from device.files.file_reader import DAEMON_USER
from device.files.medium import MEMORY, medium_of
from device.files.plain_settings import LOCAL, as_booted, below
from device.measurement.quantities import InvalidQuantity
from device.records.audit import utc_now
from device.records.database import DATABASE
from device.records.manifest import fingerprint_of
from device.records.saved import SAVED, SavedUntil
from device.records.schema import STORE_READS
from device.records.tokens import note_revoked
from device.settings.catalogue import SETTINGS

STAGED, ASIDE = "restore.tmp", "before-restore"
STATE_FOLDERS = (Path("/var/lib"), Path("/srv"))
"""Only below these may a backup bring files of its own accord; anywhere else this machine's settings must say so."""
SETTINGS_FILES = re.compile(r"config\.toml|config\.d/[^./][^/]*\.toml")
SPARE_BYTES = 1 << 20
RESTORED = "restored from a backup: pair again"


@dataclass(frozen=True)
class RestoreReport:
    """What was restored; `kept_aside` is where each thing lies now that stood in a place before."""

    serial: str
    made_at: str
    files: int
    measurements: int
    presses: int
    data: str
    kept_aside: tuple[str, ...]


def check_backup(file: Path) -> dict[str, Any]:
    """Return what a backup says of itself once every byte has been read; raise `InvalidQuantity` when it is damaged."""
    with Archive(file) as archive:
        archive.verify()
        return {name: value for name, value in archive.manifest.items() if name != "entries"}


def restore_backup(
    file: Path, own: Mapping[str, Any], root: Path = Path("/"), *, records_only: bool = False
) -> RestoreReport:
    """Bring a backup to the machine below `root`; with `records_only` its measurements and recordings alone.

    `own` is what this machine's settings files say, by their full names; nothing for a fresh card.
    Raises `InvalidQuantity` for a backup that is damaged, of another probe (unless `records_only`) or of a newer store,
    and for a data folder that holds something else; `BusyError` while a daemon runs; `StorageError` when the disk does
    not take it: then no measurement is there yet, and the same command finishes it.
    """
    with Archive(file) as archive:
        archive.verify()
        _require_fitting(archive, own, records_only=records_only)
        targets = _Targets(archive.manifest, own, root, records_only=records_only)
        wanted = {entry.name: entry for entry in archive.entries.values() if targets.wants(entry.name)}
        for name in wanted:
            targets.of(name)  # refuses what has no place here before anything is written
        with daemon_kept_out(targets.data):
            _require_nothing_lost(targets.data, wanted)
            _require_room(targets, wanted.values())
            try:
                return _restored(archive, targets, wanted)
            except OSError as error:
                cause = f"The backup could not be restored: {error}."
                raise StorageError(
                    cause, "Nothing was replaced that is not whole: mend it and restore again."
                ) from error


class _Targets:
    """Where each file of a backup belongs on this machine."""

    def __init__(self, manifest: Mapping[str, Any], own: Mapping[str, Any], root: Path, *, records_only: bool) -> None:
        self.root, self._records_only = root, records_only
        try:
            stated = manifest["places"]
            self._places = {"data": stated["data"], "calibration": stated["calibration"], **stated["models"]}
        except (KeyError, TypeError) as error:
            raise InvalidQuantity("backup.places", "missing", "given", "take another backup") from error
        if records_only:  # this probe's own folder, wherever the other one has its own; nothing else is restored
            self._places = {"data": str(own.get("data", SETTINGS["data"].default))}
        for name, place in self._places.items():
            if place is not None:
                _require_place(name, Path(place), own)
        self.data = self._place("data")

    def wants(self, name: str) -> bool:
        """Return whether a file of the backup is to be restored."""
        if self._records_only:
            return name == f"data/{DATABASE}" or name.startswith("data/recordings/")
        return True

    def of(self, name: str) -> Path:
        """Return where a file of the backup belongs."""
        section, _, rest = name.partition("/")
        if section == "data":
            return self.data / rest
        if section == "settings":
            if not SETTINGS_FILES.fullmatch(rest):  # beside them lie the keys whose releases this probe trusts
                raise InvalidQuantity("backup", name, "a settings file of a probe", "take another backup")
            return (self.root / LOCAL).parent / rest
        if section == "models":
            setting, _, rest = rest.partition("/")
            return self._place(setting) / rest
        folder = self._place("calibration")
        return folder if folder.name == rest else folder / rest

    def _place(self, name: str) -> Path:
        place = self._places.get(name)
        if place is None:
            raise InvalidQuantity(f"backup.places.{name}", "missing", "given", "take another backup")
        return below(self.root, Path(place))


def _require_fitting(archive: Archive, own: Mapping[str, Any], *, records_only: bool) -> None:
    manifest = archive.manifest
    schema, serial = manifest.get("store_schema"), manifest.get("serial")
    if schema not in STORE_READS:
        bound = f"{', '.join(map(str, STORE_READS))}, which this software reads"
        raise InvalidQuantity("backup.store_schema", schema, bound, "install the release that wrote it, or a newer one")
    if f"data/{DATABASE}" not in archive.entries:
        raise InvalidQuantity("backup", archive.path, "one with a database", "take another backup")
    if not records_only and "serial" in own and own["serial"] != serial:
        action = (
            "settings, certificates and models are of that probe's own parts: add --records-only for its measurements"
        )
        raise InvalidQuantity("backup.serial", serial, f"{own['serial']}, as this probe's settings say", action)


def _require_place(name: str, place: Path, own: Mapping[str, Any]) -> None:
    """Refuse a place that neither is one for a program's data nor is named by this machine's own settings."""
    stated = {Path(str(own.get(setting, ""))) for setting in ("data", "calibration", *MODEL_SETTINGS)}
    is_state = any(place.is_relative_to(folder) and place != folder for folder in STATE_FOLDERS)
    if ".." in place.parts or not (is_state or place in stated):
        bound = f"below {' or '.join(map(str, STATE_FOLDERS))}, or what this machine's settings say"
        raise InvalidQuantity(f"backup.places.{name}", place, bound, f"set `{name}` in this machine's settings first")


@contextmanager
def daemon_kept_out(data: Path) -> Iterator[None]:
    """Hold the data folder's lock; raise `BusyError` while a daemon has it."""
    data.mkdir(parents=True, exist_ok=True)
    # Root must not follow a link that lies in the daemon's own folder.
    with os.fdopen(os.open(data / "lock", os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o640), "w") as lock:
        _give(data / "lock", data)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise BusyError(f"A daemon runs on {data}.", "Stop it first: systemctl stop tsis.") from None
        yield


def _require_nothing_lost(data: Path, wanted: Mapping[str, BackupEntry]) -> None:
    """Refuse a data folder with measurements, or with a recording that the backup does not bring back just so."""
    if (data / DATABASE).exists() and (there := _measurements(data / DATABASE)):
        raise _not_empty(data, f"{there} measurements")
    for path in sorted((data / "recordings").rglob("*")):
        name = path.relative_to(data)
        is_unfinished = any(part.endswith(".tmp") for part in name.parts)
        if is_unfinished or (path.is_dir() and not path.is_symlink()):
            continue
        entry = wanted.get(f"data/{name.as_posix()}")
        if entry is None or path.is_symlink() or _sha256_of(path) != entry.sha256:
            raise _not_empty(data, name.as_posix())


def _measurements(database: Path) -> int:
    """Return how many measurements are in a database that is there, and leave nothing beside it."""
    try:
        with closing(sqlite3.connect(database)) as db:
            [rows] = db.execute("SELECT count(*) FROM measurement").fetchone()
    except sqlite3.Error as error:
        raise StorageError(
            f"The database {database} is there and cannot be read: {error}.", "Move it away first; it is not deleted."
        ) from error
    return int(rows)


def _not_empty(data: Path, what: str) -> InvalidQuantity:
    return InvalidQuantity("data folder", data, f"empty, but it holds {what}", "save that and move it away first")


def _require_room(targets: _Targets, entries: Collection[BackupEntry]) -> None:
    """Refuse before anything is written what could not be written to its end."""
    size_bytes, free_bytes = sum(entry.size for entry in entries), shutil.disk_usage(targets.data).free
    if free_bytes < size_bytes + SPARE_BYTES:
        cause = f"The backup takes {size_bytes / 1e6:.0f} MB; {targets.data} has {free_bytes / 1e6:.0f} MB left."
        raise DiskFullError(cause, "Use a larger card.")
    for folder in sorted({targets.of(entry.name).parent for entry in entries}):
        there = next(one for one in (folder, *folder.parents) if one.exists())
        if not os.access(there, os.W_OK):
            raise StorageError(f"{folder} cannot be written by this user.", "Run it as root: sudo.")


def _restored(archive: Archive, targets: _Targets, wanted: Mapping[str, BackupEntry]) -> RestoreReport:
    data, manifest, database = targets.data, archive.manifest, f"data/{DATABASE}"
    staged, aside = data / STAGED, list[Path]()
    shutil.rmtree(staged, ignore_errors=True)
    try:
        for entry in wanted.values():
            _stage(archive, entry, staged / entry.name)
        facts = _facts(staged / database, manifest)
        _revoke_tokens(staged / database)
        names = wanted.keys() - {database} | _note_saved(archive, facts, staged, targets)
        for name in sorted(names):
            aside += _placed(staged / name, targets.of(name), data)
        _give_all_to_daemon(data)
        for folder in [data, *(path for path in data.rglob("*") if path.is_dir())]:
            sync_directory(folder)
        # What was not closed in the old database would be taken for the new one's: it goes with it.
        for old in (data / f"{DATABASE}{end}" for end in ("-wal", "-shm")):
            aside += _moved_aside(old, data)
        aside += _placed(staged / database, data / DATABASE, data)
        sync_directory(data)
    finally:
        shutil.rmtree(staged, ignore_errors=True)
    made_at, serial = str(manifest.get("made_at")), str(manifest.get("serial"))
    return RestoreReport(
        serial, made_at, len(wanted), facts.measurements, facts.presses, str(data), tuple(map(str, aside))
    )


def _stage(archive: Archive, entry: BackupEntry, path: Path) -> None:
    """Write a file beside its place, and read it again from the disk; raise `OSError` when it is another one there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        for piece in archive.chunks(entry):
            file.write(piece)
        file.flush()
        os.fsync(file.fileno())
    path.chmod(entry.mode & 0o755)
    if _sha256_of(path) != entry.sha256:
        raise OSError(f"{path} reads otherwise than it was written: the card is worn or forged")


def _sha256_of(path: Path) -> str:
    return fingerprint_of(path, from_disk=True).sha256


def _facts(database: Path, manifest: Mapping[str, Any]) -> StoreFacts:
    facts = facts_of(database)
    for what, name, found in (
        ("measurements", "measurements", facts.measurements),
        ("schema", "store_schema", facts.schema),
    ):
        if found != (said := manifest.get(name)):
            bound = f"{said}, as its manifest says"
            raise InvalidQuantity(f"{what} in the backup", found, bound, "take another backup")
    return facts


def _note_saved(archive: Archive, facts: StoreFacts, staged: Path, targets: _Targets) -> set[str]:
    """Write beside its place what the backup holds, unless it would be lost with the card; return the file's name."""
    if not facts.newest or medium_of(archive.path.resolve().parent) in {medium_of(targets.data), MEMORY}:
        return set()
    manifest, name = archive.manifest, f"data/{SAVED}"
    left_out = *manifest.get("missing_recordings", ()), *facts.damaged(archive.entries.values())
    place = as_booted(archive.path, targets.root)
    saved = SavedUntil(str(manifest["made_at"]), *facts.newest, left_out, place)
    write_durably(staged / name, json.dumps(saved.as_record()).encode())
    return {name}


def _revoke_tokens(database: Path) -> None:
    """Let no token of a backup hold: one that was revoked since would hold again, and another probe's on this one."""
    with closing(sqlite3.connect(database)) as db, db:
        if not db.execute("SELECT 1 FROM sqlite_master WHERE name = 'token'").fetchone():
            return  # of a release that had none
        for (token_id,) in db.execute("SELECT id FROM token WHERE revoked_at IS NULL").fetchall():
            note_revoked(db, token_id, utc_now(), RESTORED)


def _placed(staged: Path, target: Path, data: Path) -> list[Path]:
    """Move a file into its place; return where what stood there lies now, if it was another file."""
    if target.is_file() and not target.is_symlink() and _sha256_of(target) == _sha256_of(staged):
        return []
    target.parent.mkdir(parents=True, exist_ok=True)
    if not target.is_relative_to(data):
        staged = _brought_beside(staged, target)
    aside = _moved_aside(target, data)
    staged.replace(target)
    sync_directory(target.parent)
    return aside


def _brought_beside(staged: Path, target: Path) -> Path:
    """Copy a file beside its place, which may be of another file system; it belongs to whom the folder does."""
    beside = target.with_name(f"{target.name}.{STAGED}")
    shutil.copyfile(staged, beside)
    with beside.open("rb") as file:
        os.fsync(file.fileno())
    beside.chmod(staged.stat().st_mode & 0o755)
    _give(beside, target.parent)
    return beside


def _moved_aside(path: Path, data: Path) -> list[Path]:
    """Move what stands in a place to a name that is free; return that, or nothing when nothing stands there."""
    if not (path.exists() or path.is_symlink()):
        return []
    is_data = path.is_relative_to(data)
    wanted = data / ASIDE / path.relative_to(data) if is_data else path.with_name(f"{path.name}.{ASIDE}")
    wanted.parent.mkdir(parents=True, exist_ok=True)
    numbered = (wanted.with_name(f"{wanted.name}.{number}") for number in count(2))
    free = next(one for one in chain([wanted], numbered) if not one.exists())
    path.rename(free)
    return [free]


def _give_all_to_daemon(data: Path) -> None:
    """Let all in the data folder belong to its owner, or to the daemon's user where that is root as yet."""
    if os.geteuid() == 0 and data.stat().st_uid == 0:
        with suppress(LookupError):
            user = pwd.getpwnam(DAEMON_USER)
            os.chown(data, user.pw_uid, user.pw_gid)
    for path in data.rglob("*"):
        _give(path, data)


def _give(path: Path, like: Path) -> None:
    """Let a path belong to whom another one does; only root can."""
    if os.geteuid() == 0:
        owner = like.stat()
        os.chown(path, owner.st_uid, owner.st_gid, follow_symlinks=False)
