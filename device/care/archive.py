"""A backup as one file: an uncompressed tar of plain files, and at its end a manifest with size and hash of each.

A file that was cut short has no manifest; one in which a byte was changed does not hold its hashes. Nothing is unpacked
by the tar library: members are looked at one by one, and a link, a device, a path that leads elsewhere or a file that
the manifest does not name ends it. The hashes find damage, not forgery: a backup is not signed.
Source: Python 3.11.2 has no `tarfile.data_filter`.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import tarfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path, PurePosixPath
from typing import IO, Any

from device.files.durable import sync_directory
from device.measurement.quantities import InvalidQuantity

SCHEMA = "tsis.backup/1"
MANIFEST = "manifest.json"
SECTIONS = ("data", "settings", "calibration", "models")
PRIVATE = 0o600
"""Patients' measurements are inside: nobody but its owner reads it."""
CHUNK = 1 << 20
MOST_MANIFEST_BYTES = 64 << 20
ANOTHER = "take another copy of it, or an older backup"
UNREADABLE = (OSError, tarfile.TarError, EOFError, ValueError, KeyError, TypeError)
"""What reading a damaged tar or manifest raises."""


@dataclass(frozen=True)
class BackupEntry:
    """One file of a backup: its name, size (bytes), hash and permissions."""

    name: str
    size: int
    sha256: str
    mode: int


class _HashingReader:
    """Passes on what is read of a file, and hashes it."""

    def __init__(self, file: IO[bytes]) -> None:
        self._file, self.hash = file, hashlib.sha256()

    def read(self, size: int = -1) -> bytes:
        content = self._file.read(size)
        self.hash.update(content)
        return content


