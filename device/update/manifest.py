"""The signed list of what a release is and holds: `tsis.release/1`, checked field by field.

It is read after its signature was verified; it is checked all the same, since a good key may sign a mistake.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

from device.errors import UnfitRelease, UntrustedRelease
from device.update.layout import UpdateLayout

FAMILY, MAJOR = "tsis.release", 1
MOST_FILES, MOST_FILE_BYTES = 1000, 2**31
VERSION = re.compile(r"[0-9][0-9A-Za-z.]{0,40}")
SHA256 = re.compile(r"[0-9a-f]{64}")
PART = r"[0-9A-Za-z_@+][0-9A-Za-z_@+.:-]{0,150}"
FILE_PATH = re.compile(rf"wheels/{PART}\.whl|systemd/{PART}(/{PART}){{0,2}}|sbom\.json")
REMEDY = "Build the release anew with `make bundle`."


@dataclass(frozen=True)
class ReleaseEntry:
    """One file of a release: its path in the release file, its size in bytes, its SHA-256 in hexadecimal."""

    path: str
    size: int
    sha256: str


@dataclass(frozen=True)
class ReleaseManifest:
    """What a release says of itself."""

    product: str
    version: str
    counter: int
    commit: str
    machine: str
    python: str
    hardware: tuple[str, ...]
    store_writes: int
    store_reads: tuple[int, ...]
    signers: str
    files: tuple[ReleaseEntry, ...]

    @property
    def name(self) -> str:
        """Return the name of the release: its version and counter."""
        return f"{self.version}+{self.counter}"

    def wheels(self) -> tuple[ReleaseEntry, ...]:
        """Return the wheels."""
        return tuple(entry for entry in self.files if entry.path.startswith("wheels/"))


def read_manifest(content: bytes) -> ReleaseManifest:
    """Return a manifest; raise `UntrustedRelease` for a malformed one, `UnfitRelease` for one of another schema."""
    try:
        record = json.loads(content, object_pairs_hook=_object)
        _require_schema(record["schema"])
        return _manifest(record)
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise UntrustedRelease(f"The release's manifest is malformed: {what}.", REMEDY) from None


def read_installed(layout: UpdateLayout, name: str) -> ReleaseManifest:
    """Return the manifest of a release that is installed. Raises `OSError` and what `read_manifest` does."""
    return read_manifest((layout.release(name) / "manifest.json").read_bytes())


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    record = dict(pairs)
    if len(record) != len(pairs):
        raise ValueError("a key is there twice")
    return record


def _require_schema(schema: object) -> None:
    if schema != f"{FAMILY}/{MAJOR}":
        cause = f"The release has the schema {schema!r}, and this probe reads {FAMILY}/{MAJOR}."
        raise UnfitRelease(cause, "Install first the release that the notes name as the step between.")


def _manifest(record: dict[str, Any]) -> ReleaseManifest:
    store = record["data_schemas"]["store"]
    files = tuple(_entry(one) for one in record["files"])
    _require_files(files)
    return ReleaseManifest(
        product=_text(record, "product"),
        version=_text(record, "version", VERSION),
        counter=_whole(record["counter"], "counter", 2**53),
        commit=_text(record, "commit"),
        machine=_text(record, "machine"),
        python=_text(record, "python"),
        hardware=tuple(str(kind) for kind in record["hardware"]),
        store_writes=_whole(store["writes"], "data_schemas.store.writes", 2**31),
        store_reads=tuple(_whole(one, "data_schemas.store.reads", 2**31) for one in store["reads"]),
        signers=_text(record, "signers"),
        files=files,
    )


def _entry(record: dict[str, Any]) -> ReleaseEntry:
    path = _text(record, "path", FILE_PATH)
    return ReleaseEntry(path, _whole(record["size"], path, MOST_FILE_BYTES), _text(record, "sha256", SHA256))


def _require_files(files: Iterable[ReleaseEntry]) -> None:
    paths = [entry.path for entry in files]
    if len(set(paths)) != len(paths):
        raise ValueError("a file is listed twice")
    if len(paths) > MOST_FILES:
        raise ValueError(f"{len(paths)} files, more than {MOST_FILES}")
    if not any(path.startswith("wheels/tsis-") for path in paths):
        raise ValueError("the wheel of the product itself is not listed")


def _text(record: dict[str, Any], key: str, pattern: re.Pattern[str] | None = None) -> str:
    value = record[key]
    if not isinstance(value, str) or (pattern and not pattern.fullmatch(value)):
        raise ValueError(f"{key} is {value!r}")
    return value


def _whole(value: object, name: str, most: int) -> int:
    if type(value) is not int or not 0 <= value <= most:
        raise ValueError(f"{name} is {value!r}, and must be a whole number from 0 to {most}")
    return value
