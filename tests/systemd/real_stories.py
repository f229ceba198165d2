"""The daemon without `--simulate` under its own unit: the wires of tests/rig, the unit's own command line and sandbox.

Told after the stories of the simulated probe, in the same container: the drop-in of those goes, and one comes that only
sets the environment (real.conf). A press, a kill, a freeze, a lost bus and a stop, each seen from the LED chip.
"""

from __future__ import annotations

import contextlib
import errno
import os
import shutil
import signal
import sys
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from claim import Claim
from daemon_process import QUICK_HAND
from service import URL, Service, run, until

sys.path.insert(0, "/src/tests/rig")
from rig import SETTINGS, WIRED, WorldProcess

FOLDER, SHIM = Path("/run/tsis-rig"), "/opt/tsis-rig/i2c_shim.so"
DROP_INS = Path("/etc/systemd/system/tsis.service.d")
CONFIG = Path("/etc/tsis/config.toml")
TRUTH = {"size_mm": 12.0, "depth_mm": 6.0}
TRIES = 3
WATCHDOG_S = 15.0


class RealService(Service):
    """The unit as it is; its chip is in the world's process."""

    def __init__(self) -> None:
        super().__init__()
        self.world: WorldProcess

    @contextlib.contextmanager
    def on_its_board(self) -> Iterator[None]:
        """Begin the world and let the unit find it."""
        self.world = WorldProcess(FOLDER, QUICK_HAND)
        CONFIG.write_text(SETTINGS.replace('data = "var"\n', "") + f'device = "{FOLDER / "force"}"\n')
        (DROP_INS / "simulated.conf").unlink()
        shutil.copy(Path(__file__).with_name("real.conf"), DROP_INS / "real.conf")
        run("systemctl", "daemon-reload")
        self.world.wish(url=URL)
        try:
            yield
        finally:
            self.stop()
            self.world.close()

    def start(self, *faults: str) -> float:
        """Start the unit; no fault is in a scene here."""
        assert not faults
        return self.started()

    def is_lit(self) -> bool:
        """Return whether all sides shine."""
        return self.world.is_lit()

    def is_dark(self) -> bool:
        """Return whether no side does."""
        return self.world.is_dark()

    def parts(self) -> dict[str, Any]:
        """Return the parts' health as an update asks for it."""
        told: dict[str, Any] = self.ask("health/parts")[1].get("parts", {})
        return told

    def has_all_parts(self) -> bool:
        """Return whether every part was seen working."""
        parts = self.parts()
        return bool(parts) and all(part["ready"] for part in parts.values())


def started(service: RealService) -> Iterator[Claim]:
    """A start by the unit's own command line."""
    command = service.shown("ExecStart")
    own = "argv[]=/opt/tsis/current/bin/python -m device ;"
    yield Claim("real: the command line is the unit's own", own in command, command[:120])
    took_s = service.start()
    yield Claim("real: systemctl start ends with READY=1", service.shown("ActiveState") == "active", f"{took_s:.1f} s")
    ready_s = until("ready", service.is_ready, 60)
    device = service.ask("device")[1]
    seen = device.get("serial"), device.get("simulated")
    yield Claim("real: it is no simulated probe", seen == ("SIM-0001", False), f"{seen}, ready after {ready_s:.1f} s")
    parts_s = until("all parts ready", service.has_all_parts, 30)
    yield Claim("real: every part is ready", True, f"{', '.join(service.parts())} after {parts_s:.1f} s")
    maps = [Path(f"/proc/{pid}/maps").read_text() for pid in service.processes()]
    shimmed = sum(SHIM in text for text in maps)
    denies = service.shown("MemoryDenyWriteExecute") == "yes"
    words = "real: the shim is in each of its processes, of which none may run what it wrote"
    yield Claim(words, denies and shimmed == len(maps) > 1, f"{shimmed} processes")


def pressed(service: RealService) -> Iterator[Claim]:
    """A press by request, to its intervals."""
    reasons: list[str] = []
    while (job := service.press("quick"))["state"] != "done" and len(reasons) < TRIES:
        reasons.append(job["reason"])
    yield Claim("real: a press is done", job["state"] == "done", "; ".join(reasons))
    estimate = service.ask(f"measurements/{job['measurement_id']}")[1]["estimate"]
    for name, truth in TRUTH.items():
        told = estimate[name]
        seen = f"{told['low']:.1f} to {told['high']:.1f} for {truth}"
        yield Claim(f"real: {name} is inside its interval", told["low"] < truth < told["high"], seen)


