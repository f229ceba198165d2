"""A probe that is given away: its measurements and its keys are overwritten, and what is left is said.

First every file of the data folder but its calibration certificates, and every key that the settings name, is
overwritten, brought to the disk and deleted; then all free space is filled once, for what was deleted before, and
offered to the card to be forgotten. The daemon must not run meanwhile; after a power cut the same command finishes.
What a card's controller has set aside by itself is out of reach of every program: docs/care.md says so.
Source: NIST SP 800-88r1, 2.5 and A: overwriting is "clear"; "purge" of flash is the device's own command alone.
"""

from __future__ import annotations

import errno
import fcntl
import os
import sqlite3
import struct
from collections.abc import Callable, Iterator, Mapping
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from io import RawIOBase
from pathlib import Path
from typing import Any

from device.care.broken_off import leftovers
from device.care.places import Places
from device.care.restore import daemon_kept_out
from device.config import Config
from device.errors import StorageError
from device.files.durable import sync_directory
from device.files.medium import medium_of
from device.files.plain_settings import below
from device.measurement.quantities import InvalidQuantity
from device.records.audit import utc_now
from device.records.database import DATABASE
from device.records.recordings import RECORDINGS
from device.records.saved import said_saved, same_disk_backups, unsaved

KEY_SETTINGS = ("server.certificate_key", "webhook.secret_file", "dicom.tls_key")
OF_HOSPITAL = ("server.", "dicom.", "webhook.")
KEPT = ("lock",)
"""Files of the data folder that say nothing; the lock is held meanwhile."""
FILLER = "erase.tmp"
ZEROS, SMALL_BYTES = bytes(1 << 20), 512
FITRIM, WHOLE = 0xC0185879, struct.pack("QQQ", 0, 2**64 - 1, 0)
"""_IOWR('X', 121, struct fstrim_range) of linux/fs.h: start, length and shortest piece, in bytes."""


@dataclass(frozen=True)
class ErasurePlan:
    """What an erasure takes and what it leaves; `unsaved` of the measurements are in no backup that is known of.

    A database that cannot be read has None measurements.
    """

    serial: str
    data: Path
    certificates: Path
    files: tuple[Path, ...]
    keys: tuple[Path, ...]
    size_bytes: int
    measurements: int | None
    unsaved: int | None
    left: tuple[str, ...]


@dataclass(frozen=True)
class ErasureReport:
    """What was overwritten; `unreached_bytes` of free space were not, and `trimmed` says whether it was offered."""

    serial: str
    files: int
    keys: int
    overwritten_bytes: int
    free_bytes: int
    unreached_bytes: int
    trimmed: bool
    left: tuple[str, ...]


def plan_erasure(config: Config, stated: Mapping[str, Any], root: Path = Path("/")) -> ErasurePlan:
    """Return what `erase` would take now. `stated` is what the settings files say, by full names."""
    data = below(root, Places.of(config).data)
    measurements, unsaved = _counts(data)  # before its files are listed: it puts a database in order
    calibration = below(root, config.calibration)
    files = tuple(path for path in _files(data) if not path.is_relative_to(calibration))
    named = (below(root, Path(str(path))) for name in KEY_SETTINGS if (path := stated.get(name)))
    keys = tuple(path for path in named if path.is_file() and path not in files)
    left = tuple(f"the setting {name}" for name in stated if name.startswith(OF_HOSPITAL))
    left += (f"calibration certificates in {calibration}",) if any(_files(calibration)) else ()
    left += tuple(f"measurements or recordings in {folder}" for folder in _moved_away(data))
    left += tuple(f"a backup with measurements, {path}" for path in _backups_on_own_medium(data, root, config.serial))
    size_bytes = sum(path.lstat().st_size for path in (*files, *keys))
    return ErasurePlan(config.serial, data, calibration, files, keys, size_bytes, measurements, unsaved, left)


def erase(
    config: Config,
    stated: Mapping[str, Any],
    root: Path = Path("/"),
    *,
    serial: str,
    also_unsaved: bool = False,
    told: Callable[[str], None] = lambda _: None,
) -> ErasureReport:
    """Overwrite and delete what `plan_erasure` names, and overwrite all free space; `told` hears each step.

    Raises `InvalidQuantity` when `serial` is not this probe's, and while measurements are in no backup unless
    `also_unsaved`: then nothing was touched. `BusyError` while a daemon runs. `StorageError` when the disk refuses:
    then the same command goes on.
    """
    if serial != config.serial:
        action = "say the serial number of the probe that is to be erased"
        raise InvalidQuantity("serial", serial, f"{config.serial}, this probe's", action)
    with daemon_kept_out(below(root, Places.of(config).data)):
        plan = plan_erasure(config, stated, root)
        if plan.unsaved != 0 and not also_unsaved:
            count = "an unknown number of" if plan.unsaved is None else plan.unsaved
            action = "save them: python -m device backup FILE, or say --also-unsaved"
            raise InvalidQuantity("measurements in no backup", count, "0", action)
        try:
            return _erased(plan, told)
        except OSError as error:
            raise StorageError(f"{plan.data} could not be erased: {error}.", "Run it again, as root.") from error


def _files(folder: Path) -> Iterator[Path]:
    """Yield every file and link of a folder, whatever made it, the database first: what is cut short is told by it."""
    for path in sorted(folder.rglob("*"), key=lambda one: (not one.name.startswith(DATABASE), one)):
        if (path.is_symlink() or not path.is_dir()) and path.relative_to(folder).as_posix() not in KEPT:
            yield path


