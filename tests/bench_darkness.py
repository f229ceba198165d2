"""Ends or freezes a daemon whose light is on, and takes the time until the LED chip is dark.

The daemon presses on emulated hardware under a stand-in for systemd, which runs the unit's `ExecStopPost=` once it has
ended. Times are the wall's, by one clock, from the signal or the hang to the chip's last light: they hold for a machine
that does nothing else. A daemon that is told to stop has a screen connected, as it mostly has.
With an enable line nobody has to end it: a frozen daemon and one whose bus hangs are left as they are.
"""

from __future__ import annotations

import signal
import time
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from bench_table import Figure
from daemon_process import QUICK_HAND, Daemon
from supervisor import DARK_WITHIN_S, Supervisor

CHAPTER = "from an end to darkness"
REPEATS = 3
WATCHDOG_S = 60.0
STEP_S = 0.001
PRESSED = ("too_light", "unsteady", "holding", "capturing")
LINE = "[settings.light]\nenable_line = 17\n"
HUNG_S = 1.0
HUNG_BUS = (
    f'{LINE}[settings.press]\nmode = "standard"\n[[faults]]\nkind = "i2c_frozen"\nfrom_press = 1\nfrom_s = {HUNG_S}\n'
)
"""The LED chip is asked five times a second in a press, and hangs the next time."""


def darkness_s(folder: Path, scene: str, end: Callable[[Supervisor, Daemon], float]) -> float:
    """Return the time from what `end` does to a daemon in a press, and when, to darkness, to a millisecond."""
    supervisor = Supervisor(folder, QUICK_HAND + scene, WATCHDOG_S, has_line=LINE in scene)
    try:
        daemon = supervisor.start()
        supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        daemon.ask("/api/v1/presses", "POST", {})
        while daemon.ask("/api/v1/status").json["press_state"] not in PRESSED or min(supervisor.chip.led_ratio()) < 0.5:
            time.sleep(STEP_S)
        since_s = end(supervisor, daemon)
        if any(supervisor.chip.led_ratio()):
            raise SystemExit("The light is not off.")
        return _last_light_s(supervisor, since_s, time.monotonic()) - since_s
    finally:
        if supervisor.daemon:
            supervisor.daemon.process.kill()
            supervisor.daemon.ended_code()
        supervisor.close()


def ended_by(ending: signal.Signals) -> Callable[[Supervisor, Daemon], float]:
    """Return what ends a daemon by a signal, and runs `ExecStopPost=`."""

    def end(supervisor: Supervisor, daemon: Daemon) -> float:
        with urllib.request.urlopen(daemon.url + "/api/v1/events") as screen:
            screen.readline()
            since_s = time.monotonic()
            daemon.process.send_signal(ending)
            daemon.process.wait()
        supervisor.stop_post()
        return since_s

    return end


def frozen(supervisor: Supervisor, daemon: Daemon) -> float:
    """Freeze a daemon, and look away until it is dark."""
    since_s = time.monotonic()
    daemon.process.send_signal(signal.SIGSTOP)
    _wait_until_dark(supervisor, since_s)
    return since_s


def hung(supervisor: Supervisor, daemon: Daemon) -> float:
    """Wait until the bus hangs, and look away until it is dark: the last that was asked of the bus has not returned."""
    since_s = 0.0
    while since_s != (asked_s := supervisor.last_asked_s) or any(supervisor.chip.led_ratio()):
        since_s = asked_s
        time.sleep(1.5 * HUNG_S)
    return since_s


def _wait_until_dark(supervisor: Supervisor, since_s: float) -> None:
    while any(supervisor.chip.led_ratio()) and time.monotonic() - since_s < WATCHDOG_S:
        time.sleep(STEP_S)


def _last_light_s(supervisor: Supervisor, since_s: float, until_s: float) -> float:
    """Return the last time at which the chip gave light."""
    t_s = until_s
    while t_s > since_s and not any(supervisor.chip.ratio_at(t_s)):
        t_s -= STEP_S
    return t_s


ENDS = {
    "SIGTERM": ("", ended_by(signal.SIGTERM)),
    "SIGKILL": ("", ended_by(signal.SIGKILL)),
    "SIGABRT": ("", ended_by(signal.SIGABRT)),
    "SIGKILL with an enable line": (LINE, ended_by(signal.SIGKILL)),
    "SIGSTOP with an enable line": (LINE, frozen),
    "a hung bus with an enable line": (HUNG_BUS, hung),
}


def figures() -> Iterator[Figure]:
    """Yield the longest time of each kind of end; more than a second is too long."""
    for words, (scene, end) in ENDS.items():
        times_s = []
        for _ in range(REPEATS):
            with TemporaryDirectory(prefix="tsis-") as folder:
                times_s.append(darkness_s(Path(folder), scene, end))
        yield Figure(CHAPTER, f"dark after {words}, the longest of {REPEATS}", max(times_s), "s", bound=DARK_WITHIN_S)