class ArchiveWriter:
    """Adds files one after the other; `entries` are those that were added."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._tar = tarfile.open(fileobj=stream, mode="w", format=tarfile.PAX_FORMAT)  # noqa: SIM115 - see `close`
        self.entries: list[BackupEntry] = []

    def add(self, name: str, path: Path) -> None:
        """Add a file under a name; raise `OSError` when it cannot be read, or becomes shorter meanwhile."""
        with path.open("rb") as file:
            found = os.fstat(file.fileno())
            self._add(name, file, found.st_size, found.st_mode & 0o777, int(found.st_mtime))

    def _add(self, name: str, file: IO[bytes], size: int, mode: int, mtime: int) -> None:
        member = tarfile.TarInfo(name)
        member.size, member.mode, member.mtime = size, mode, mtime
        reader = _HashingReader(file)
        self._tar.addfile(member, reader)
        self.entries.append(BackupEntry(name, size, reader.hash.hexdigest(), mode))

    def close(self, facts: dict[str, Any]) -> None:
        """Write the manifest: what is known of the whole, and every entry."""
        manifest = {"schema": SCHEMA, **facts, "entries": [asdict(one) for one in self.entries]}
        content = json.dumps(manifest, indent=1).encode()
        member = tarfile.TarInfo(MANIFEST)
        member.size, member.mode = len(content), PRIVATE
        self._tar.addfile(member, io.BytesIO(content))
        self._tar.close()


@contextmanager
def written_whole(path: Path) -> Iterator[IO[bytes]]:
    """Yield a stream for a new private file: it is on the disk under its name afterwards, or not there at all.

    The caller looks at PATH.tmp, which is synchronised, between the two: see `Archive`.
    """
    temporary = partial_path(path)
    try:
        handle = os.open(temporary, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE)
        with open(handle, "wb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        with Archive(temporary) as written:
            written.verify()
        temporary.replace(path)
        sync_directory(path.parent)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise


def partial_path(path: Path) -> Path:
    """Return where a file stands until it is whole."""
    return path.with_name(path.name + ".tmp")


class Archive:
    """A backup that is opened to be read. `manifest` holds what it says of itself, `entries` its files by name."""

    def __init__(self, path: Path) -> None:
        """Open it and look at every member's name and kind; raise `InvalidQuantity` when it is no whole backup."""
        self.path = path
        try:
            self._tar = tarfile.open(path, mode="r:")  # noqa: SIM115 - closed by `close`
        except UNREADABLE as error:
            raise self._refusal(f"readable as a backup ({error})") from error
        try:
            self._members = self._plain_members()
            self.manifest = self._read_manifest()
            self.entries = self._manifest_entries()
        except BaseException:
            self._tar.close()
            raise

    def __enter__(self) -> Archive:
        return self

    def __exit__(self, *error: object) -> None:
        self._tar.close()

    def verify(self, seen: Callable[[BackupEntry], None] = lambda entry: None) -> None:
        """Read every byte, straight from the disk where the kernel allows it; raise `InvalidQuantity` at damage."""
        with self.path.open("rb") as file:
            if hasattr(os, "posix_fadvise"):
                os.posix_fadvise(file.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)
        for entry in self.entries.values():
            for _ in self.chunks(entry):
                pass
            seen(entry)

    def chunks(self, entry: BackupEntry) -> Iterator[bytes]:
        """Yield a file's content piece by piece; raise `InvalidQuantity` at its end when it is not what was put in."""
        digest = hashlib.sha256()
        try:
            content = self._tar.extractfile(self._members[entry.name])
            assert content is not None  # a plain file, as was checked
            while piece := content.read(CHUNK):
                digest.update(piece)
                yield piece
        except UNREADABLE as error:
            raise self._refusal(f"whole, but {entry.name} cannot be read ({error})") from error
        if digest.hexdigest() != entry.sha256:
            raise self._refusal(f"whole, but {entry.name} was changed or damaged")

    def read(self, name: str) -> bytes:
        """Return the content of a small file; raise `InvalidQuantity` as `chunks` does."""
        return b"".join(self.chunks(self.entries[name]))

    def _plain_members(self) -> dict[str, tarfile.TarInfo]:
        try:
            members = self._tar.getmembers()
        except UNREADABLE as error:
            raise self._refusal(f"whole ({error})") from error
        for member in members:
            if member.type not in (tarfile.REGTYPE, tarfile.AREGTYPE):
                raise self._refusal(f"of plain files, but {member.name!r} is none")
            if member.name != MANIFEST and not _is_inside(member.name):
                raise self._refusal(f"of files of a probe, but {member.name!r} leads elsewhere")
        found = {member.name: member for member in members}
        if len(found) < len(members):
            raise self._refusal("of files that are there once, but one is there twice")
        return found

    def _read_manifest(self) -> dict[str, Any]:
        member = self._members.pop(MANIFEST, None)
        if member is None or member.size > MOST_MANIFEST_BYTES:
            raise self._refusal("whole, but its manifest at the end is missing")
        try:
            content = self._tar.extractfile(member)
            manifest = json.loads(content.read() if content else b"")
            schema = manifest["schema"]
        except UNREADABLE as error:
            raise self._refusal(f"whole, but its manifest cannot be read ({error})") from error
        if schema != SCHEMA:
            raise self._refusal(f"a {SCHEMA}, but it is {schema!r}: restore it with the software that knows that")
        return dict(manifest)

    def _manifest_entries(self) -> dict[str, BackupEntry]:
        try:
            entries = [BackupEntry(**entry) for entry in self.manifest["entries"]]
            found = {entry.name: entry for entry in entries}
            sizes = {name: (entry.size, entry.mode & 0o777) for name, entry in found.items()}
        except UNREADABLE as error:
            raise self._refusal(f"whole, but its manifest cannot be read ({error})") from error
        if len(entries) > len(found) or sizes != {name: (m.size, m.mode) for name, m in self._members.items()}:
            raise self._refusal("of the files in its manifest, no more and no less")
        return found

    def _refusal(self, bound: str) -> InvalidQuantity:
        return InvalidQuantity("backup", self.path, bound, ANOTHER)


def _is_inside(name: str) -> bool:
    """Return whether a member lies in a section by a name that leads nowhere else."""
    parts = PurePosixPath(name).parts
    is_plain = str(PurePosixPath(name)) == name and "\\" not in name and "\0" not in name
    return is_plain and len(parts) > 1 and parts[0] in SECTIONS and ".." not in parts
