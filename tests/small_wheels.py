"""Wheels of a few bytes and a lock for them: what stands in for the hundred megabytes of a probe's packages."""

from __future__ import annotations

import zipfile
from hashlib import sha256
from pathlib import Path

PURE = "py3-none-any"


def small_wheel(folder: Path, name: str, version: str = "1.0", tag: str = PURE, metadata: str = "") -> Path:
    """Write a wheel of one module; `metadata` are more lines of its METADATA."""
    folder.mkdir(parents=True, exist_ok=True)
    module = name.replace("-", "_")
    path = folder / f"{module}-{version}-{tag}.whl"
    info = f"{module}-{version}.dist-info"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(zipfile.ZipInfo(f"{module}.py"), f"# {name}\n")
        text = f"Metadata-Version: 2.4\nName: {name}\nVersion: {version}\n{metadata}"
        archive.writestr(zipfile.ZipInfo(f"{info}/METADATA"), text)
        wheel = f"Wheel-Version: 1.0\nGenerator: by hand\nRoot-Is-Purelib: true\nTag: {tag}\n"
        archive.writestr(zipfile.ZipInfo(f"{info}/WHEEL"), wheel)
        archive.writestr(zipfile.ZipInfo(f"{info}/RECORD"), "")
    return path


def locked(path: Path, marker: str = "") -> str:
    """Return the lines of a lock that pin a wheel by its name and hash."""
    name, version = path.name.split("-")[:2]
    stated = f"{name.replace('_', '-')}=={version}" + (f" ; {marker}" if marker else "")
    return f"{stated} \\\n    --hash=sha256:{sha256(path.read_bytes()).hexdigest()}\n    # via tsis (pyproject.toml)\n"
