"""On which medium a folder lies: what is on a card is lost with it, in whichever of its partitions.

Source: proc(5), mountinfo; the kernel's sysfs, where a partition's folder lies in its disk's.
"""

from __future__ import annotations

import os
from pathlib import Path

from device.files.durable import MOUNTS

BLOCKS = Path("/sys/dev/block")
MEMORY = "memory"
PASSING = {b"tmpfs", b"ramfs", b"overlay"}
"""File systems whose files are gone after a restart: /tmp, and a root that is protected by an overlay in memory."""


def medium_of(folder: Path) -> str:
    """Return the disk that a folder lies on, as `mmcblk0`, `MEMORY`, or the number of a file system without a disk.

    Raises `OSError` when the folder is not there.
    """
    number = device_number(folder)
    if _kind_of(number) in PASSING:
        return MEMORY
    place = (BLOCKS / number).resolve()
    if not place.exists():  # of a network, or no Linux
        return number
    return place.parent.name if (place / "partition").exists() else place.name


def device_number(folder: Path) -> str:
    """Return the number of a folder's file system, as the kernel names it: `179:2`."""
    device = folder.stat().st_dev
    return f"{os.major(device)}:{os.minor(device)}"


def _kind_of(number: str) -> bytes:
    try:
        mounts = [line.split() for line in MOUNTS.read_bytes().split(b"\n")]
    except OSError:
        return b""
    kinds = (fields[fields.index(b"-") + 1] for fields in mounts if fields[2:3] == [number.encode()])
    return next(kinds, b"")
