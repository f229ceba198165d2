"""Files that are whole or not there: written beside, synchronised, then renamed.

Without synchronising file and folder, a renamed file may be empty or gone after a power cut.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

READ_ONLY = 0o444
MOUNTS = Path("/proc/self/mountinfo")
SHUT = {b"ro", b"emergency_ro", b"shutdown"}
"""What a file system says there when it takes no writes; of its own errors ext4 says the second since Linux 6.12."""


@contextmanager
def synced_file(path: Path) -> Iterator[BinaryIO]:
    """Open a file to be written anew; when the block has ended without an error its content is on the disk."""
    with path.open("wb") as file:
        yield file
        file.flush()
        os.fsync(file.fileno())


def write_and_sync(path: Path, content: bytes) -> None:
    """Write a file; when this returns its content is on the disk."""
    with synced_file(path) as file:
        file.write(content)


def write_durably(path: Path, content: bytes) -> None:
    """Write or replace a file, whole or not at all; makes its folder."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(path.name + ".tmp")
    try:
        write_and_sync(temporary, content)
        temporary.replace(path)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise
    sync_directory(path.parent)


def write_once(path: Path, content: bytes) -> None:
    """Write a file that nobody may write again: whole or not at all, read-only; makes its folder.

    Raises `FileExistsError` when there is one already, which is left as it is.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f"{path.name}.{os.getpid()}.tmp")
    try:
        write_and_sync(temporary, content)
        temporary.chmod(READ_ONLY)
        os.link(temporary, path)  # unlike a rename it replaces nothing
    finally:
        temporary.unlink(missing_ok=True)
    sync_directory(path.parent)


def is_disk_read_only(path: Path) -> bool:
    """Return whether the file system of a path takes no writes from anybody, as the kernel shuts a failing card.

    By the last field of proc(5)'s mountinfo, which is of the file system itself. `statvfs` tells of the mount, which
    `ProtectSystem=strict` makes read-only for one program alone (systemd.exec(5)). False where nobody can tell.
    """
    device = path.stat().st_dev
    number = f"{os.major(device)}:{os.minor(device)}".encode()
    try:
        mounts = [line.split() for line in MOUNTS.read_bytes().split(b"\n")]
    except OSError:
        return False
    return any(fields[2:3] == [number] and SHUT & set(fields[-1].split(b",")) for fields in mounts)


def sync_directory(folder: Path) -> None:
    """Make a folder's entries durable."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
