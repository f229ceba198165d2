"""Cut the power of the whole daemon at random moments of presses, 100 times: nothing that a client was told is lost.

`make torture [CUTS=100]`; needs root and loop devices (tests/cut_disk.py). The daemon is that of `kills.py`, with its
data folder on a disk that loses what was not synchronised, content and names; then it is killed, the disk is mounted
again, and what clients were told is compared as there. The control: the same daemon without synchronising has to lose
something, or this test could not tell.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(TESTS), str(TESTS.parent), str(TESTS / "torture")]
from cut_disk import CutDisk  # noqa: E402
from cut_options import cut_options  # noqa: E402
from kills import Kills  # noqa: E402

from device.errors import DeviceError  # noqa: E402

UNSYNCHRONISED = str(TESTS / "torture" / "unsynchronised.py")
DISK_MB = 2048
"""Of a sparse file: some hundred presses with their recordings."""


class DaemonCuts(Kills):
    """A daemon whose disk loses its power again and again."""

    def __init__(self, folder: Path, seed: int, *, synchronises: bool = True) -> None:
        self.disk = CutDisk(folder, DISK_MB)
        if not synchronises:
            self.program = (UNSYNCHRONISED,)
        super().__init__(self.disk.mount, seed)

    def _kill(self) -> None:
        self.disk.cut()
        super()._kill()
        self.disk.down()
        self.disk.up()

    def close(self) -> None:
        """End what still runs, and let go of the disk."""
        if self.daemon.process.poll() is None:
            super()._kill()
        self.disk.down()


def cut(cuts: int, seed: int, *, synchronises: bool) -> DaemonCuts:
    """Return what was found after so many cuts; a control ends with the first loss."""
    with tempfile.TemporaryDirectory() as folder:
        story = DaemonCuts(Path(folder), seed, synchronises=synchronises)
        try:
            for number in range(1, cuts + 1):
                lost = _is_lost(story)
                told = story.told
                print(
                    f"cut {number}: {len(told.accepted)} presses accepted, {len(told.done)} measurements told, "
                    f"{len(told.problems)} problems",
                    flush=True,
                )
                print("\n".join(told.problems[-1:]), end="\n" if told.problems else "", flush=True)
                if lost or (told.problems and not synchronises):
                    break
            else:
                story.end()
        finally:
            story.close()
    return story


def _is_lost(story: DaemonCuts) -> bool:
    """Cut once, and compare; return whether there is no daemon any more that could be asked."""
    try:
        story.one()
    except (AssertionError, DeviceError) as error:  # it does not start: its greeting is missing
        story.told.problems.append(f"the daemon does not start: {error}")
        return True
    return False


def main() -> int:
    """Cut as often as asked; return 0 when nothing is lost and the control loses something."""
    options = cut_options(__doc__)
    told = cut(options.cuts, options.seed, synchronises=True).told
    control = cut(options.control, options.seed, synchronises=False).told
    print("\n".join(told.problems))
    print(
        f"{options.cuts} cuts of the daemon: {len(told.accepted)} presses accepted, {len(told.done)} measurements told"
    )
    print(f"lost, doubled or altered: {len(told.problems)}; without synchronising: {len(control.problems)}")
    return 1 if told.problems or not told.done or not control.problems else 0


if __name__ == "__main__":
    sys.exit(main())
