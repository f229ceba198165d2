"""All that a probe's card holds and no release brings back, to one file, also while the daemon runs.

The database comes first, then the recordings: those that its rows name were on the disk before them. What comes after
that moment is in the next backup.
"""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Callable, Collection
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from device import __version__
from device.care.archive import ArchiveWriter, written_whole
from device.care.broken_off import WORK, remove_leftovers, target_held
from device.care.places import Places, data_files, links, settings_files
from device.care.snapshot import StoreFacts, copy_database
from device.config import Config
from device.errors import DiskFullError, StorageError
from device.files.durable import sync_directory, write_durably
from device.files.medium import MEMORY, medium_of
from device.files.plain_settings import as_booted, below
from device.measurement.quantities import InvalidQuantity
from device.records.audit import utc_now
from device.records.database import DATABASE
from device.records.saved import SAVED, SavedUntil, note_same_disk

SPARE_BYTES = 1 << 20
NOT_MOUNTED = "mount the stick first, as docs/care.md says, or say --same-disk for a copy that does not count as saved"


@dataclass(frozen=True)
class BackupReport:
    """What a backup holds; `missing` are recordings that rows name and nobody has, `left_out` what was not followed.

    `damaged` are recordings that are in it, but are not as they were kept. `unnoted`: why the data folder does not say
    that there is this backup, "" when it does; retention that waits for a backup then deletes nothing for it.
    `is_same_disk`: it lies on the data folder's own medium, or in memory, and does not count as saved.
    """

    path: str
    serial: str
    files: int
    size_bytes: int
    measurements: int
    missing: tuple[str, ...]
    damaged: tuple[str, ...]
    left_out: tuple[str, ...]
    unnoted: str
    is_same_disk: bool


def write_backup(
    config: Config,
    file: Path,
    root: Path = Path("/"),
    *,
    same_disk: bool = False,
    told: Callable[[str], None] = lambda _: None,
) -> BackupReport:
    """Write a backup of these settings' probe to a new file, whole and verified, or not at all.

    In a folder its name is the probe's with the time. Retention may delete then what it holds, if it has such a rule,
    unless it lies on the data folder's own medium: that needs `same_disk`, and never counts as saved. What a backup
    that was broken off has left there is removed first; `told` hears of it.

    Raises `InvalidQuantity` for a file that is there already, lies in what is saved or on its medium, `BusyError` while
    another backup is written there, `StorageError` when something cannot be read or written.
    """
    places = Places.of(config)
    data = below(root, places.data)
    file = _named(file, config.serial)
    _require_new(file, data)
    if not (data / DATABASE).is_file():
        remedy = "Correct the setting `data`, or state the card with --root."
        raise StorageError(f"There is no database in the data folder {data}.", remedy)
    is_same_disk = medium_of(file.parent) in {medium_of(data), MEMORY}
    if is_same_disk and not same_disk:
        raise InvalidQuantity("backup", file, f"on another medium than {data}, and not in memory", NOT_MOUNTED)
    try:
        with target_held(file.parent) as is_held:
            if is_held:
                remove_leftovers(file.parent, config.serial, told)
            if is_same_disk:
                note_same_disk(data, as_booted(file, root))  # before it is there: an erasure is to find it
            with TemporaryDirectory(dir=file.parent, prefix=f"{WORK}{config.serial}-") as work:
                return _written(config, places, root, file, Path(work), is_same_disk=is_same_disk)
    except OSError as error:
        cause = f"The backup could not be written: {error}."
        raise StorageError(cause, "Use a medium that is large enough and has no limit of 4 GB a file.") from error


