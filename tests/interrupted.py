"""A probe whose updater is interrupted at a step, again and again from the same beginning (tests/killed_updater.py)."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Iterable, Sequence

from daemon_process import ROOT
from every_case import EVERY_CASE
from updated_probe import QUICK, UpdatedProbe

KILLED = str(ROOT / "tests" / "killed_updater.py")
NEED_SPACE = ("fsync", "mkdir", "symlink", "open", "link")
"""The calls that a full disk refuses, as tests/killed_updater.py has them."""
IN_A_RELEASE = re.compile(r"/[.](incoming|removed)-[^/]+(/?)")
"""The folder of a release that comes or goes, or with a slash what is in it."""


def one_of_each_kind(calls: Sequence[str], numbers: Iterable[int]) -> list[int]:
    """Return those of the numbers of calls that stand for all: the middle one of what is done to a release's files.

    Calls outside of a release's folder are few, and each comes at a moment of its own: all of them stay.
    """
    found: dict[object, list[int]] = {}
    for number in numbers:
        verb, path = calls[number - 1].split(" ", 1)
        inside = IN_A_RELEASE.search(path)
        found.setdefault((verb, *inside.groups()) if inside else number, []).append(number)
    return sorted(alike[len(alike) // 2] for alike in found.values())


def ways_to_be_killed(calls: Sequence[str], first: int = 1) -> list[int]:
    """Return the calls from `first` on at which to be killed: every one, or the next after each kind of change.

    A call that only synchronises, or finds what it makes or removes so already, leaves a kill nothing new to find.
    """
    numbers = range(first, len(calls) + 1)
    if EVERY_CASE:
        return list(numbers)
    changing = (n for n in numbers if _changes(calls[n - 1]) and not calls[n - 1].startswith("fsync"))
    return [number + 1 for number in one_of_each_kind(calls, changing) if number < len(calls)]


def ways_to_be_full(calls: Sequence[str]) -> list[int]:
    """Return the calls at which the disk is to be full: every one, or each kind of those that need space."""
    numbers = range(1, len(calls) + 1)
    if EVERY_CASE:
        return list(numbers)
    needing = (n for n in numbers if calls[n - 1].startswith(NEED_SPACE) and _changes(calls[n - 1]))
    return one_of_each_kind(calls, needing)


def _changes(call: str) -> bool:
    """Return whether a call is none of those that mostly find a folder made, or a file removed, already."""
    return not call.startswith(("mkdir", "unlink", "rmdir")) or bool(IN_A_RELEASE.search(call))


class Interrupted:
    """The probe as it is now is the beginning of each story."""

    def __init__(self, probe: UpdatedProbe) -> None:
        self.probe, self._saved = probe, probe.folder / "saved"
        shutil.copytree(probe.root, self._saved, symlinks=True)
        self._before = self._seen()

    def run(self, how: str, at: int, *words: str) -> subprocess.CompletedProcess[str]:
        """Run the updater's command line, interrupted so at that call."""
        return self.probe.run_code(KILLED, how, str(at), "--root", str(self.probe.root), *QUICK, *words)

    def count(self, *words: str) -> list[str]:
        """Return the calls that change the disk when nothing interrupts."""
        self.run("count", 0, *words)
        return (self.probe.folder / "calls").read_text().splitlines()

    def first_of_trial(self, calls: list[str]) -> int:
        """Return the number of the call that begins to write the trial down."""
        return next(n for n, call in enumerate(calls, 1) if call.endswith("/state.json.tmp"))

    def restore(self) -> None:
        """Begin anew."""
        self.probe.stop()
        shutil.rmtree(self.probe.root)
        shutil.copytree(self._saved, self.probe.root, symlinks=True)

    def is_as_before(self) -> bool:
        """Return whether every file but the progress is as it was in the beginning."""
        return self._seen() == self._before

    def _seen(self) -> dict[str, bytes]:
        found = self.probe.snapshot()
        found.pop("opt/tsis/.current.back", None)  # made before a trial, of no meaning without one
        found.pop("var/lib/tsis-update/state.json.tmp", None)  # half written; the next write begins it anew
        return found
