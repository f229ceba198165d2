"""Whom a release file is for: Debian 12 on a machine, as wheels and markers of requirements see it.

glibc runs what was built for it or for an older one, so every manylinux tag up to its own version is good; the newest
is tried first. Source: PEP 600; Debian 12 has glibc 2.36 and Python 3.11.2.
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cache
from pathlib import PurePath

from packaging.tags import Tag, compatible_tags, cpython_tags
from packaging.utils import InvalidWheelFilename, parse_wheel_filename

from device.measurement.quantities import InvalidQuantity

PYTHON, PYTHON_FULL, ABI = (3, 11), "3.11.2", "cp311"
GLIBC_MINOR = 36
OLDEST_GLIBC_MINOR = {"aarch64": 17, "x86_64": 5}
"""The first manylinux of each machine; wheels for an aarch64 were first built on glibc 2.17."""
OLD_NAMES = {17: "manylinux2014", 12: "manylinux2010", 5: "manylinux1"}


@dataclass(frozen=True)
class Target:
    """A machine by its name in Linux, such as aarch64, with Debian 12."""

    machine: str

    @classmethod
    def named(cls, machine: str) -> Target:
        """Return a target; raise `InvalidQuantity` for a machine that releases are not built for."""
        if machine not in OLDEST_GLIBC_MINOR:
            raise InvalidQuantity("machine", repr(machine), f"one of {', '.join(OLDEST_GLIBC_MINOR)}", "choose one")
        return cls(machine)

    @property
    def name(self) -> str:
        """What wheels for it have in common, for messages and for the name of a folder."""
        return f"{ABI}-manylinux_2_{GLIBC_MINOR}_{self.machine}"

    def platforms(self) -> list[str]:
        """Return the platforms of wheels that it takes, the newest first."""
        found = []
        for minor in range(GLIBC_MINOR, OLDEST_GLIBC_MINOR[self.machine] - 1, -1):
            found.append(f"manylinux_2_{minor}_{self.machine}")
            if minor in OLD_NAMES:
                found.append(f"{OLD_NAMES[minor]}_{self.machine}")
        return found

    def tags(self) -> dict[Tag, int]:
        """Return the tags of wheels that it takes, each with its rank: 0 is the best."""
        return _ranked(tuple(self.platforms()))

    def rank(self, wheel: PurePath) -> int | None:
        """Return how good a wheel is for it by its name, 0 the best; None for one that it does not take."""
        try:
            tags = parse_wheel_filename(wheel.name)[3]
        except InvalidWheelFilename:
            return None
        known = self.tags()
        return min((known[tag] for tag in tags if tag in known), default=None)

    def markers(self) -> dict[str, str | AbstractSet[str]]:
        """Return what the markers of a requirement are compared with."""
        return {
            "implementation_name": "cpython",
            "implementation_version": PYTHON_FULL,
            "os_name": "posix",
            "platform_machine": self.machine,
            "platform_python_implementation": "CPython",
            "platform_release": "",
            "platform_system": "Linux",
            "platform_version": "",
            "python_full_version": PYTHON_FULL,
            "python_version": ".".join(map(str, PYTHON)),
            "sys_platform": "linux",
        }


@cache
def _ranked(platforms: tuple[str, ...]) -> dict[Tag, int]:
    ordered = [*cpython_tags(PYTHON, [ABI], platforms), *compatible_tags(PYTHON, ABI, platforms)]
    return {tag: rank for rank, tag in reversed(list(enumerate(ordered)))}
