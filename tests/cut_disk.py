"""A disk whose power can be cut: an ext4 file system in a file, on a loop device. Needs root.

The kernel shuts it down without writing its log (the ioctl of xfstests' `godown`, flag NOLOGFLUSH): what was not
synchronised is lost, content and names, as it is when the power goes. Mounted again, it replays its journal.
"""

from __future__ import annotations

import fcntl
import os
import subprocess
import time
from pathlib import Path

SHUTDOWN, WITHOUT_LOG = 0x8004587D, 2
"""_IOR('X', 125, __u32) of linux/fs.h and ext4.h; flag EXT4_GOING_FLAGS_NOLOGFLUSH."""
SIZE_MB = 96


class CutDisk:
    """An ext4 file system in a file, mounted on a folder."""

    def __init__(self, folder: Path, size_mb: int = SIZE_MB) -> None:
        self.image, self.mount = folder / "disk.img", folder / "mnt"
        self.mount.mkdir()
        with self.image.open("wb") as file:
            file.truncate(size_mb * 2**20)
        run("mkfs.ext4", "-q", "-F", str(self.image))
        self.up()

    def up(self) -> None:
        """Mount it, which replays its journal."""
        run("mount", "-o", "loop", str(self.image), str(self.mount))

    def cut(self) -> None:
        """Cut the power: nothing that is not on the disk by now will be."""
        handle = os.open(self.mount, os.O_RDONLY)
        try:
            fcntl.ioctl(handle, SHUTDOWN, WITHOUT_LOG.to_bytes(4, "little"))
        finally:
            os.close(handle)

    def down(self) -> None:
        """Let go of it, once nobody holds a file there any more."""
        for _ in range(100):
            if subprocess.run(["umount", str(self.mount)], capture_output=True).returncode == 0:
                return
            time.sleep(0.1)
        run("umount", str(self.mount))


def can_cut() -> bool:
    """Return whether this machine lets us mount a file: root, with loop devices and ext4."""
    return os.geteuid() == 0 and Path("/dev/loop-control").exists() and Path("/sbin/mkfs.ext4").exists()


def run(*command: str) -> None:
    """Run a command that must succeed."""
    subprocess.run(command, check=True)
