"""A wheel to the files it brings: looked through whole before the first is written.

A wheel is a zip. Its members are plain files below site-packages; purelib and platlib of its `.data` folder belong
there too, and its scripts are left out, since a release is started by `bin/python -m` alone.
"""

from __future__ import annotations

import io
import stat
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath

from device.errors import UntrustedRelease

MOST_EXPANSION, SPARE_BYTES = 30, 2**20
"""A wheel may become as many times its size, and some more; those of the lock become three to five times theirs."""
MOST_MEMBERS = 20_000
REMEDY = "Build the release anew with `make bundle`."


@dataclass(frozen=True)
class WheelFile:
    """A file that a wheel brings: its name in the zip, its place below site-packages, its size, whether it is run."""

    member: str
    place: str
    size: int
    is_program: bool


def wheel_files(content: bytes, path: str) -> list[WheelFile]:
    """Return what a wheel brings; raise `UntrustedRelease` for a member that must not be, or for too much of it."""
    with _opened(content, path) as archive:
        members = [member for member in archive.infolist() if not member.is_dir()]
        _require_size(members, len(content), path)
        found = [_wheel_file(member, path) for member in members]
    files = [file for file in found if file]
    _require_distinct([file.place for file in files], path)
    return files


def wheel_contents(content: bytes, path: str, files: list[WheelFile]) -> Iterator[tuple[WheelFile, bytes]]:
    """Yield files of a wheel with their bytes; raise `UntrustedRelease` when one has not the size it states."""
    with _opened(content, path) as archive:
        for file in files:
            try:
                found = archive.read(file.member)
            except (zipfile.BadZipFile, OSError, ValueError, NotImplementedError, EOFError) as error:
                raise UntrustedRelease(f"{path} is damaged at {file.member}: {error}.", REMEDY) from None
            if len(found) != file.size:
                raise UntrustedRelease(f"{path}: {file.member} has {len(found)} bytes, not {file.size}.", REMEDY)
            yield file, found


def _opened(content: bytes, path: str) -> zipfile.ZipFile:
    try:
        return zipfile.ZipFile(io.BytesIO(content))
    except (zipfile.BadZipFile, ValueError, OSError) as error:
        raise UntrustedRelease(f"{path} is not a wheel: {error}.", REMEDY) from None


def _require_size(members: list[zipfile.ZipInfo], packed: int, path: str) -> None:
    unpacked, most = sum(member.file_size for member in members), MOST_EXPANSION * packed + SPARE_BYTES
    if unpacked > most:
        raise UntrustedRelease(f"{path} of {packed} bytes would become {unpacked}, above {most}.", REMEDY)
    if len(members) > MOST_MEMBERS:
        raise UntrustedRelease(f"{path} has {len(members)} members, above {MOST_MEMBERS}.", REMEDY)


def _wheel_file(member: zipfile.ZipInfo, path: str) -> WheelFile | None:
    """Return what a member brings, or None for one that is left out."""
    kind = stat.S_IFMT(member.external_attr >> 16)
    if kind not in (0, stat.S_IFREG) or member.flag_bits & 1:
        raise UntrustedRelease(f"{path}: {member.filename} is a link, a device or encrypted.", REMEDY)
    parts = _parts(member.filename, path)
    if parts[0].endswith(".data"):
        if len(parts) < 3:
            raise UntrustedRelease(f"{path}: {member.filename} has no place.", REMEDY)
        if parts[1] not in ("purelib", "platlib"):
            return None
        parts = parts[2:]
    is_program = bool((member.external_attr >> 16) & 0o111)
    return WheelFile(member.filename, "/".join(parts), member.file_size, is_program)


def _parts(name: str, path: str) -> tuple[str, ...]:
    parts = tuple(name.split("/"))
    if not all(parts) or {".", ".."} & set(parts) or "\\" in name or "\0" in name or len(name) > 400:
        raise UntrustedRelease(f"{path}: {name!r} leads out of its place.", REMEDY)
    return parts


def _require_distinct(places: list[str], path: str) -> None:
    """Require that no place is taken twice, and that none is a folder to another."""
    taken = set(places)
    if len(taken) < len(places):
        raise UntrustedRelease(f"{path} brings a file twice.", REMEDY)
    for place in places:
        if any(str(folder) in taken for folder in PurePosixPath(place).parents):
            raise UntrustedRelease(f"{path}: {place} lies in a file.", REMEDY)
