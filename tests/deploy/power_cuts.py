"""Cut the power while releases are installed, fifty times: one whole release is current after each, or this fails.

Needs root and loop devices: `make test-power-cuts`. The probe's root is an ext4 file system in a file. At a random
moment of an installation the kernel shuts it down without writing its log (the ioctl of xfstests' `godown`, flag
NOLOGFLUSH): what was not synchronised is lost, as it is when the power goes. Then it is mounted again, the boot is
checked, every file is compared with its hash, and the next release is installed on what was found. After the cuts the
last release is installed without one, and has to run.

Meanwhile somebody else stores and synchronises, as the daemon does with its measurements: that brings names to the
disk whose content is not there yet. The same with `os.fsync` and `os.sync` patched out of the updater has to find a
broken release: so this test can tell.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from threading import Thread

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent)]
from cut_disk import CutDisk, run  # noqa: E402
from small_release import new_key, release_file  # noqa: E402
from updated_probe import UpdatedProbe  # noqa: E402

from device.files.durable import write_and_sync  # noqa: E402
from device.update.contents import damage  # noqa: E402

FILES = 60
UNSYNCHRONISED = "import os, runpy, sys; os.fsync = lambda handle: None; os.sync = lambda: None; "
RUN = "runpy.run_module('device.update', run_name='__main__')"


class Cuts:
    """A probe on such a disk, and what is found after each cut."""

    def __init__(self, folder: Path, seed: int, *, synchronises: bool) -> None:
        self.folder, self.random, self.synchronises = folder, random.Random(seed), synchronises
        self.disk = CutDisk(folder)
        self.key = new_key(folder, "key")
        self.probe = UpdatedProbe(folder, self.key, self.disk.mount)
        self.counter, self.duration_s = 0, 0.0

    def start(self) -> None:
        """Install two releases whole, the second one timed."""
        for _ in range(2):
            began = time.monotonic()
            self.installation().communicate(timeout=60)
            self.duration_s = time.monotonic() - began
        run("sync", "-f", str(self.disk.mount))

    def installation(self) -> subprocess.Popen[bytes]:
        """Start to install the next release."""
        self.counter += 1
        file = self.folder / "stick.release"
        file.write_bytes(release_file(self.key, f"1.{self.counter}", self.counter, filler=FILES))
        code = RUN if self.synchronises else UNSYNCHRONISED + RUN
        words = ["--root", str(self.disk.mount), "--look-every", "0.05", "--health-within", "10", "install", str(file)]
        command = [sys.executable, "-S", "-c", "import runpy; " + code, *words]
        pipe = subprocess.PIPE
        return subprocess.Popen(command, env=self.probe.environment, stdout=pipe, stderr=pipe, cwd=self.folder)

    def cut(self) -> tuple[str, list[str]]:
        """Install, cut the power at a random moment, start again; return what was found, and what is broken of it."""
        after_s = self.random.uniform(0.05, 1.1 * self.duration_s)
        installation, others = self.installation(), Thread(target=self.store_measurements)
        others.start()
        time.sleep(after_s)
        self.disk.cut()
        others.join()
        installation.send_signal(signal.SIGKILL)
        installation.communicate()
        self.probe.stop()
        self.disk.down()
        self.disk.up()
        found = self.found(after_s)
        started = self.probe.start_machine()
        problems = [] if started.returncode == 0 else [f"the boot check failed: {started.stderr.strip()[-200:]}"]
        problems += self.broken()
        self.probe.run("watch-incoming")
        return f"{found}; {self.probe.current} runs", problems + self.broken()

    def store_measurements(self) -> None:
        """Write and synchronise beside the updater until the disk is gone."""
        try:
            while True:
                write_and_sync(self.disk.mount / "measurement", b"1")
                time.sleep(0.05)
        except OSError:
            return

    def found(self, after_s: float) -> str:
        """Return what the disk says before anything is mended."""
        try:
            state = json.loads(self.probe.layout.state.read_bytes())
            said = f"committed {state['committed']}, on trial {(state['pending'] or {}).get('release')}"
        except (OSError, ValueError) as error:
            said = f"state.json unreadable ({type(error).__name__})"
        leftovers = [name for name in self.probe.releases() if name.startswith(".")]
        return f"cut after {after_s:.2f} s: {said}{', leftovers' if leftovers else ''}"

    def broken(self) -> list[str]:
        """Return what is not whole: the release that runs, and the others that are kept."""
        current = self.probe.current
        if not current:
            return ["no release is current"]
        names = {current, *self.probe.state.keeps()}
        return [f"{name}: {problem}" for name in names for problem in damage(self.probe.layout.release(name))[:3]]

    def end(self) -> None:
        """Let go of daemon and disk."""
        self.probe.stop()
        self.disk.down()


def story(cuts: int, seed: int, *, synchronises: bool) -> list[str]:
    """Cut so often, or until something is broken; return what is."""
    with tempfile.TemporaryDirectory() as folder:
        made = Cuts(Path(folder), seed, synchronises=synchronises)
        try:
            made.start()
            for number in range(1, cuts + 1):
                found, problems = made.cut()
                print(f"{number:3d}  {found}{'  BROKEN' if problems else ''}", flush=True)
                if problems:
                    return problems
            made.installation().communicate(timeout=60)
            wanted = f"1.{made.counter}+{made.counter}"
            return [] if made.probe.current == wanted and not made.broken() else [f"in the end not {wanted}"]
        finally:
            made.end()


def main() -> int:
    """Run both stories; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cuts", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    if os.geteuid() != 0:
        print("power_cuts: needs root, for loop devices")
        return 2
    problems = story(options.cuts, options.seed, synchronises=True)
    print(f"{options.cuts} power cuts: {'; '.join(problems) or 'always one whole release, in the end the right one'}")
    print("The same without os.fsync has to break:")
    control = story(options.cuts, options.seed, synchronises=False)
    print(f"without os.fsync: {'; '.join(control) or 'NOTHING BROKE: this test cannot tell'}")
    return 0 if not problems and control else 1


if __name__ == "__main__":
    sys.exit(main())