def _moved_away(data: Path) -> Iterator[Path]:
    """Yield the folders beside the data folder that hold a database or recordings, as one that was damaged does."""
    if not data.parent.is_dir():
        return
    for folder in sorted(data.parent.iterdir()):
        with suppress(OSError):  # a folder that may not be looked into; the erasure itself is root's
            is_data = folder.resolve() == data.resolve()
            if not is_data and any((folder / name).exists() for name in (DATABASE, RECORDINGS)):
                yield folder


def _backups_on_own_medium(data: Path, root: Path, serial: str) -> list[Path]:
    """Return the backups that the data folder knows of and that are still on its medium, also those broken off.

    They are named and not deleted: whoever may write that folder would otherwise choose what root overwrites.
    """
    saved, found = said_saved(data), list[Path]()
    noted = (*same_disk_backups(data), *((saved.path,) if saved and saved.path else ()))
    for path in (below(root, Path(one)) for one in noted):
        with suppress(OSError):
            if medium_of(path.parent) == medium_of(data):
                found += [path] if path.is_file() else []
                found += leftovers(path.parent, serial)
    return list(dict.fromkeys(found))


def _counts(data: Path) -> tuple[int | None, int | None]:
    """Return how many measurements there are, and how many of them no backup holds."""
    if not (data / DATABASE).is_file():
        return 0, 0
    try:
        with closing(sqlite3.connect(data / DATABASE)) as db:
            [count] = db.execute("SELECT count(*) FROM measurement").fetchone()
            return int(count), unsaved(db, data, utc_now()).count
    except sqlite3.Error:
        return None, None


def _erased(plan: ErasurePlan, told: Callable[[str], None]) -> ErasureReport:
    told(f"Overwriting {len(plan.files) + len(plan.keys)} files, {plan.size_bytes / 1e6:.1f} MB.")
    overwritten_bytes = sum(_overwrite(path) for path in (*plan.keys, *plan.files))
    for path in (*plan.keys, *plan.files):
        path.unlink()
        sync_directory(path.parent)
    _remove_empty_folders(plan.data, plan.certificates)
    told("Filling the free space, which takes the card as long as writing it full.")
    with _whole_disk(plan.data):
        free_bytes, unreached_bytes = _fill_free_space(plan.data)
    told("The free space was overwritten.")
    trimmed = _trimmed(plan.data)
    return ErasureReport(
        plan.serial,
        len(plan.files),
        len(plan.keys),
        overwritten_bytes,
        free_bytes,
        unreached_bytes,
        trimmed,
        plan.left,
    )


def _overwrite(path: Path) -> int:
    """Overwrite a file where it lies, and bring that to the disk; return how many bytes. A link is not followed."""
    if path.is_symlink() or not path.is_file():
        return 0
    size_bytes = path.stat().st_size
    path.chmod(0o600)  # certificates and the like are read-only
    with path.open("r+b") as file:
        for at in range(0, size_bytes, len(ZEROS)):
            file.write(ZEROS[: size_bytes - at])
        file.flush()
        os.fsync(file.fileno())
    return size_bytes


def _remove_empty_folders(data: Path, certificates: Path) -> None:
    """Remove all but that of the certificates, which may be empty yet: without it the unit does not start."""
    folders = [path for path in data.rglob("*") if path.is_dir() and not path.is_symlink()]
    for path in sorted(folders, reverse=True):
        if path != certificates and not any(path.iterdir()):
            path.rmdir()
    sync_directory(data)


@contextmanager
def _whole_disk(data: Path) -> Iterator[None]:
    """Let ext4 give out meanwhile also what it keeps for itself (2 %), which would be passed over; only root can."""
    number = data.stat().st_dev
    device = Path(f"/sys/dev/block/{os.major(number)}:{os.minor(number)}").resolve().name
    reserve = Path("/sys/fs/ext4", device, "reserved_clusters")
    before = reserve.read_text() if os.access(reserve, os.W_OK) else None
    try:
        if before is not None:
            reserve.write_text("0")
        yield
    finally:
        if before is not None:
            reserve.write_text(before)


def _fill_free_space(data: Path) -> tuple[int, int]:
    """Write a file until the disk is full, bring it to the disk, and delete it.

    Returns its size, and how much the disk still had free beside it: both in bytes.
    """
    path, written = data / FILLER, 0
    try:
        with path.open("wb", buffering=0) as file:
            while more := _fill(file):
                written += more
                os.fsync(file.fileno())  # what was kept back for placing it is free again
            room = os.statvfs(data)
    finally:
        path.unlink(missing_ok=True)
        sync_directory(data)
    return written, room.f_bfree * room.f_frsize


def _fill(file: RawIOBase) -> int:
    """Write to a file until the disk takes not even a small piece more; return how many bytes it took."""
    written = 0
    for piece in (ZEROS, ZEROS[:SMALL_BYTES]):
        try:
            while True:
                written += file.write(piece) or 0
        except OSError as error:
            if error.errno != errno.ENOSPC:
                raise
    return written


def _trimmed(data: Path) -> bool:
    """Offer all free space to the card to be forgotten (fstrim); return whether it took that."""
    handle = os.open(data, os.O_RDONLY)
    try:
        os.sync()
        fcntl.ioctl(handle, FITRIM, bytearray(WHOLE))
    except OSError:
        return False
    finally:
        os.close(handle)
    return True
