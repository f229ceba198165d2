"""A file that one program writes and another one waits for: not there until it is whole, and it replaces nothing.

Its writer holds a lock on it until then, so what nobody holds was left by somebody who is gone. What waits is told by
the caller, in its own words. Standard library only: the updater and the page that stands in for the daemon use it.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from contextlib import suppress
from pathlib import Path

from device.files.durable import sync_directory

PART = ".upload-"
"""How the names begin of files that are not whole yet."""


class HandedOverFile:
    """A file on its way: written piece by piece, then handed over under its name, or discarded without a trace."""

    def __init__(self, folder: Path) -> None:
        """Begin one in the folder where it is waited for, for this user and the folder's group. Raises `OSError`."""
        handle, name = tempfile.mkstemp(prefix=PART, dir=folder)
        self._file, self._path, self.bytes_written = os.fdopen(handle, "wb"), Path(name), 0
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.fchmod(handle, 0o640)

    @property
    def is_open(self) -> bool:
        """Whether it is still on its way."""
        return not self._file.closed

    def write(self, piece: bytes) -> None:
        """Append a piece. Raises `OSError`."""
        self._file.write(piece)
        self.bytes_written += len(piece)

    def synchronise(self) -> None:
        """Bring what was written to the disk. Raises `OSError`."""
        self._file.flush()
        os.fsync(self._file.fileno())

    def hand_over(self, name: str) -> os.stat_result:
        """Give it its name, once all of it is on the disk; return what it is there.

        Raises `FileExistsError` when there is one already, which stays, and `OSError`.
        """
        try:
            self.synchronise()
            there = os.fstat(self._file.fileno())
            os.link(self._path, self._path.with_name(name))  # unlike a rename it replaces nothing
        finally:
            self.discard()
        sync_directory(self._path.parent)
        return there

    def discard(self) -> None:
        """Remove it, if it was not handed over."""
        with suppress(OSError):  # on a full disk closing writes what is left, in vain
            self._file.close()
        with suppress(OSError):
            self._path.unlink(missing_ok=True)


def is_held(path: Path) -> bool:
    """Return whether somebody still writes a file; nobody writes what cannot be opened."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(handle)
    return False
