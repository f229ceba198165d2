"""Plays systemd for one daemon: Type=notify, WatchdogSec=, ExecStopPost=, Restart=on-failure.

Source: systemd.service(5); sd_notify(3). A watchdog that is not fed in time kills with SIGABRT.
"""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cpu_time import ended_cpu_s
from daemon_process import ROOT, Daemon
from i2c_over_socket import served
from mirrored_daemon import ASKED

from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.remote_line import LineServer
from device.simulation.chips.tlc59116_chip import Tlc59116Chip

START_S = 60.0
DARK_WITHIN_S = 1.0
"""From the end of a daemon, however it came, to darkness."""


class Supervisor:
    """A daemon on an LED board that outlives it, in a folder of its own.

    `has_line`: the board has an enable line; the scene's settings have to name one.
    """

    def __init__(self, folder: Path, scene: str, watchdog_s: float, *, has_line: bool = False) -> None:
        self._folder, self._scene, self._watchdog_s = folder, scene, watchdog_s
        light = "[light]\nenable_line = 17\n" if has_line else ""
        (folder / "probe.toml").write_text(f'data = "var"\n{light}')
        self.chip = Tlc59116Chip()
        self._line = LineServer(self.chip.enable) if has_line else None
        self._serving = served(EmulatedI2cBus({0x60: self.chip}), folder / "i2c")
        self._serving.__enter__()
        self._notified = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._notified.bind(str(folder / "notify"))
        self._fed_s, self.messages = 0.0, list[str]()
        self.daemon: Daemon | None = None

    def start(self) -> Daemon:
        """Start the daemon and return it once it has said that it is ready."""
        environment = {
            "NOTIFY_SOCKET": str(self._folder / "notify"), "WATCHDOG_USEC": str(round(1e6 * self._watchdog_s)),
        }  # fmt: skip
        if self._line:
            environment["OUTSIDE_LINE"] = self._line.address
        program = str(ROOT / "tests" / "mirrored_daemon.py"), str(self._folder / "i2c")
        self.daemon = Daemon(self._folder, self._scene, program=program, environment=environment)
        while "READY=1" not in (message := self._next_message(START_S)):
            assert message == ["STOPPING=1"], message  # of the daemon before
        self._fed_s = time.monotonic()
        return self.daemon

    def is_fed_until(self, condition: Callable[[Daemon], bool]) -> bool:
        """Watch the daemon until a condition of it holds; return False when it was not fed in time before."""
        assert self.daemon
        while not condition(self.daemon):
            if not self._is_fed(0.05):
                return False
        return True

    def kill_when_not_fed(self) -> int:
        """Watch the daemon until its watchdog bites; return how it ended."""
        assert self.daemon
        while self._is_fed(0.05):
            pass
        self.daemon.process.send_signal(signal.SIGABRT)
        return self.daemon.ended_code()

    def stop_post(self, **told: str) -> tuple[int, float]:
        """Run what darkens the LEDs after the daemon's end, however that came; return exit code and CPU time (s).

        `told` are systemd's variables of that end.
        """
        path = os.pathsep.join([str(ROOT), str(ROOT / "tests")])
        program = [str(ROOT / "tests" / "i2c_over_socket.py"), str(self._folder / "i2c"), "device.commands.led_off"]
        program += ["--config", "probe.toml"]
        if self._line:
            program = [str(ROOT / "tests" / "gpiod_over_socket.py"), self._line.address, *program]
        environment = {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1", **told}
        process = subprocess.Popen([sys.executable, *program], cwd=self._folder, env=environment)
        cpu_s = ended_cpu_s(process)
        return process.returncode, cpu_s

    @property
    def last_asked_s(self) -> float:
        """When the daemon last asked something of its bus (s, monotonic)."""
        return float((self._folder / ASKED).read_text() or 0.0)

    def close(self) -> None:
        """End the daemon, if it still runs, and take its board away."""
        if self.daemon and self.daemon.process.poll() is None:
            self.daemon.process.send_signal(signal.SIGCONT)
            self.daemon.stop()
        self._serving.__exit__(None, None, None)
        if self._line:
            self._line.close()
        self._notified.close()

    def _is_fed(self, wait_s: float) -> bool:
        if "WATCHDOG=1" in self._next_message(wait_s):
            self._fed_s = time.monotonic()
        return time.monotonic() - self._fed_s <= self._watchdog_s

    def _next_message(self, timeout_s: float) -> list[str]:
        self._notified.settimeout(timeout_s)
        try:
            message = self._notified.recv(4096).decode().split("\n")
        except TimeoutError:
            return []
        self.messages += message
        return message


def codes(daemon: Daemon) -> set[str]:
    """Return the codes that the screen shows."""
    return {fault["code"] for fault in faults(daemon)}


def faults(daemon: Daemon) -> list[dict[str, Any]]:
    """Return the faults and warnings that the screen shows."""
    shown: list[dict[str, Any]] = daemon.ask("/api/v1/status").json["faults"]
    return shown
