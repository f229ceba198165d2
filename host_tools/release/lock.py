"""requirements/device.lock, as uv writes it: which version of what, for whom, and the hashes its files may have."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from packaging.requirements import InvalidRequirement, Requirement
from packaging.utils import canonicalize_name

from device.measurement.quantities import InvalidQuantity
from host_tools.release.target import Target

HASH = re.compile(r"\s--hash=sha256:([0-9a-f]{64})(?=\s|$)")


@dataclass(frozen=True)
class LockedRequirement:
    """One pinned version, the marker of those it is for, and the SHA-256 of each file that may be taken."""

    requirement: Requirement
    hashes: frozenset[str]

    @property
    def pinned(self) -> str:
        """The version alone, as name==version; whom it is for is decided already."""
        return f"{self.requirement.name}{self.requirement.specifier}"

    @property
    def name(self) -> str:
        """Its name in the one spelling that can be compared."""
        return canonicalize_name(self.requirement.name)

    def is_for(self, target: Target) -> bool:
        """Return whether a target needs it."""
        marker = self.requirement.marker
        return marker is None or marker.evaluate(target.markers())


def read_lock(path: Path) -> tuple[LockedRequirement, ...]:
    """Return the requirements of a lock; raise `InvalidQuantity` for a line that is not name==version with hashes."""
    whole = re.sub(r"\\\n", " ", path.read_text(encoding="utf-8"))
    lines = (line.strip() for line in whole.splitlines())
    return tuple(_locked(line, path) for line in lines if line and not line.startswith("#"))


def needed(lock: Iterable[LockedRequirement], target: Target) -> tuple[LockedRequirement, ...]:
    """Return what a target needs of a lock, by name; raise `InvalidQuantity` where two lines are for it."""
    chosen: dict[str, LockedRequirement] = {}
    for one in lock:
        if not one.is_for(target):
            continue
        if one.name in chosen:
            both = f"{chosen[one.name].pinned} and {one.pinned}"
            raise InvalidQuantity(f"lock of {target.name}", both, "one version of each", "run `make lock`")
        chosen[one.name] = one
    return tuple(chosen[name] for name in sorted(chosen))


def _locked(line: str, path: Path) -> LockedRequirement:
    stated, hashes = HASH.sub("", line), frozenset(HASH.findall(line))
    try:
        requirement = Requirement(stated)
    except InvalidRequirement as error:
        raise InvalidQuantity(str(path), stated, "name==version", "run `make lock`") from error
    pins = list(requirement.specifier)
    if len(pins) != 1 or pins[0].operator != "==" or requirement.url or not hashes:
        raise InvalidQuantity(str(path), stated, "one version with its hashes", "run `make lock`")
    return LockedRequirement(requirement, hashes)
