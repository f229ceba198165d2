"""Presses the daemon of a probe a thousand times, without its simulation, and tells its memory after each hundred.

As `bench_daemon`, which has some three dozen presses: this one takes an hour, and is run when it is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from bench_daemon import MODES, MOST_GROWN_MB, OWN, _family, _grown, _memory_mb, _press
from bench_table import Figure
from daemon_process import QUICK_HAND
from rig import Rig, build_shim

CHAPTER = "endurance of a probe's daemon"
HUNDREDS, HUNDRED = 10, (*MODES * 2, *("quick",) * 94)


def figures() -> Iterator[Figure]:
    """Yield the daemon's own memory after presses of each mode, how it grew in each hundred presses, and in all."""
    with TemporaryDirectory(prefix="tsis-") as folder:
        rig = Rig(Path(folder), build_shim(Path(folder)), QUICK_HAND)
        try:
            daemon = rig.start()
            family = _family(daemon.process.pid)
            rig.world.wish(url=daemon.url)
            _press(daemon, MODES)
            yield Figure(CHAPTER, "own memory after a press of each mode", _memory_mb(family, OWN), "MB")
            whole_mb = 0.0
            for number in range(HUNDREDS):
                grown_mb, press_s = _grown(daemon, family, HUNDRED)
                whole_mb += grown_mb
                here = f"{press_s:.1f} s a press"
                yield Figure(CHAPTER, f"what it grew in presses {100 * number + 1} to {100 * number + 100}", grown_mb,
                             "MB", here=here)  # fmt: skip
            yield Figure(CHAPTER, "what it grew in all of them", whole_mb, "MB", bound=MOST_GROWN_MB)
        finally:
            rig.close()
