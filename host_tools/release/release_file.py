"""The release file: a plain tar of the manifest, its signature, and all that the manifest lists, in its order.

Not compressed, for wheels are. No folders, no links, one mode, no times and no owners: the same files give the same
bytes. The manifest's schema is `tsis.release/1`; docs/deploy.md says what each of its fields is for.
"""

from __future__ import annotations

import json
import tarfile
from collections.abc import Mapping
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

from device.errors import DeviceError
from device.files.durable import sync_directory
from device.measurement.quantities import InvalidQuantity
from device.records.schema import STORE_READS, STORE_WRITES
from device.update.fits import FIRST_HARDWARE
from device.update.manifest import read_manifest
from device.update.release_file import opened
from device.update.signature import require_signature
from host_tools.release.locked_wheels import sha256_of
from host_tools.release.target import Target

SCHEMA, PRODUCT = "tsis.release/1", "tsis"
MANIFEST, SIGNATURE = "manifest.json", "manifest.json.sig"


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
        "python": target.system.python,
        "hardware": [FIRST_HARDWARE],
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


def checked_manifest(path: Path, signers: str) -> dict[str, Any]:
    """Return the manifest of a release file as a probe that trusts a list of signers finds it: signed, all files whole.

    Raises `InvalidQuantity` with the probe's own reason otherwise.
    """
    try:
        with TemporaryDirectory() as folder, opened(path) as file:
            trusted = Path(folder, "release_signers")
            trusted.write_text(signers, encoding="utf-8")
            manifest, signature = file.signed()
            require_signature(manifest, signature, trusted)
            file.check_files(read_manifest(manifest), lambda _: None)
    except DeviceError as error:
        raise InvalidQuantity("file", path, "a release that a probe takes", str(error)) from error
    record: dict[str, Any] = json.loads(manifest)
    return record


def _add(archive: tarfile.TarFile, name: str, size: int, content: IO[bytes]) -> None:
    member = tarfile.TarInfo(name)
    member.size, member.mode = size, 0o644
    archive.addfile(member, content)
