"""The disk below the store: how much is left, and files that are on it when the call returns."""

from __future__ import annotations

import os
import shutil
from contextlib import AbstractContextManager
from pathlib import Path
from typing import BinaryIO, Protocol

from device.files.durable import synced_file


class Disk(Protocol):
    """What the store asks of the file system."""

    def free_bytes(self, folder: Path) -> int:
        """Return the space that is left for a folder."""

    def file(self, path: Path) -> AbstractContextManager[BinaryIO]:
        """Open a file to be written anew, synchronised when the block ends; what fails raises `OSError`."""


class LocalDisk:
    """The board's own file system. Implements `Disk`."""

    def free_bytes(self, folder: Path) -> int:
        """Return the space that is left for a folder; raise `OSError` when it cannot be asked."""
        return shutil.disk_usage(folder).free

    def file(self, path: Path) -> AbstractContextManager[BinaryIO]:
        """Open a file to be written anew, synchronised when the block ends; what fails raises `OSError`."""
        return synced_file(path)


def read_uncached(path: Path) -> bytes:
    """Return a synchronised file's content from the disk itself where the kernel lets go of its copy.

    Source: posix_fadvise(2), POSIX_FADV_DONTNEED; a system without it reads what it has in memory.
    """
    with path.open("rb") as file:
        if hasattr(os, "posix_fadvise"):
            os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        return file.read()
