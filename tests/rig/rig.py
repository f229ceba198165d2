"""The daemon of a real probe, without `--simulate`, on a machine without one: it meets a world process on its wires.

`Rig` plays systemd for it as tests/supervisor.py does: a socket for its notifications, the kill when its watchdog is
not fed, and the command that darkens the LEDs after its end.
"""

from __future__ import annotations

import json
import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

from daemon_process import ROOT, Daemon, wait_for

from device.config import MODELS

HERE = Path(__file__).parent
NEW, COMMISSIONED = (
    'serial = "TSIS-0007"\ncalibration = "calibrations"\n',
    f'serial = "SIM-0001"\ncalibration = "{MODELS / "simulated_probe" / "calibration.json"}"\n',
)
SETTINGS = """
data = "var"
[camera]
late_frames = 100.0
[cell]
"""
WIRED = "[light]\nenable_line = 17\n"
START_S = 60.0


def build_shim(folder: Path) -> Path:
    """Compile the shim with the machine's gcc; return where it lies."""
    shim = folder / "i2c_shim.so"
    command = ["gcc", "-O2", "-Wall", "-Werror", "-shared", "-fPIC", "-o", str(shim), str(HERE / "i2c_shim.c"), "-ldl"]
    subprocess.run(command, check=True)
    return shim


class WorldProcess:
    """The world, and a line to it."""

    def __init__(self, folder: Path, scene: str = "") -> None:
        folder.mkdir()
        self.folder = folder
        (folder / "scene.toml").write_text(scene)
        path = os.pathsep.join(map(str, (ROOT, ROOT / "tests")))
        command = [sys.executable, str(HERE / "world.py"), str(folder), str(folder / "scene.toml")]
        self.process = subprocess.Popen(
            command, env={**os.environ, "PYTHONPATH": path}, stdout=subprocess.PIPE, text=True
        )
        assert self.process.stdout is not None
        assert self.process.stdout.readline() == "ready\n"
        self._line = socket.socket(socket.AF_UNIX)
        self._line.connect(str(folder / "control"))
        self._answers = self._line.makefile()

    def wish(self, **wish: Any) -> dict[str, Any]:
        """Tell the world something; return what can be seen of the probe."""
        self._line.sendall(json.dumps(wish).encode() + b"\n")
        seen: dict[str, Any] = json.loads(self._answers.readline())
        return seen

    def is_lit(self) -> bool:
        """Whether all sides shine."""
        return min(self.wish()["light"]) > 0.5

    def is_dark(self) -> bool:
        """Whether no side does."""
        return max(self.wish()["light"]) == 0.0

    def close(self) -> None:
        """End the world."""
        self._answers.close()
        self._line.close()
        self.process.kill()
        self.process.wait()
        assert self.process.stdout is not None
        self.process.stdout.close()


class Notified:
    """systemd's end of the notifications: all are read as they come, for a full socket makes the daemon wait."""

    def __init__(self, path: Path) -> None:
        self._path, self._told, self._told_s = path, threading.Condition(), dict[str, float]()
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(str(path))
        self._thread = threading.Thread(target=self._read, name="systemd")
        self._thread.start()

    def is_told(self, what: str, since_s: float, timeout_s: float) -> bool:
        """Return whether something has been told since a time (monotonic), or is within another from now."""
        with self._told:
            return self._told.wait_for(lambda: self._told_s.get(what, -math.inf) >= since_s, timeout_s)

    def close(self) -> None:
        """Read no more."""
        with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as last:
            last.sendto(b"", str(self._path))
        self._thread.join()
        self._socket.close()

    def _read(self) -> None:
        while message := self._socket.recv(4096).decode():
            with self._told:
                self._told_s |= dict.fromkeys(message.split("\n"), time.monotonic())
                self._told.notify_all()


