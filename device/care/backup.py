"""All that a probe's card holds and no release brings back, to one file, also while the daemon runs.

The database comes first, then the recordings: those that its rows name were on the disk before them. What comes after
that moment is in the next backup.
"""

from __future__ import annotations

import errno
import json
import shutil
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from device import __version__
from device.care.archive import ArchiveWriter, BackupEntry, written_whole
from device.care.places import Places, data_files, links, settings_files
from device.care.snapshot import StoreFacts, copy_database
from device.config import Config
from device.errors import DiskFullError, StorageError
from device.files.durable import write_durably
from device.files.plain_settings import below
from device.measurement.quantities import InvalidQuantity
from device.records.audit import utc_now
from device.records.database import DATABASE
from device.records.saved import SAVED, SavedUntil

SPARE_BYTES = 1 << 20


@dataclass(frozen=True)
class BackupReport:
    """What a backup holds; `missing` are recordings that rows name and nobody has, `left_out` what was not followed.

    `damaged` are recordings that are in it, but are not as they were kept. `unnoted`: why the data folder does not say
    that there is this backup, "" when it does; retention that waits for a backup then deletes nothing for it.
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


def write_backup(config: Config, file: Path, root: Path = Path("/")) -> BackupReport:
    """Write a backup of these settings' probe to a new file, whole and verified, or not at all.

    In a folder its name is the probe's with the time. Retention may delete then what it holds, if it has such a rule.

    Raises `InvalidQuantity` for a file that is there already or lies in what is saved, `StorageError` when something
    cannot be read or written.
    """
    places = Places.of(config)
    data = below(root, places.data)
    file = _named(file, config.serial)
    _require_new(file, data)
    if not (data / DATABASE).is_file():
        remedy = "Correct the setting `data`, or state the card with --root."
        raise StorageError(f"There is no database in the data folder {data}.", remedy)
    try:
        with TemporaryDirectory(dir=file.parent, prefix=".tsis-backup-") as folder:
            return _written(config, places, root, file, Path(folder) / DATABASE)
    except OSError as error:
        cause = f"The backup could not be written: {error}."
        raise StorageError(cause, "Use a medium that is large enough and has no limit of 4 GB a file.") from error


def _written(config: Config, places: Places, root: Path, file: Path, copy: Path) -> BackupReport:
    data = below(root, places.data)
    facts = copy_database(data, copy)
    files = {f"data/{DATABASE}": copy, **_files(places, root)}
    size_bytes = sum(path.stat().st_size for path in files.values())
    _require_space(file.parent, size_bytes)
    missing = tuple(one for one in facts.recordings if not _is_in(files, f"data/recordings/{one}"))
    with written_whole(file) as stream:
        writer = ArchiveWriter(stream)
        for name, path in files.items():
            writer.add(name, path)
        writer.close(_described(config, places, facts, missing))
    damaged = tuple(_damaged(writer.entries, facts))
    unnoted, left_out = _note_saved(data, facts, (*missing, *damaged)), tuple(links(data))
    return BackupReport(
        str(file), config.serial, len(files), size_bytes, facts.measurements, missing, damaged, left_out, unnoted
    )


def _named(file: Path, serial: str) -> Path:
    """Return the file itself, or a new one in a folder that is named."""
    if not file.is_dir():
        return file
    return file / f"{serial}-{datetime.now(UTC).strftime('%Y%m%dT%H%M%SZ')}.backup"


def _damaged(entries: list[BackupEntry], facts: StoreFacts) -> Iterator[str]:
    """Yield the recordings that were written to the backup and are not as they were kept."""
    for entry in entries:
        name = entry.name.removeprefix("data/recordings/").removesuffix(".zip")
        if entry.name.endswith(".zip") and name in facts.hashes and entry.sha256 != facts.hashes[name]:
            yield name


def _note_saved(data: Path, facts: StoreFacts, left_out: tuple[str, ...]) -> str:
    """Note in the data folder what a backup holds; return why that could not be, "" when it was.

    A card that can only be read needs no retention.
    """
    if not facts.newest:
        return ""
    saved = SavedUntil(utc_now(), *facts.newest, left_out)
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
