"""Recordings as one .zip that is made while it is sent: no piece of it is held, whatever its size.

It begins with the table of its measurements. A recording that cannot be read does not end it: which are missing, and
why, stands in `missing.csv`, its last file, which is there always.
"""

from __future__ import annotations

import csv
import io
import zipfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from device.errors import DeviceError
from device.exports.selection import Exported
from device.exports.table import wide_table
from device.records.store import Store

PIECE_BYTES = 1 << 18


def archive_of(store: Store, exported: Iterable[Exported]) -> Iterator[bytes]:
    """Yield the .zip piece by piece: `measurements.csv`, `recordings/...`, `missing.csv`.

    `exported` is gone through twice.
    """
    sent = _Sent()
    missing: list[tuple[str, str, str]] = []
    with zipfile.ZipFile(sent, "w", zipfile.ZIP_STORED, strict_timestamps=False) as archive:
        yield from _table(archive, sent, exported)
        for one in exported:
            measurement = one.measurement
            try:
                yield from _recording(archive, sent, store.recording_path(measurement["recording_id"]))
            except (DeviceError, OSError) as error:
                missing.append((measurement["id"], measurement["recording_id"], str(error)))
        archive.writestr(_entry("missing.csv"), _csv(("measurement_id", "recording_id", "why"), missing))
    yield sent.taken()


def _table(archive: zipfile.ZipFile, sent: _Sent, exported: Iterable[Exported]) -> Iterator[bytes]:
    with archive.open(_entry("measurements.csv"), "w", force_zip64=True) as member:
        for part in wide_table(exported):
            member.write(part)
            if sent.bytes_waiting > PIECE_BYTES:
                yield sent.taken()


def _recording(archive: zipfile.ZipFile, sent: _Sent, path: Path) -> Iterator[bytes]:
    """Yield a recording's file, or the files of its folder as they are."""
    files = [path] if path.is_file() else sorted(one for one in path.rglob("*") if one.is_file())
    for file in files:
        entry = _entry(f"recordings/{file.relative_to(path.parent).as_posix()}", file.stat().st_size)
        with file.open("rb") as source, archive.open(entry, "w") as member:
            while piece := source.read(PIECE_BYTES):
                member.write(piece)
                yield sent.taken()


def _entry(name: str, size_bytes: int = 0) -> zipfile.ZipInfo:
    """Return a member that has no time of its own, for a clock may be wrong; with its size where that is known."""
    entry = zipfile.ZipInfo(name)
    entry.external_attr = 0o644 << 16
    entry.file_size = size_bytes
    return entry


def _csv(header: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> str:
    text = io.StringIO(newline="")
    csv.writer(text).writerows([header, *rows])
    return text.getvalue()


class _Sent:
    """What is written to the client: it cannot be sought, so each member's size and sum follow it."""

    def __init__(self) -> None:
        self._waiting = bytearray()

    @property
    def bytes_waiting(self) -> int:
        """How much was written and not taken."""
        return len(self._waiting)

    def write(self, content: bytes) -> int:
        self._waiting += content
        return len(content)

    def flush(self) -> None:
        """Do nothing: what was written is taken by who sends it."""

    def close(self) -> None:
        """Do nothing, as `flush`."""

    def taken(self) -> bytes:
        """Return what was written since the last time."""
        content = bytes(self._waiting)
        self._waiting.clear()
        return content
