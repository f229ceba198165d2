"""Ends a daemon whose light is on, and takes the time until the LED chip is dark; fails above a second.

The daemon presses on emulated hardware under a stand-in for systemd, which then runs the unit's `ExecStopPost=`. Times
are the wall's, by one clock, from the signal to the chip's last light: they hold for a machine that does nothing else.
A daemon that is told to stop has a screen connected, as it mostly has.
"""

from __future__ import annotations

import os
import signal
import sys
import time
import urllib.request
from pathlib import Path
from tempfile import TemporaryDirectory

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

from daemon_process import QUICK_HAND
from supervisor import DARK_WITHIN_S, Supervisor

REPEATS = 3
WATCHDOG_S = 60.0
STEP_S = 0.001


def darkness_s(folder: Path, ending: signal.Signals) -> float:
    """Return the time from a signal that ends a daemon in a press to darkness, to a millisecond."""
    supervisor = Supervisor(folder, QUICK_HAND, WATCHDOG_S)
    try:
        daemon = supervisor.start()
        supervisor.is_fed_until(lambda daemon: daemon.ask("/api/v1/health/ready").status == 200)
        with urllib.request.urlopen(daemon.url + "/api/v1/events") as screen:
            screen.readline()
            daemon.ask("/api/v1/presses", "POST", {})
            while min(supervisor.chip.led_ratio()) < 0.5:
                time.sleep(STEP_S)
            killed_s = time.monotonic()
            daemon.process.send_signal(ending)
            daemon.ended_code()
        supervisor.stop_post()
        if any(supervisor.chip.led_ratio()):
            raise SystemExit(f"After {ending.name} the light is not off.")
        return _last_light_s(supervisor, killed_s, time.monotonic()) - killed_s
    finally:
        supervisor.close()


def _last_light_s(supervisor: Supervisor, since_s: float, until_s: float) -> float:
    """Return the last time at which the chip gave light."""
    t_s = until_s
    while t_s > since_s and not any(supervisor.chip.ratio_at(t_s)):
        t_s -= STEP_S
    return t_s


def main() -> int:
    """Print the longest time of each kind of end; return 1 when one is above the limit."""
    longest_s = 0.0
    for ending in (signal.SIGTERM, signal.SIGKILL, signal.SIGABRT):
        times_s = []
        for _ in range(REPEATS):
            with TemporaryDirectory(prefix="tsis-") as folder:
                times_s.append(darkness_s(Path(folder), ending))
        longest_s = max(longest_s, *times_s)
        print(f"dark after {ending.name}: {max(times_s):.2f} s, the longest of {REPEATS}")
    if longest_s > DARK_WITHIN_S:
        print(f"Above {DARK_WITHIN_S:g} s: is the machine busy?", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
