"""Tries what the sandbox of tsis.service forbids; writes one JSON object, each try with what became of it.

Outside the unit the same tries of the same user end otherwise (`stories.py` runs both).
Source: systemd.exec(5), whose settings are named with each try.
"""

from __future__ import annotations

import ctypes
import errno
import json
import mmap
import os
import socket
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

CLONE_NEWUSER = 0x1000_0000
ADDR_NO_RANDOMIZE = 0x0004_0000
"""linux/sched.h, sys/personality.h."""
libc = ctypes.CDLL(None, use_errno=True)


def _checked(result: int) -> None:
    if result < 0:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def _suid() -> None:
    with tempfile.NamedTemporaryFile() as file:
        os.chmod(file.name, 0o4755)


def _outcome(attempt: Callable[[], object]) -> str:
    """Return what became of an attempt: the name of its error number, or `allowed`."""
    try:
        attempt()
    except OSError as error:
        return errno.errorcode[error.errno]
    return "allowed"


TRIES: dict[str, tuple[Callable[[], object], str]] = {
    "/usr is read-only (ProtectSystem)": (lambda: Path("/usr/x").touch(), "EROFS"),
    "/opt is read-only (ProtectSystem)": (lambda: Path("/opt/tsis/x").touch(), "EROFS"),
    "/etc is read-only (ProtectSystem)": (lambda: Path("/etc/tsis/x").touch(), "EROFS"),
    "/home is not visible (ProtectHome)": (lambda: os.listdir("/home"), "EACCES"),
    "/tmp is its own (PrivateTmp)": (lambda: os.stat("/tmp/of_others"), "ENOENT"),
    "other users' processes are not visible (ProtectProc)": (lambda: os.stat("/proc/1"), "ENOENT"),
    "no packet sockets (RestrictAddressFamilies)": (
        lambda: socket.socket(socket.AF_PACKET, socket.SOCK_RAW),
        "EAFNOSUPPORT",
    ),
    "no name spaces (RestrictNamespaces)": (lambda: _checked(libc.unshare(CLONE_NEWUSER)), "EPERM"),
    "no set-user-ID files (RestrictSUIDSGID)": (_suid, "EPERM"),
    "no other personality (LockPersonality)": (lambda: _checked(libc.personality(ADDR_NO_RANDOMIZE)), "EPERM"),
    "no device but the probe's (DevicePolicy)": (lambda: os.close(os.open("/dev/net/tun", os.O_RDWR)), "EPERM"),
    "no memory that is written and run (MemoryDenyWriteExecute)": (
        lambda: mmap.mmap(-1, mmap.PAGESIZE, prot=mmap.PROT_WRITE | mmap.PROT_EXEC),
        "EPERM",
    ),
}
"""Attempts, each with the error that the setting in brackets gives it."""


if __name__ == "__main__":
    outcomes = {words: {"seen": _outcome(attempt), "wanted": wanted} for words, (attempt, wanted) in TRIES.items()}
    Path(sys.argv[1]).write_text(json.dumps(outcomes))
