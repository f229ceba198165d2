"""Times the daemon of a probe, without its simulation: start to ready, CPU and memory at rest, memory after presses.

The daemon runs as on a probe, without `--simulate`; the world on the other side of its wires is another process
(tests/rig), so what it costs is not counted. Memory is what the kernel holds for the daemon and its camera's process:
pages that both have count once (PSS). What it grows is told of pages of its own alone: how much of a library's page
counts as the daemon's changes with every other program that begins or ends. Ready is when the daemon says READY=1 and
answers that it can press; its yardstick is an interpreter that imports NumPy. From the last frame to the answer is what
the probe tells of its own presses: the wall's time until the answer is kept on the disk.
"""

from __future__ import annotations

import http.client
import os
import subprocess
import sys
import time
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parent / "rig"))

from bench_table import WALL, Figure, median_seconds
from daemon_process import QUICK_HAND, Daemon
from rig import Rig, build_shim

from device.errors import LightRestError
from host_tools.tradeoff.yardstick import YARDSTICK_CALLS, exp_and_sum

CHAPTER = "daemon of a probe"
MODES = ("quick", "standard", "precise")
STARTS = 3
READY_BOUND = 15.0
"""1.5 s where NumPy takes 0.1."""
ASKED, ASK_BOUND = 400, 40.0
"""10 ms where the yardstick takes 0.25: Linux puts off an acknowledgement for 40 ms, which an answer in two parts waits
for when TCP_NODELAY is lost."""
ANSWERED_PRESSES = 5
ANSWER_BOUNDS = {"quick": 250.0, "standard": 750.0, "precise": 1700.0}
"""0.04, 0.16 and 0.4 s where the yardstick takes a quarter of a millisecond; the hand's scan is one of five presses.
And 0.025 s each, a hundred yardsticks: an HX711 tells the load of then, so the last frame's force comes that late."""
REST_S, SETTLE_S = 20.0, 15.0
QUICK_PRESSES = 30
"""A hand in real time takes three seconds for each: chapter `endurance` has a thousand."""
MOST_GROWN_MB, RESTING_S = 10.0, 5.0
ALL, OWN = "Pss", "Pss_Anon"
"""Of /proc/PID/smaps_rollup."""
TICKS_A_SECOND = os.sysconf("SC_CLK_TCK")


def figures() -> Iterator[Figure]:
    """Yield the start, the fastest of some, then rest and memory."""
    with TemporaryDirectory(prefix="tsis-") as folder:
        shim = build_shim(Path(folder))
        starts_s = [_start_s(Path(folder) / str(number), shim) for number in range(STARTS)]
        yardstick_s = min(_yardstick_s() for _ in range(STARTS))
        here = f"{min(starts_s):.2f} s here"
        yield Figure(CHAPTER, "ready", min(starts_s) / yardstick_s, "NumPy imports", READY_BOUND, here=here)
        rig = Rig(_made(Path(folder) / "pressed"), shim, QUICK_HAND)
        try:
            yield from _at_rest_and_after_presses(rig)
        finally:
            rig.close()


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def _yardstick_s() -> float:
    begun_s = time.perf_counter()
    subprocess.run([sys.executable, "-c", "import numpy"], check=True)
    return time.perf_counter() - begun_s


def _start_s(folder: Path, shim: Path) -> float:
    rig = Rig(_made(folder), shim, QUICK_HAND)
    try:
        begun_s = time.perf_counter()
        rig.start()
        return time.perf_counter() - begun_s
    finally:
        rig.close()


