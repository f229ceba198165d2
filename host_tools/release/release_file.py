"""The release file: a plain tar of the manifest, its signature, and all that the manifest lists, in its order.

Not compressed, for wheels are. No folders, no links, one mode, no times and no owners: the same files give the same
bytes. The manifest's schema is `tsis.release/1`; docs/deploy.md says what each of its fields is for.
"""

from __future__ import annotations

import json
import tarfile
from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import IO, Any

from device.files.durable import sync_directory
from device.measurement.quantities import InvalidQuantity
from device.records.schema import STORE_READS, STORE_WRITES
from host_tools.release.locked_wheels import sha256_of
from host_tools.release.signing import require_signed
from host_tools.release.target import PYTHON, Target

SCHEMA, PRODUCT = "tsis.release/1", "tsis"
HARDWARE = ("tsis-probe-1",)
"""The kinds of probe that this software drives."""
MANIFEST, SIGNATURE = "manifest.json", "manifest.json.sig"
MOST_MANIFEST_BYTES = 2**20


@dataclass(frozen=True)
class Edition:
    """What a release is called: version, counter, and the commit it was built from; `signers` changes whom to trust.

    The counter says which of two releases is newer. Without `signers` a probe trusts whom it trusted before.
    """

    version: str
    counter: int
    commit: str
    signers: str = ""


def manifest_of(edition: Edition, target: Target, files: Mapping[str, Path]) -> bytes:
    """Return the manifest of files by their names in the release file."""
    record: dict[str, Any] = {
        "schema": SCHEMA,
        "product": PRODUCT,
        "version": edition.version,
        "counter": edition.counter,
        "commit": edition.commit,
        "machine": target.machine,
        "python": ".".join(map(str, PYTHON)),
        "hardware": list(HARDWARE),
        "data_schemas": {"store": {"writes": STORE_WRITES, "reads": list(STORE_READS)}},
        "signers": edition.signers,
        "files": [
            {"path": name, "size": path.stat().st_size, "sha256": sha256_of(path)} for name, path in files.items()
        ],
    }
    return (json.dumps(record, indent=1, ensure_ascii=True) + "\n").encode()


def write_release(out: Path, manifest: bytes, signature: bytes, files: Mapping[str, Path]) -> None:
    """Write a release file, whole or not at all."""
    out.parent.mkdir(parents=True, exist_ok=True)
    unfinished = out.with_name(f"{out.name}.tmp")
    with tarfile.open(unfinished, "w", format=tarfile.USTAR_FORMAT) as archive:
        for name, content in ((MANIFEST, manifest), (SIGNATURE, signature)):
            _add(archive, name, len(content), BytesIO(content))
        for name, path in files.items():
            with path.open("rb") as file:
                _add(archive, name, path.stat().st_size, file)
    unfinished.replace(out)
    sync_directory(out.parent)


def signed_manifest(path: Path) -> tuple[bytes, bytes]:
    """Return the manifest of a release file and its signature, neither of them checked.

    Raises `InvalidQuantity` for a file that does not begin with them.
    """
    try:
        with tarfile.open(path, "r:") as archive:
            return _next(archive, MANIFEST), _next(archive, SIGNATURE)
    except (tarfile.TarError, EOFError) as error:
        raise InvalidQuantity("file", path, "a release file", f"build one with `make bundle`: {error}") from error


def checked_manifest(path: Path, signers: str) -> dict[str, Any]:
    """Return the manifest of a release file that a key in a list of signers has signed, and whose files are all whole.

    Raises `InvalidQuantity` otherwise.
    """
    manifest, signature = signed_manifest(path)
    require_signed(manifest, signature, signers)
    record: dict[str, Any] = json.loads(manifest)
    with tarfile.open(path, "r:") as archive:
        found = [(member.name, _sha256(archive, member)) for member in archive][2:]
    stated = [(entry["path"], entry["sha256"]) for entry in record["files"]]
    if found != stated:
        wrong = next((name for name, _ in set(stated) ^ set(found)), "the order of its files")
        raise InvalidQuantity("file", path, "as its manifest says", f"copy it again: {wrong} differs")
    return record


def _sha256(archive: tarfile.TarFile, member: tarfile.TarInfo) -> str:
    content = archive.extractfile(member)
    return sha256(content.read()).hexdigest() if content else "no file"


def _next(archive: tarfile.TarFile, name: str) -> bytes:
    member = archive.next()
    if member is None or member.name != name or not member.isreg() or member.size > MOST_MANIFEST_BYTES:
        raise tarfile.ReadError(f"{name} is not where it has to be")
    content = archive.extractfile(member)
    assert content is not None
    return content.read()


def _add(archive: tarfile.TarFile, name: str, size: int, content: IO[bytes]) -> None:
    member = tarfile.TarInfo(name)
    member.size, member.mode = size, 0o644
    archive.addfile(member, content)