class Rig:
    """A world and, when it is started, the daemon in it."""

    def __init__(
        self,
        folder: Path,
        shim: Path,
        scene: str = "",
        *,
        watchdog_s: float | None = None,
        is_wired: bool = False,
        is_new: bool = False,
    ) -> None:
        """Take whether the chip's RESET is wired to a line of the board, as docs/build.md has it, and whether the probe
        is as provisioning leaves it: with a serial number, and neither certificate nor model of its own."""
        self._folder, self._watchdog_s, self._is_new = folder, watchdog_s, is_new
        self.world = WorldProcess(folder / "world", scene)
        self.world.wish(wired=is_wired)
        (folder / "calibrations").mkdir()
        settings = (NEW if is_new else COMMISSIONED) + SETTINGS + f'device = "{folder / "world" / "force"}"\n'
        settings += WIRED if is_wired else ""
        (folder / "config.toml").write_text(settings)
        self.environment = {
            "LD_PRELOAD": str(shim),
            "PYTHONPATH": os.pathsep.join(map(str, (HERE / "stubs", HERE, ROOT))),
            "TSIS_RIG_I2C": str(folder / "world" / "i2c"),
            "TSIS_RIG_CAMERA": str(folder / "world" / "camera"),
            "TSIS_RIG_LINE": str(folder / "world" / "line"),
            "NOTIFY_SOCKET": str(folder / "notify"),
            "WATCHDOG_USEC": str(round(1e6 * watchdog_s)) if watchdog_s else "",
        }
        self._systemd = Notified(folder / "notify")
        self.daemon: Daemon | None = None

    def start(self) -> Daemon:
        """Start the daemon as its unit does; return it when its parts are ready and the hand reads its screen."""
        since_s = time.monotonic()
        self.daemon = daemon = Daemon(
            self._folder, arguments=("--config", "config.toml", "--port", "0"), environment=self.environment
        )
        assert self._systemd.is_told("READY=1", since_s, START_S)
        self.world.wish(url=daemon.url)
        if not self._is_new:  # it takes no press
            wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
        return daemon

    def press_until_lit(self) -> str:
        """Ask for a press and wait for its light, for another one where that was cut; return where its job is."""
        daemon = self.daemon
        assert daemon
        location = daemon.ask("/api/v1/presses", "POST", {}).headers["location"]

        def is_lit() -> bool:
            nonlocal location
            if daemon.ask(location).json["code"] == "E212":
                asked = daemon.ask("/api/v1/presses", "POST", {})  # may be refused: then it is asked for again
                location = asked.headers.get("location", location)
            return self.world.is_lit()

        wait_for(is_lit, bool)
        return location

    def is_fed_until(self, condition: Callable[[], bool]) -> bool:
        """Watch the daemon until a condition holds; return False when it was not fed in time before."""
        assert self._watchdog_s
        fed_s = time.monotonic()
        while not condition():
            if self._systemd.is_told("WATCHDOG=1", fed_s, 0.05):
                fed_s = time.monotonic()
            if time.monotonic() - fed_s > self._watchdog_s:
                return False
        return True

    def kill_when_not_fed(self) -> int:
        """Watch the daemon until its watchdog bites; return how it ended. systemd also wakes whom it means to end."""
        assert self.daemon
        while self.is_fed_until(lambda: False):
            pass
        self.daemon.process.send_signal(signal.SIGABRT)
        self.daemon.process.send_signal(signal.SIGCONT)
        return self.daemon.ended_code()

    def led_off(self) -> subprocess.CompletedProcess[str]:
        """Run what the unit runs after the daemon's end, however that came."""
        command = [sys.executable, "-m", "device.commands.led_off", "--config", "config.toml"]
        environment = {**os.environ, **self.environment}
        return subprocess.run(
            command, cwd=self._folder, env=environment, capture_output=True, text=True, timeout=60, check=False
        )

    def close(self) -> None:
        """End the daemon, if it still runs, and the world."""
        with closing(self.world), closing(self._systemd):
            if self.daemon:
                self.daemon.process.send_signal(signal.SIGCONT)
                self.daemon.stop()
