"""A probe whose updater is interrupted at a step, again and again from the same beginning (tests/killed_updater.py)."""

from __future__ import annotations

import shutil
import subprocess

from daemon_process import ROOT
from updated_probe import QUICK, UpdatedProbe

KILLED = str(ROOT / "tests" / "killed_updater.py")


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