def _written(config: Config, places: Places, root: Path, file: Path, work: Path, *, is_same_disk: bool) -> BackupReport:
    data, copy, whole = below(root, places.data), work / DATABASE, work / file.name
    facts = copy_database(data, copy)
    files = {f"data/{DATABASE}": copy, **_files(places, root)}
    size_bytes = sum(path.stat().st_size for path in files.values())
    _require_space(file.parent, size_bytes)
    missing = tuple(one for one in facts.recordings if not _is_in(files, f"data/recordings/{one}"))
    with written_whole(whole) as stream:
        writer = ArchiveWriter(stream)
        for name, path in files.items():
            writer.add(name, path)
        writer.close(_described(config, places, facts, missing))
    whole.replace(file)
    sync_directory(file.parent)
    damaged = tuple(facts.damaged(writer.entries))
    unnoted = "" if is_same_disk else _note_saved(data, facts, (*missing, *damaged), as_booted(file, root))
    return BackupReport(
        path=str(file),
        serial=config.serial,
        files=len(files),
        size_bytes=size_bytes,
        measurements=facts.measurements,
        missing=missing,
        damaged=damaged,
        left_out=tuple(links(data)),
        unnoted=unnoted,
        is_same_disk=is_same_disk,
    )


def _named(file: Path, serial: str) -> Path:
    """Return the file itself, or a new one in a folder that is named."""
    if not file.is_dir():
        return file
    return file / f"{serial}-{datetime.now(UTC).strftime('%Y%m%dT%H%M%SZ')}.backup"


def _note_saved(data: Path, facts: StoreFacts, left_out: tuple[str, ...], place: str) -> str:
    """Note in the data folder what a backup holds; return why that could not be, "" when it was.

    A card that can only be read needs no retention.
    """
    if not facts.newest:
        return ""
    saved = SavedUntil(utc_now(), *facts.newest, left_out, place)
    try:
        write_durably(data / SAVED, json.dumps(saved.as_record()).encode())
    except OSError as error:
        return "" if error.errno == errno.EROFS else f"{data / SAVED} cannot be written ({error.strerror or error})"
    return ""


def _is_in(files: Collection[str], recording: str) -> bool:
    """Return whether a recording is among the files, as a .zip or as a folder."""
    return f"{recording}.zip" in files or f"{recording}/recording.json" in files


def _files(places: Places, root: Path) -> dict[str, Path]:
    """Return every file but the database, by its name in the backup."""
    files = dict(settings_files(root))
    files |= {f"data/{name}": path for name, path in data_files(below(root, places.data))}
    if places.calibration:
        files |= {f"calibration/{name}": path for name, path in _tree(below(root, places.calibration))}
    for setting, folder in places.models.items():
        files |= {f"models/{setting}/{name}": path for name, path in _tree(below(root, folder))}
    return files


def _tree(path: Path) -> list[tuple[str, Path]]:
    """Return the files of a folder, or a file alone, by their names."""
    return [(path.name, path)] if path.is_file() else list(data_files(path))


def _described(config: Config, places: Places, facts: StoreFacts, missing: tuple[str, ...]) -> dict[str, Any]:
    return {
        "serial": config.serial,
        "software": __version__,
        "made_at": datetime.now(UTC).isoformat(timespec="seconds").replace("+00:00", "Z"),
        "store_schema": facts.schema,
        "measurements": facts.measurements,
        "presses": facts.presses,
        "missing_recordings": missing,
        "places": places.as_record(),
    }


def _require_new(file: Path, data: Path) -> None:
    if file.exists():
        raise InvalidQuantity("backup", file, "a new file", "choose another name")
    if not file.parent.is_dir():
        raise InvalidQuantity("backup", file, "in a folder that is there", "make the folder, or plug in the medium")
    if file.resolve().is_relative_to(data.resolve()):
        raise InvalidQuantity("backup", file, f"outside of what it saves, {data}", "choose another medium")


def _require_space(folder: Path, size_bytes: int) -> None:
    free_bytes = shutil.disk_usage(folder).free
    if free_bytes < size_bytes + SPARE_BYTES:
        cause = f"The backup takes {size_bytes / 1e6:.0f} MB; {folder} has {free_bytes / 1e6:.0f} MB left."
        raise DiskFullError(cause, "Use a larger medium.")
