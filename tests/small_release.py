"""Release files made in a test: a small wheel, a manifest, a signature by a key of this session, a tar."""

from __future__ import annotations

import hashlib
import io
import json
import platform
import subprocess
import sys
import tarfile
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

IDENTITY, NAMESPACE = "release@tsis", "tsis-release"
BEHAVIOUR = "tsis_fake.json"


def new_key(folder: Path, name: str) -> Path:
    """Make a key pair without a password; return the private key's path."""
    path = folder / name
    subprocess.run(["ssh-keygen", "-q", "-t", "ed25519", "-N", "", "-C", name, "-f", str(path)], check=True)
    return path


def signer(key: Path, identity: str = IDENTITY) -> str:
    """Return a key's line of an allowed-signers file."""
    kind, public = key.with_suffix(".pub").read_text().split()[:2]
    return f'{identity} namespaces="{NAMESPACE}" {kind} {public}\n'


def signature(content: bytes, key: Path, namespace: str = NAMESPACE) -> bytes:
    """Return the armoured signature of some bytes."""
    return _signature(content, key, key.read_bytes(), namespace)


@cache
def _signature(content: bytes, key: Path, private: bytes, namespace: str) -> bytes:
    command = ["ssh-keygen", "-q", "-Y", "sign", "-n", namespace, "-f", str(key)]
    return subprocess.run(command, input=content, capture_output=True, check=True).stdout


def wheel(files: Mapping[str, bytes | str]) -> bytes:
    """Return a wheel with these files."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name), content, zipfile.ZIP_DEFLATED)
    return packed.getvalue()


def small_files(version: str, behaviour: Mapping[str, Any] | None = None, filler: int = 1) -> dict[str, bytes]:
    """Return the files of a release: two wheels, a unit, a parts list; `behaviour` is its fake daemon's."""
    own: dict[str, bytes | str] = {
        "tsis_fake/__init__.py": f"VERSION = {version!r}\n",
        BEHAVIOUR: json.dumps(behaviour or {}),
        f"tsis-{version}.data/purelib/tsis_pure.py": "PURE = True\n",
        f"tsis-{version}.data/scripts/tsis": "#!/bin/sh\n",
        f"tsis-{version}.dist-info/METADATA": f"Name: tsis\nVersion: {version}\n",
    }
    other: dict[str, bytes | str] = {f"number/part_{n}.py": f"PART = {version!r}, {n}\n" * 50 for n in range(filler)}
    return {
        "wheels/number-2.0-py3-none-any.whl": wheel({"number/__init__.py": "", **other}),
        f"wheels/tsis-{version}-py3-none-any.whl": wheel(own),
        "systemd/tsis.service": f"# the daemon of {version}\n".encode(),
        "sbom.json": b'{"bomFormat": "CycloneDX"}\n',
    }


def manifest(content: Mapping[str, bytes], version: str, counter: int, **changes: Any) -> bytes:
    """Return the manifest of these files; `changes` replace its entries."""
    record = {
        "schema": "tsis.release/1", "product": "tsis", "version": version, "counter": counter, "commit": "0" * 40,
        "machine": platform.machine(), "python": f"{sys.version_info.major}.{sys.version_info.minor}",
        "hardware": ["tsis-probe-1"], "data_schemas": {"store": {"writes": 1, "reads": [1]}}, "signers": "",
        "files": [
            {"path": path, "size": len(own), "sha256": hashlib.sha256(own).hexdigest()} for path, own in content.items()
        ],
    }  # fmt: skip
    return json.dumps(record | changes).encode()


def tar(members: Mapping[str, bytes] | list[tuple[tarfile.TarInfo, bytes]]) -> bytes:
    """Return a tar of the form that a release file has."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for info, content in members if isinstance(members, list) else map(plain, members.items()):
            archive.addfile(info, io.BytesIO(content))
    return packed.getvalue()


def plain(member: tuple[str, bytes]) -> tuple[tarfile.TarInfo, bytes]:
    """Return the header of a plain file."""
    info = tarfile.TarInfo(member[0])
    info.size = len(member[1])
    return info, member[1]


def release_file(
    key: Path, version: str, counter: int, behaviour: Mapping[str, Any] | None = None,
    content: Mapping[str, bytes] | None = None, filler: int = 1, **changes: Any,
) -> bytes:  # fmt: skip
    """Return a release file that `key` signed; `changes` are of its manifest."""
    files = small_files(str(version), behaviour, filler) if content is None else content
    signed = manifest(files, version, counter, **changes)
    return tar({"manifest.json": signed, "manifest.json.sig": signature(signed, key), **files})
