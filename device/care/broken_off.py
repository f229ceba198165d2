"""What a backup leaves that is killed, or whose stick is pulled out: patients' data, which the next one takes away.

One backup at a time writes to a folder, so that none takes another one's files for leftovers.
"""

from __future__ import annotations

import fcntl
import os
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from device.errors import BusyError

WORK = ".tsis-backup-"
"""How the folder begins in which a backup is made: in the target folder, so that it can be renamed from there."""


@contextmanager
def target_held(folder: Path) -> Iterator[bool]:
    """Hold a backup's target folder; yield False where none can be held, as over NFS by flock(2).

    Raises `BusyError` while another backup is written there.
    """
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield _is_locked(handle, folder)
    finally:
        os.close(handle)


def leftovers(folder: Path, serial: str) -> list[Path]:
    """Return what backups of a probe that were broken off have left in a folder, also those of earlier releases."""
    probe = re.escape(serial)
    work = re.compile(rf"{re.escape(WORK)}({probe}-)?[a-z0-9_]{{8}}")  # tempfile's own eight
    partial = re.compile(rf"{probe}-\d{{8}}T\d{{6}}Z\.backup\.tmp")
    found = (
        path
        for path in sorted(folder.iterdir())
        if not path.is_symlink() and (work if path.is_dir() else partial).fullmatch(path.name)
    )
    return list(found)


def remove_leftovers(folder: Path, serial: str, told: Callable[[str], None]) -> None:
    """Remove them, and tell of each; the folder must be held."""
    for path in leftovers(folder, serial):
        try:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
        except OSError as error:
            told(f"{path}, which a backup that was broken off has left, cannot be removed: {error.strerror or error}")
        else:
            told(f"removed: {path}, which a backup that was broken off had left")


def _is_locked(handle: int, folder: Path) -> bool:
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise BusyError(f"Another backup is being written to {folder}.", "Wait until it has ended.") from None
    except OSError:
        return False
    return True