def _at_rest_and_after_presses(rig: Rig) -> Iterator[Figure]:
    daemon = rig.start()
    family = _family(daemon.process.pid)
    rig.world.wish(url="")  # nobody looks at the screen
    time.sleep(SETTLE_S)
    before_s, begun_s = _cpu_s(family), time.perf_counter()
    time.sleep(REST_S)
    busy = (_cpu_s(family) - before_s) / (time.perf_counter() - begun_s)
    yield Figure(CHAPTER, "at rest", 100 * busy, "% of a core", bound=2.0)
    yield Figure(CHAPTER, "memory at rest", _memory_mb(family), "MB", bound=150.0)
    yield _one_answer(daemon)
    rig.world.wish(url=daemon.url)
    _press(daemon, MODES)
    yield Figure(CHAPTER, "memory after a press of each mode", _memory_mb(family), "MB")
    _press(daemon, MODES * (ANSWERED_PRESSES - 1))
    yield from _answers(daemon)
    more = (*MODES * 2, *("quick",) * QUICK_PRESSES)
    grown_mb, press_s = _grown(daemon, family, more)
    here = f"{press_s:.1f} s a press"
    yield Figure(CHAPTER, f"what it grew in {len(more)} presses more", grown_mb, "MB", bound=MOST_GROWN_MB, here=here)


def _one_answer(daemon: Daemon) -> Figure:
    """Return how long one client waits for one answer after the other on a connection that is kept; the median."""
    connection = http.client.HTTPConnection(daemon.url.removeprefix("http://"))

    def ask() -> None:
        connection.request("GET", "/api/v1/health/live")
        answer = connection.getresponse()
        answer.read()
        assert answer.status == 200

    answer_s, yardstick_s = median_seconds(ask, ASKED, WALL), median_seconds(exp_and_sum, YARDSTICK_CALLS)
    connection.close()
    here = f"{1e3 * answer_s:.2f} ms here"
    return Figure(CHAPTER, "one answer, health/live, median", answer_s / yardstick_s, bound=ASK_BOUND, here=here)


def _answers(daemon: Daemon) -> Iterator[Figure]:
    """Yield how long the probe's own answers took, medians of its presses."""
    yardstick_s = median_seconds(exp_and_sum, YARDSTICK_CALLS)
    for of_mode in daemon.ask("/api/v1/device").json["modes"]:
        if bound := ANSWER_BOUNDS.get(of_mode["mode"]):
            seconds, name = of_mode["answer_s"], f"{of_mode['mode']}: last frame to answer"
            yield Figure(CHAPTER, name, seconds / yardstick_s, bound=bound, here=f"{1e3 * seconds:.3g} ms here")


def _grown(daemon: Daemon, family: list[int], modes: Sequence[str]) -> tuple[float, float]:
    """Return by how much presses made a daemon's own memory (MB) grow, and what each took (s)."""
    before_mb, begun_s = _memory_mb(family, OWN), time.perf_counter()
    _press(daemon, modes)
    press_s = (time.perf_counter() - begun_s) / len(modes)
    return _memory_mb(family, OWN) - before_mb, press_s


def _press(daemon: Daemon, modes: Iterable[str]) -> None:
    for mode in modes:
        while (ended := _pressed(daemon, mode)) == LightRestError.code:
            time.sleep(RESTING_S)  # no person presses so often that the LEDs must rest
        assert ended == "done", ended


def _pressed(daemon: Daemon, mode: str) -> str:
    """Return how a press has ended, or the code of what it was refused or rejected for."""
    answer = daemon.ask("/api/v1/presses", "POST", {"mode": mode})
    if answer.status != 202:
        return str(answer.json["code"])
    job = daemon.ended(answer.headers["location"])
    return str(job["code"] or job["state"])


def _family(pid: int) -> list[int]:
    """Return a process and its children."""
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    return [pid, *map(int, children)]


def _cpu_s(family: Iterable[int]) -> float:
    return sum(
        sum(map(int, Path(f"/proc/{pid}/stat").read_text().rsplit(")")[-1].split()[11:13])) for pid in family
    ) / (TICKS_A_SECOND)


def _memory_mb(family: Iterable[int], kind: str = ALL) -> float:
    return sum(_process_mb(pid, kind) for pid in family)


def _process_mb(pid: int, kind: str) -> float:
    lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith(f"{kind}:")) / 1024
