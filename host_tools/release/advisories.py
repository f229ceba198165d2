"""Which parts of a release have vulnerabilities that are known: its parts list beside a database of advisories.

The database is a folder or a zip of advisories in the OSV form, one a JSON file, as https://osv.dev gives away of each
ecosystem; nothing is asked of a network, and nobody is told what a probe is made of.
Source: Open Source Vulnerability format, https://ossf.github.io/osv-schema/, section "Evaluation".
"""

from __future__ import annotations

import json
import tarfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from packageurl import PackageURL
from packaging.utils import canonicalize_name
from packaging.version import InvalidVersion, Version

from device.measurement.quantities import InvalidQuantity

ECOSYSTEM, OF_PURL = "PyPI", "pypi"
PARTS_LIST = "sbom.json"
FETCH = "fetch all.zip of PyPI from osv.dev"


@dataclass(frozen=True)
class ListedWheel:
    """A wheel of a release: its name in the one spelling that can be compared, and its version."""

    name: str
    version: str


@dataclass(frozen=True)
class KnownVulnerability:
    """An advisory that a part falls under: its names, what it is about, and the versions that mend it."""

    part: ListedWheel
    names: tuple[str, ...]
    summary: str
    mended_in: tuple[str, ...]


@dataclass(frozen=True)
class Comparison:
    """What was compared with what; `newest` is when the youngest of the advisories was changed (RFC 3339)."""

    parts: int
    advisories: int
    newest: str
    found: tuple[KnownVulnerability, ...]


def parts_of(file: Path) -> list[ListedWheel]:
    """Return the parts of a release file, or of a parts list by itself; raise `InvalidQuantity` where there is none."""
    try:
        listed = json.loads(_parts_list(file))["components"]
        urls = [PackageURL.from_string(one["purl"]) for one in listed]
    except (OSError, KeyError, TypeError, ValueError, tarfile.TarError) as error:
        raise InvalidQuantity(
            "parts list", file, "a release file or its sbom.json", "build one: make bundle"
        ) from error
    parts = [ListedWheel(canonicalize_name(url.name), url.version or "") for url in urls if url.type == OF_PURL]
    if not parts or not all(part.version for part in parts):
        raise InvalidQuantity("parts list", file, "one whose parts have versions", "build one: make bundle")
    return parts


def compared(parts: Sequence[ListedWheel], database: Path) -> Comparison:
    """Compare parts with every advisory of a database.

    Raises `InvalidQuantity` for a database that cannot be read, or holds no advisory for wheels: then nothing is known.
    """
    by_name = {part.name: part for part in parts}
    count, newest, found = 0, "", list[KnownVulnerability]()
    for name, record in _records(database):
        try:
            affected = [one for one in record.get("affected", []) if one["package"]["ecosystem"] == ECOSYSTEM]
            if affected and "withdrawn" not in record:
                count, newest = count + 1, max(newest, record["modified"])
                found += _vulnerabilities(record, affected, by_name)
        except (KeyError, TypeError, AttributeError, InvalidVersion) as error:
            raise InvalidQuantity("advisory", name, f"in the OSV form ({error})", FETCH) from error
    if not count:
        raise InvalidQuantity("database", database, "one with advisories for wheels", FETCH)
    return Comparison(len(parts), count, newest, tuple(sorted(found, key=lambda one: (one.part.name, one.names))))


def _parts_list(file: Path) -> bytes:
    if not tarfile.is_tarfile(file):
        return file.read_bytes()
    with tarfile.open(file) as archive:
        member = archive.extractfile(PARTS_LIST)
        return member.read() if member else b""


def _records(database: Path) -> Iterator[tuple[str, Mapping[str, Any]]]:
    try:
        if database.is_dir():
            texts = ((path.name, path.read_bytes()) for path in sorted(database.rglob("*.json")))
            yield from ((name, json.loads(text)) for name, text in texts)
        else:
            with zipfile.ZipFile(database) as archive:
                for name in archive.namelist():
                    yield name, json.loads(archive.read(name))
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise InvalidQuantity("database", database, f"a folder or a zip of JSON files ({error})", FETCH) from error


def _vulnerabilities(
    record: Mapping[str, Any], affected: Sequence[Mapping[str, Any]], by_name: Mapping[str, ListedWheel]
) -> Iterator[KnownVulnerability]:
    for one in affected:
        part = by_name.get(canonicalize_name(one["package"]["name"]))
        if part and _is_affected(part.version, one):
            names = (record["id"], *record.get("aliases", []))
            told = record.get("summary") or record.get("details", "")
            yield KnownVulnerability(part, names, told.partition("\n")[0], tuple(_mended_in(one)))


def _is_affected(version: str, affected: Mapping[str, Any]) -> bool:
    own = Version(version)
    named = any(version == one or _same(own, one) for one in affected.get("versions", []))
    return named or any(_is_within(own, one["events"]) for one in _ranges(affected))


def _same(own: Version, other: str) -> bool:
    """Tell whether another spelling is of the same version; old advisories name some that are none."""
    try:
        return own == Version(other)
    except InvalidVersion:
        return False


def _ranges(affected: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the ranges of versions; those of commits say nothing of a wheel."""
    return [one for one in affected.get("ranges", []) if one["type"] == "ECOSYSTEM"]


def _is_within(own: Version, events: Sequence[Mapping[str, str]]) -> bool:
    """Tell whether a version is in a range, by its events in their order (section "Evaluation")."""
    is_within = False
    for kind, value in sorted((item for event in events for item in event.items()), key=_order):
        if kind == "introduced":
            is_within = is_within or value == "0" or own >= Version(value)
        elif (kind == "fixed" and own >= Version(value)) or (kind == "last_affected" and own > Version(value)):
            is_within = False
    return is_within


def _order(event: tuple[str, str]) -> tuple[bool, Version]:
    """Return where an event stands among others: "0" is before every version."""
    return event[1] != "0", Version(event[1])


def _mended_in(affected: Mapping[str, Any]) -> Iterator[str]:
    for one in _ranges(affected):
        yield from (event["fixed"] for event in one["events"] if "fixed" in event)
