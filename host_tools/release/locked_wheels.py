"""The wheels of a lock for a target: from a folder that keeps them, or by pip from the index it is set up for.

A wheel counts only with one of the lock's hashes, wherever it comes from. Each requirement is asked for by itself, so
that one without a wheel for the target is named.
"""

from __future__ import annotations

import hashlib
import subprocess
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

from packaging.utils import canonicalize_name, parse_wheel_filename

from device.measurement.quantities import InvalidQuantity
from host_tools.release.lock import LockedRequirement
from host_tools.release.target import Target

MOST_NAME = 100
"""Characters of a file's name in a POSIX archive of 1988, without its folder."""


def locked_wheels(
    requirements: Sequence[LockedRequirement], target: Target, kept: Path, told: Callable[[LockedRequirement], None]
) -> list[Path]:
    """Return a wheel of each requirement, in their order; those not in the folder `kept` are downloaded into it.

    `told` hears of each that is there. Raises `InvalidQuantity` where the index has none for the target.
    """
    kept.mkdir(parents=True, exist_ok=True)
    wheels = []
    for one in requirements:
        wheels.append(_best(one, target, kept) or _downloaded(one, target, kept))
        told(one)
    return wheels


def name_in_release(name: str) -> str:
    """Return the name of a wheel in a release file, whose headers hold `MOST_NAME` characters.

    One that lists many platforms keeps the first of them: any of them is enough to be installed. Source: PEP 425,
    compressed tag sets.
    """
    if len(name) <= MOST_NAME:
        return name
    *parts, platforms = name.removesuffix(".whl").split("-")
    return "-".join([*parts, platforms.partition(".")[0]]) + ".whl"


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a file, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _best(one: LockedRequirement, target: Target, folder: Path) -> Path | None:
    """Return the best wheel of a requirement in a folder, if there is one."""
    ranked = []
    for path in sorted(folder.glob("*.whl")):
        rank = target.rank(path)
        if rank is not None and _is_of(path, one) and sha256_of(path) in one.hashes:
            ranked.append((rank, path))
    return min(ranked)[1] if ranked else None


def _is_of(path: Path, one: LockedRequirement) -> bool:
    name, version, _, _ = parse_wheel_filename(path.name)
    return canonicalize_name(name) == one.name and version in one.requirement.specifier


def _downloaded(one: LockedRequirement, target: Target, kept: Path) -> Path:
    """Let pip fetch the wheel; raise `InvalidQuantity` with what pip says when it finds none."""
    with TemporaryDirectory(dir=kept) as folder:
        listed = Path(folder, "one.txt")
        listed.write_text(" ".join([one.pinned, *(f"--hash=sha256:{each}" for each in sorted(one.hashes))]))
        done = subprocess.run(_pip(listed, target, folder), capture_output=True, text=True, check=False)
        found = _best(one, target, Path(folder))
        if done.returncode or found is None:
            raise InvalidQuantity(one.pinned, "no wheel", f"one for {target.name}", _advice(done.stderr, target))
        return found.replace(kept / found.name)


def _advice(said: str, target: Target) -> str:
    lines = [line for line in said.splitlines() if line.startswith("ERROR")] or said.splitlines() or ["nothing"]
    said_last, tags = lines[-1].removeprefix("ERROR: "), ", ".join([*target.platforms(), "any"])
    return f"pin a version that has one, or mend the index: pip found none of {tags}, and says {said_last!r}"


def _pip(listed: Path, target: Target, folder: str) -> list[str]:
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--disable-pip-version-check", "--no-deps"]
    command += ["--require-hashes", "--only-binary=:all:", "--requirement", str(listed), "--dest", folder]
    command += ["--python-version", target.system.python, "--implementation", "cp"]
    command += [word for abi in (target.system.abi, "abi3", "none") for word in ("--abi", abi)]
    return command + [word for platform in target.platforms() for word in ("--platform", platform)]
