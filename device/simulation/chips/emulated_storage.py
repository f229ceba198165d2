"""Storage that goes wrong: a disk that is low, full, read-only or silent, and a model bundle with one byte changed.

Only what goes through the store's `Disk` is refused or held up, with the kernel's own "no space left" from /dev/full;
the database beside it is on the real disk. Linux only. Source: full(4); errno(3), EROFS, which Linux answers once it
has remounted a failing card read-only. What is tampered with is a copy of the bundle, changed as a worn card does.
"""

from __future__ import annotations

import errno
import os
import shutil
from contextlib import AbstractContextManager
from pathlib import Path
from typing import BinaryIO

from device.files.durable import synced_file
from device.simulation.faults import FaultTimeline

FULL = Path("/dev/full")
LOW_BYTES = 200_000_000
"""What a disk has left that is low: above `store.min_free_mb` of the settings, below ten times that."""


class EmulatedDisk:
    """The disk of a scenario: low, full, read-only or frozen while it says so, else the real one.

    Implements the store's `Disk`; while it is frozen no call returns.
    """

    def __init__(self, faults: FaultTimeline) -> None:
        self._faults = faults

    def free_bytes(self, folder: Path) -> int:
        """Return the space that is left for a folder."""
        self._faults.hold_up("disk_frozen")
        if self._faults.is_active("disk_full"):
            return 0
        free_bytes = shutil.disk_usage(folder).free
        return min(free_bytes, LOW_BYTES) if self._faults.is_active("disk_low") else free_bytes

    def file(self, path: Path) -> AbstractContextManager[BinaryIO]:
        """Open a file to be written anew and synchronised.

        Raises `OSError` EROFS while the disk is read-only; what is written raises ENOSPC if it is full now.
        """
        self._faults.hold_up("disk_frozen")
        if self._faults.is_active("disk_read_only"):
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))
        return synced_file(FULL if self._faults.is_active("disk_full") else path)


NETWORK = "model.onnx"


class EmulatedBundles:
    """The model folders of a scenario; copies are made below `scratch`."""

    def __init__(self, faults: FaultTimeline, scratch: Path) -> None:
        self._faults, self._scratch = faults, scratch

    def folder(self, installed: Path) -> Path:
        """Return the folder to read instead of an installed one: itself unless it is tampered with now."""
        if not (installed.is_dir() and self._faults.is_active("bundle_tampered")):
            return installed
        copy = self._scratch / installed.name
        shutil.copytree(installed, copy, dirs_exist_ok=True)
        network = bytearray((installed / NETWORK).read_bytes())
        network[len(network) // 2] ^= 1
        (copy / NETWORK).write_bytes(network)
        return copy
