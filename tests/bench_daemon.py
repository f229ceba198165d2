"""Times the daemon of a probe, without its simulation: start to ready, CPU and memory at rest, memory after presses.

The daemon runs as on a probe, without `--simulate`; the world on the other side of its wires is another process
(tests/rig), so what it costs is not counted. Memory is what the kernel holds for the daemon and its camera's process:
pages that both have count once (PSS). Ready is when the daemon says READY=1 and answers that it can press. The
yardstick is an interpreter that imports NumPy.
Usage: python tests/bench_daemon.py [PRESSES]
"""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
sys.path.insert(0, str(Path(__file__).resolve().parent / "rig"))

from daemon_process import QUICK_HAND
from rig import Rig, build_shim

STARTS = 3
REST_S, SETTLE_S = 20.0, 15.0
PRESSES = 6
TICKS_A_SECOND = os.sysconf("SC_CLK_TCK")


def main() -> None:
    """Print the table."""
    presses = int(sys.argv[1]) if len(sys.argv) > 1 else PRESSES
    with TemporaryDirectory(prefix="tsis-") as folder:
        shim = build_shim(Path(folder))
        yardstick_s = min(_yardstick_s() for _ in range(STARTS))
        print(f"yardstick: an interpreter that imports NumPy, {yardstick_s:.2f} s")
        for number in range(STARTS):
            rig = Rig(_made(Path(folder) / str(number)), shim, QUICK_HAND)
            try:
                _measure(rig, yardstick_s, presses if number == STARTS - 1 else 0)
            finally:
                rig.close()


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _yardstick_s() -> float:
    begun_s = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import numpy"], check=True)
    return time.perf_counter() - begun_s


def _measure(rig: Rig, yardstick_s: float, presses: int) -> None:
    begun_s = time.perf_counter()
    daemon = rig.start()
    ready_s = time.perf_counter() - begun_s
    family = _family(daemon.process.pid)
    print(f"ready after {ready_s:.2f} s ({ready_s / yardstick_s:.1f} x), CPU {_cpu_s(family):.2f} s")
    if not presses:
        return
    rig.world.wish(url="")  # nobody looks at the screen
    time.sleep(SETTLE_S)
    before_s, begun_s = _cpu_s(family), time.perf_counter()
    time.sleep(REST_S)
    print(f"at rest: {(_cpu_s(family) - before_s) / (time.perf_counter() - begun_s):.1%} of a core; {_memory(family)}")
    rig.world.wish(url=daemon.url)
    for _ in range(presses):
        for mode in ("quick", "standard"):
            job = daemon.press(mode)
            assert job["state"] == "done", job
        print(f"after a quick and a standard press more: {_memory(family)}")


def _family(pid: int) -> list[int]:
    """Return a process and its children."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [pid, *map(int, children)]


def _cpu_s(family: Iterable[int]) -> float:
    return sum(
        sum(map(int, Path(f"/proc/{pid}/stat").read_text().rsplit(")")[-1].split()[11:13])) for pid in family
    ) / (TICKS_A_SECOND)


def _memory(family: Iterable[int]) -> str:
    mb = [_pss_mb(pid) for pid in family]
    return f"{sum(mb):.0f} MB ({', '.join(f'{one:.0f}' for one in mb)})"


def _pss_mb(pid: int) -> float:
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("Pss:")) / 1024


if __name__ == "__main__":
    main()
