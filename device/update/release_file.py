"""A release file, read in its one order: manifest, signature, then every file that the manifest lists.

The file is a plain tar without folders, links or extended headers. It is read by hand, since before the signature is
verified nothing may be unpacked that a stranger wrote: Python 3.11.2's `tarfile` allocates what a header asks for and
can be kept running for ever. Each byte is part of a header with a checksum, of a content with a hash, or zero; so a
copy that was interrupted or changed at any byte is refused.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO

from device.errors import UntrustedRelease
from device.update.manifest import ReleaseEntry, ReleaseManifest

BLOCK, RECORD = 512, 10240
MOST_MANIFEST_BYTES, MOST_SIGNATURE_BYTES = 2**20, 2**14
MODE = 0o644
REMEDY = "Copy the release file again."


class ReleaseFile:
    """A release file that is open; its parts are asked for in their order."""

    def __init__(self, file: BinaryIO) -> None:
        """Take a file that is open for reading, at its beginning."""
        self._file, self.status = file, os.fstat(file.fileno())
        self._starts: dict[str, int] = {}

    def signed(self) -> tuple[bytes, bytes]:
        """Return the manifest and its signature, neither of them checked. Raises `UntrustedRelease`."""
        self._file.seek(0)
        manifest = self._small("manifest.json", MOST_MANIFEST_BYTES)
        return manifest, self._small("manifest.json.sig", MOST_SIGNATURE_BYTES)

    def check_files(self, manifest: ReleaseManifest, told: Callable[[float], None]) -> None:
        """Read every file once; raise `UntrustedRelease` unless all are there, each as the manifest says, and no more.

        `told` hears how much is read, from 0 to 1. Follows `signed`.
        """
        for done, entry in enumerate(manifest.files):
            told(done / len(manifest.files))
            self._header(entry.path, entry.size, exactly=True)
            self._starts[entry.path] = self._file.tell()
            self._require_hash(entry, self._read(entry.size, entry.path))
            self._padding(entry.size, entry.path)
        self._end()

    def content(self, entry: ReleaseEntry) -> bytes:
        """Return a file's bytes; raise `UntrustedRelease` when they are no longer those that were checked."""
        self._file.seek(self._starts[entry.path])
        content = self._read(entry.size, entry.path)
        self._require_hash(entry, content)
        return content

    def _small(self, name: str, most: int) -> bytes:
        size = self._header(name, most)
        content = self._read(size, name)
        self._padding(size, name)
        return content

    def _header(self, name: str, size: int, *, exactly: bool = False) -> int:
        """Read a header; return the size it states, which is `size`, or at most that."""
        found, stated = _fields(self._read(BLOCK, f"the header of {name}"), name)
        if found != name:
            raise UntrustedRelease(f"The release file holds {found!r} where {name} has to be.", REMEDY)
        if stated > size or (exactly and stated != size):
            bound = "must have" if exactly else "may have at most"
            raise UntrustedRelease(f"{name} has {stated} bytes in the release file and {bound} {size}.", REMEDY)
        return stated

    def _read(self, size: int, what: str) -> bytes:
        content = self._file.read(size)
        if len(content) < size:
            where = self._file.tell()
            raise UntrustedRelease(f"The release file ends after {where} bytes, inside {what}.", REMEDY)
        return content

    def _padding(self, size: int, what: str) -> None:
        if any(self._read(-size % BLOCK, f"what follows {what}")):
            raise UntrustedRelease(f"The release file is damaged behind {what}.", REMEDY)

    def _end(self) -> None:
        """Require the two empty blocks, the rest of the record, and nothing more."""
        rest = 2 * BLOCK + -(self._file.tell() + 2 * BLOCK) % RECORD
        if any(self._read(rest, "its end")) or self._file.read(1):
            raise UntrustedRelease("The release file holds more than its manifest lists.", REMEDY)

    def _require_hash(self, entry: ReleaseEntry, content: bytes) -> None:
        if hashlib.sha256(content).hexdigest() != entry.sha256:
            raise UntrustedRelease(f"{entry.path} is damaged: its SHA-256 is not the manifest's.", REMEDY)


@contextmanager
def opened(path: Path) -> Iterator[ReleaseFile]:
    """Open a release file; raise `UntrustedRelease` when it is no plain file, as a link or a pipe."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise UntrustedRelease(f"The release file {path} cannot be opened: {error}.", REMEDY) from None
    if not stat.S_ISREG(os.fstat(handle).st_mode):
        os.close(handle)
        raise UntrustedRelease(f"{path} is not a file.", REMEDY)
    with os.fdopen(handle, "rb") as file:
        yield ReleaseFile(file)


def _fields(block: bytes, name: str) -> tuple[str, int]:
    """Return the name and size in a header; raise `UntrustedRelease` unless it is a plain file's of POSIX 1988."""
    broken = UntrustedRelease(f"The release file is damaged at the header of {name}.", REMEDY)
    blank = block[:148] + b" " * 8 + block[156:]
    if block[148:156] != b"%06o\0 " % sum(blank) or block[257:265] != b"ustar\x0000" or block[156:157] != b"0":
        raise broken
    if _number(block[100:108], broken) != MODE or any(block[500:]) or any(block[157:257]):
        raise broken
    try:
        own, folder = (field.rstrip(b"\0").decode("ascii") for field in (block[:100], block[345:500]))
    except UnicodeDecodeError:
        raise broken from None
    return f"{folder}/{own}" if folder else own, _number(block[124:136], broken)


def _number(field: bytes, broken: UntrustedRelease) -> int:
    """Return an octal number that a space or a zero byte ends."""
    digits = field.rstrip(b"\0 ")
    if not digits or digits.strip(b"01234567"):
        raise broken
    return int(digits, 8)
