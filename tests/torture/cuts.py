"""Cut the power while measurements are kept, 100 times: what was acknowledged is whole, or this fails.

`make torture [CUTS=100]`; needs root and loop devices (tests/cut_disk.py). A writer of its own process keeps presses,
recordings and measurements in the store and says of each that it is kept; at a random moment the disk loses what was
not synchronised, content and names. Then the store is opened again as a start does, and every acknowledged measurement
is compared. The control: the same without synchronising has to find losses, or this test could not tell.
"""

from __future__ import annotations

import hashlib
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent), str(TESTS / "torture")]
from cut_disk import CutDisk  # noqa: E402
from cut_options import cut_options  # noqa: E402

from device.errors import DeviceError  # noqa: E402
from device.records.store import Store  # noqa: E402

WRITER = str(TESTS / "torture" / "storing.py")
LONGEST_S, CONTROL_S = 0.5, 2.0
"""After the first acknowledgement. The control waits longer: the kernel brings things to the disk by itself."""


class Cuts:
    """A store on a disk whose power is cut again and again."""

    def __init__(self, folder: Path, seed: int, *, synchronises: bool) -> None:
        self.random, self._synchronises = random.Random(seed), synchronises
        self.disk = CutDisk(folder)
        self.kept: dict[str, str] = {}
        self.problems: list[str] = []
        self.orphans, self._next = 0, 1

    def cut(self) -> None:
        """Keep measurements, cut the power, and compare what is found with what was acknowledged."""
        writer = self._writer()
        assert writer.stdout is not None
        lines = [writer.stdout.readline()]  # it is at work
        time.sleep(self.random.uniform(0.0, LONGEST_S if self._synchronises else CONTROL_S))
        self.disk.cut()
        writer.send_signal(signal.SIGKILL)
        rest, _ = writer.communicate()
        self._acknowledge([*lines, *rest.splitlines()])
        self.disk.down()
        self.disk.up()
        self._compare()

    def _writer(self) -> subprocess.Popen[str]:
        command = [sys.executable, WRITER, str(self.disk.mount / "var"), str(self._next)]
        command += [] if self._synchronises else ["unsynchronised"]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)

    def _acknowledge(self, lines: list[str]) -> None:
        for line in lines:
            name, _, own = line.strip().partition(" ")
            if len(own) == 64:  # a line that was cut off acknowledges nothing
                self.kept[name] = own
                self._next = int(name[2:]) + 1
        self._next += 1  # what was under way may be there as well

    def _compare(self) -> None:
        try:
            store = Store(self.disk.mount / "var")
        except DeviceError as error:
            self.problems.append(f"the store cannot be opened: {error}")
            self.kept.clear()
            return
        try:
            self.orphans += len(store.findings.orphans)
            self.problems += [f"damaged: {name}" for name in (*store.findings.missing, *store.findings.resized)]
            for name, own in self.kept.items():
                self._compare_one(store, name, own)
        finally:
            store.close()

    def _compare_one(self, store: Store, name: str, own: str) -> None:
        try:
            store.require_whole()
            found = store.measurement(name)
            job = store.press(f"p-{name[2:]}")
            path = store.recording_path(found["recording_id"])
        except DeviceError as error:
            self.problems.append(f"{name} was acknowledged: {error}")
            return
        kept = found.get("force_n"), job.get("measurement_id"), job.get("state")
        if kept != (int(name[2:]) / 7.0, name, "done"):
            self.problems.append(f"{name} is altered: {found}, {job}")
        if hashlib.sha256(path.read_bytes()).hexdigest() != own:
            self.problems.append(f"the recording of {name} is altered")


def cut_often(cuts: int, seed: int, *, synchronises: bool) -> Cuts:
    """Return what was found after so many cuts; a control ends with the first loss."""
    with tempfile.TemporaryDirectory() as folder:
        story = Cuts(Path(folder), seed, synchronises=synchronises)
        try:
            for number in range(1, cuts + 1):
                story.cut()
                print(f"cut {number}: {len(story.kept)} acknowledged, {len(story.problems)} problems", flush=True)
                if story.problems and not synchronises:
                    break
        finally:
            story.disk.down()
    return story


def main() -> int:
    """Cut as often as asked; return 0 when nothing is lost and the control loses something."""
    options = cut_options(__doc__)
    story = cut_often(options.cuts, options.seed, synchronises=True)
    control = cut_often(options.control, options.seed, synchronises=False)
    print("\n".join(story.problems))
    print(f"{options.cuts} cuts: {len(story.kept)} measurements acknowledged, {story.orphans} recordings set aside")
    print(f"lost or altered: {len(story.problems)}; in the control, without synchronising: {len(control.problems)}")
    return 1 if story.problems or not story.kept or not control.problems else 0


if __name__ == "__main__":
    sys.exit(main())
