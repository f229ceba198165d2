"""tsis.service as systemd and REST show it, and the LED chip that its processes reach, from outside of all of them."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from i2c_over_socket import served

from device.records.store import ENDED
from device.simulation.chips.i2c_bus import EmulatedI2cBus
from device.simulation.chips.tlc59116_chip import Tlc59116Chip

NAME = "tsis.service"
URL = "http://127.0.0.1:8000/api/v1/"
BOARD = Path("/run/tsis-board")
PAUSE_S = 0.02


class NotReached(Exception):  # noqa: N818 - reads as what happened
    """What a story waits for did not come in time."""


def until(what: str, condition: Callable[[], bool], within_s: float) -> float:
    """Return after how many seconds a condition holds; raise `NotReached` when it never does."""
    since_s = time.monotonic()
    while not condition():
        if time.monotonic() - since_s > within_s:
            raise NotReached(f"not within {within_s:.0f} s: {what}")
        time.sleep(PAUSE_S)
    return time.monotonic() - since_s


def run(*command: str) -> subprocess.CompletedProcess[str]:
    """Run a command to its end, whatever that is."""
    return subprocess.run(command, capture_output=True, text=True, check=False)


class Service:
    """The unit on an LED board that outlives its processes."""

    def __init__(self) -> None:
        self.chip = Tlc59116Chip()

    @contextlib.contextmanager
    def on_its_board(self) -> Iterator[None]:
        """Let every process of the container reach the chip."""
        BOARD.mkdir()
        path = BOARD / "i2c"
        with served(EmulatedI2cBus({0x60: self.chip}), path):
            path.chmod(0o666)
            yield

    def start(self, *faults: str) -> float:
        """Start the unit on a scene with these faults in its first press; return how long systemd waited for it (s)."""
        kinds = [f'[[faults]]\nkind = "{kind}"\nfrom_press = 1\nfrom_s = 3.0\n' for kind in faults]
        (BOARD / "scene.toml").write_text("".join(kinds))
        return self.started()

    def started(self) -> float:
        """Start the unit as it is; return how long systemd waited for it (s)."""
        since_s = time.monotonic()
        started = run("systemctl", "start", NAME)
        if started.returncode != 0:
            raise NotReached(f"systemctl start: {self.log()[-600:]}")
        return time.monotonic() - since_s

    def stop(self) -> float:
        """Stop the unit; return how long that took (s)."""
        since_s = time.monotonic()
        run("systemctl", "stop", NAME)
        return time.monotonic() - since_s

    def shown(self, name: str) -> str:
        """Return a property of the unit as `systemctl show` has it."""
        return run("systemctl", "show", "--value", f"--property={name}", NAME).stdout.strip()

    def processes(self) -> set[int]:
        """Return the numbers of all processes of the unit."""
        group = Path("/sys/fs/cgroup" + self.shown("ControlGroup"))
        numbers = {int(line) for line in (group / "cgroup.procs").read_text().split()}
        return numbers - {0}  # one that is just being made, seen from this name space: cgroups(7)

    def log(self, since: str = "") -> str:
        """Return the journal of the unit, systemd's own lines among it, after a cursor."""
        after = [f"--after-cursor={since}"] if since else []
        return run("journalctl", "--no-pager", "--output=cat", f"--unit={NAME}", *after).stdout

    def now(self) -> str:
        """Return the journal's cursor."""
        run("journalctl", "--sync")
        return run("journalctl", "--show-cursor", "--lines=0").stdout.rpartition("-- cursor: ")[2].strip()

    def ask(self, path: str, body: object = None) -> tuple[int, Any]:
        """Ask the REST API, by POST when there is a body; return status and answer, (0, {}) when nobody answers."""
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(URL + path, data=data, headers={"content-type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=10) as response:
                return response.status, json.load(response)
        except urllib.error.HTTPError as error:
            with error:
                return error.code, {}
        except OSError:
            return 0, {}

    def faults(self) -> dict[str, dict[str, Any]]:
        """Return faults and warnings that the screen shows, by code."""
        return {fault["code"]: fault for fault in self.ask("status")[1].get("faults", [])}

    def is_ready(self) -> bool:
        """Return whether a press can be asked for."""
        return self.ask("health/ready")[0] == 200

    def is_lit(self) -> bool:
        """Return whether all sides shine."""
        return min(self.chip.led_ratio()) > 0.5

    def is_dark(self) -> bool:
        """Return whether no side shines."""
        return max(self.chip.led_ratio()) == 0.0

    def press(self, mode: str) -> dict[str, Any]:
        """Ask for a press and return its job once it has ended."""
        until("ready", self.is_ready, 60)
        path = f"presses/{self.ask('presses', {'mode': mode})[1]['id']}"
        until(f"{path} has ended", lambda: self.ask(path)[1]["state"] in ENDED, 240)
        job: dict[str, Any] = self.ask(path)[1]
        return job

    def press_until_lit(self) -> None:
        """Ask for a press and wait for its light."""
        until("ready", self.is_ready, 60)
        self.ask("presses", {})
        until("lit", self.is_lit, 60)

    def kill(self) -> None:
        """Kill the daemon's process as the kernel does when memory runs out."""
        os.kill(int(self.shown("MainPID")), signal.SIGKILL)