def killed(service: RealService) -> Iterator[Claim]:
    """SIGKILL in a press."""
    service.press_until_lit()
    restarts = int(service.shown("NRestarts"))
    service.kill()
    dark_s = until("dark", service.is_dark, 20)
    yield Claim("real: killed while lit, ExecStopPost= makes it dark", True, f"after {dark_s:.2f} s")
    until("active again", lambda: int(service.shown("NRestarts")) == restarts + 1, 60)
    until("ready again", service.is_ready, 60)
    yield Claim("real: it is started again and ready", True)


def frozen(service: RealService) -> Iterator[Claim]:
    """The whole daemon stopped in a press, as by a kernel that does not schedule it."""
    service.press_until_lit()
    since, restarts = service.now(), int(service.shown("NRestarts"))
    os.kill(int(service.shown("MainPID")), signal.SIGSTOP)
    bitten_s = until("bitten", lambda: "Watchdog timeout" in service.log(since), 2 * WATCHDOG_S)
    was_lit = service.is_lit()
    dark_s = until("dark", service.is_dark, 20)
    words = f"{bitten_s:.1f} s after it froze, {'lit' if was_lit else 'dark'} then; dark {dark_s:.2f} s later"
    yield Claim("real: frozen whole, the watchdog ends it and it is dark", True, words)
    until("active again", lambda: int(service.shown("NRestarts")) == restarts + 1, 60)
    until("ready again", service.is_ready, 60)
    yield Claim("real: it is started again and ready", True)


def bus_lost(service: RealService) -> Iterator[Claim]:
    """The LED board's plug comes off in a press, and is put back."""
    service.press_until_lit()
    service.world.wish(bus_errno=errno.EREMOTEIO)
    until("E201", lambda: "E201" in service.faults(), 30)
    until("light not ready", lambda: service.parts()["light"] == {"ready": False, "code": "E201"}, 30)
    yield Claim("real: a lost bus is E201, and the light is not ready", True)
    service.world.wish(bus_errno=None)
    back_s = until("ready", lambda: service.is_ready() and service.has_all_parts(), 60)
    yield Claim("real: it recovers by itself, dark", service.is_dark(), f"after {back_s:.1f} s")


def stopped(service: RealService) -> Iterator[Claim]:
    """A stop in a press."""
    service.press_until_lit()
    took_s = service.stop()
    ended = service.shown("Result"), service.shown("ExecMainStatus")
    yield Claim("real: systemctl stop in a press ends with exit code 0", ended == ("success", "0"), f"{took_s:.1f} s")
    yield Claim("real: dark", service.is_dark())


def wired(service: RealService) -> Iterator[Claim]:
    """The same with the chip's RESET wired to a line of the board: it falls before any watchdog bites."""
    service.world.wish(wired=True)
    CONFIG.write_text(CONFIG.read_text() + WIRED)
    service.start()
    until("all parts ready", service.has_all_parts, 60)
    service.press_until_lit()
    daemon = int(service.shown("MainPID"))
    os.kill(daemon, signal.SIGSTOP)
    frozen_s = until("dark", service.is_dark, WATCHDOG_S)
    os.kill(daemon, signal.SIGCONT)
    yield Claim(
        "real: wired, a daemon that is frozen whole loses the light within 1 s", frozen_s < 1.0, f"{frozen_s:.2f} s"
    )
    until("ready again", lambda: service.is_ready() and service.has_all_parts(), 60)
    service.press_until_lit()
    service.world.wish(bus_hangs=True)
    hung_s = until("dark", service.is_dark, WATCHDOG_S)
    service.world.wish(bus_hangs=False)
    words = "real: wired, it is dark while the bus hangs, within 1 s of its next use, which is once a second"
    yield Claim(words, hung_s < 2.0, f"{hung_s:.2f} s")
    until("ready again", lambda: service.is_ready() and service.has_all_parts(), 60)
    yield Claim("real: wired, it is ready again by itself", service.is_dark(), ", ".join(service.faults()))
    service.stop()


def real_stories(service: RealService) -> list[Callable[[], Iterator[Claim]]]:
    """Return all stories of a real probe's service."""
    return [partial(story, service) for story in (started, pressed, bus_lost, killed, frozen, stopped, wired)]
