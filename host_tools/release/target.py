"""Whom a release file is for: a Debian on a machine, as wheels and markers of requirements see it.

glibc runs what was built for it or for an older one, so every manylinux tag up to its own version is good; the newest
is tried first. Source: PEP 600; Debian's packages libc6 and python3 of bookworm (12) and trixie (13).
"""

from __future__ import annotations

from collections.abc import Set as AbstractSet
from dataclasses import dataclass
from functools import cache
from pathlib import PurePath

from packaging.tags import Tag, compatible_tags, cpython_tags
from packaging.utils import InvalidWheelFilename, parse_wheel_filename

from device.measurement.quantities import InvalidQuantity

OLDEST_GLIBC_MINOR = {"aarch64": 17, "x86_64": 5}
"""The first manylinux of each machine; wheels for an aarch64 were first built on glibc 2.17."""
OLD_NAMES = {17: "manylinux2014", 12: "manylinux2010", 5: "manylinux1"}


@dataclass(frozen=True)
class System:
    """A Debian by its name, as Raspberry Pi OS has it too: its Python, and which 2.x its glibc is."""

    name: str
    python_full: str
    glibc_minor: int

    @property
    def version(self) -> tuple[int, ...]:
        """The first two numbers of its Python's version, (3, 11)."""
        return tuple(map(int, self.python_full.split(".")[:2]))

    @property
    def python(self) -> str:
        """They as its manifest and pip say them: 3.11."""
        return ".".join(map(str, self.version))

    @property
    def abi(self) -> str:
        """What extension modules for its Python are built for: cp311."""
        return f"cp{''.join(map(str, self.version))}"


SYSTEMS = {one.name: one for one in (System("bookworm", "3.11.2", 36), System("trixie", "3.13.5", 41))}
USUAL_SYSTEM = "bookworm"


@dataclass(frozen=True)
class Target:
    """A machine by its name in Linux, such as aarch64, with a Debian."""

    machine: str
    system: System

    @classmethod
    def named(cls, machine: str, system: str = USUAL_SYSTEM) -> Target:
        """Return a target; raise `InvalidQuantity` for a machine or a system that releases are not built for."""
        for what, name, known in (("machine", machine, OLDEST_GLIBC_MINOR), ("system", system, SYSTEMS)):
            if name not in known:
                raise InvalidQuantity(what, repr(name), f"one of {', '.join(known)}", "choose one")
        return cls(machine, SYSTEMS[system])

    @property
    def name(self) -> str:
        """What wheels for it have in common, for messages and for the name of a folder."""
        return f"{self.system.abi}-manylinux_2_{self.system.glibc_minor}_{self.machine}"

    def platforms(self) -> list[str]:
        """Return the platforms of wheels that it takes, the newest first."""
        found = []
        for minor in range(self.system.glibc_minor, OLDEST_GLIBC_MINOR[self.machine] - 1, -1):
            found.append(f"manylinux_2_{minor}_{self.machine}")
            if minor in OLD_NAMES:
                found.append(f"{OLD_NAMES[minor]}_{self.machine}")
        return found

    def tags(self) -> dict[Tag, int]:
        """Return the tags of wheels that it takes, each with its rank: 0 is the best."""
        return _ranked(self.system, tuple(self.platforms()))

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
            "implementation_version": self.system.python_full,
            "os_name": "posix",
            "platform_machine": self.machine,
            "platform_python_implementation": "CPython",
            "platform_release": "",
            "platform_system": "Linux",
            "platform_version": "",
            "python_full_version": self.system.python_full,
            "python_version": self.system.python,
            "sys_platform": "linux",
        }


@cache
def _ranked(system: System, platforms: tuple[str, ...]) -> dict[Tag, int]:
    ordered = [
        *cpython_tags(system.version, [system.abi], platforms),
        *compatible_tags(system.version, system.abi, platforms),
    ]
    return {tag: rank for rank, tag in reversed(list(enumerate(ordered)))}
