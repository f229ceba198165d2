"""The daemon of a real probe, without `--simulate`: its drivers, camera process, bus and serial line, from outside.

No board is here, and the daemon cannot tell: tests/rig has the world on the other side of its wires.
"""

from __future__ import annotations

import errno
import os
import shutil
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from daemon_process import QUICK_HAND, ROOT, wait_for

sys.path.insert(0, str(ROOT / "tests" / "rig"))
from rig import Rig, build_shim

from device.hardware.light_keeper import HOLD_S

pytestmark = pytest.mark.real_time
BUSY_S = 2.0
"""What a machine that is busy besides may add; a quiet one adds some hundredths."""
TRUTH = {"size_mm": 12.0, "depth_mm": 6.0}


@pytest.fixture(scope="module")
def shim(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if shutil.which("gcc") is None:
        assert not os.environ.get("TSIS_REQUIRE_PEERS"), "gcc is required here but not installed"
        pytest.skip("no gcc on this machine: install it (Debian: gcc libc6-dev) to test the daemon of a real probe")
    return build_shim(tmp_path_factory.mktemp("shim"))


@pytest.fixture
def rig(shim: Path, tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Rig]:
    """In a folder with a short name, for Unix sockets have no long ones."""
    rig = Rig(tmp_path_factory.mktemp("rig"), shim, QUICK_HAND, **getattr(request, "param", {}))
    yield rig
    rig.close()


def codes(rig: Rig) -> set[str]:
    assert rig.daemon
    return {fault["code"] for fault in rig.daemon.ask("/api/v1/status").json["faults"]}


def parts(rig: Rig) -> dict[str, Any]:
    assert rig.daemon
    told: dict[str, Any] = rig.daemon.ask("/api/v1/health/parts").json["parts"]
    return told


def test_a_real_probe_starts_measures_and_stops_dark(rig: Rig):
    """A press over the wires is answered as in simulation: the inclusion lies inside the intervals."""
    daemon = rig.start()
    assert daemon.greeting.startswith("TSIS probe SIM-0001")
    device = daemon.ask("/api/v1/device").json
    assert (device["serial"], device["simulated"]) == ("SIM-0001", False)
    wait_for(lambda: parts(rig), lambda told: all(part["ready"] for part in told.values()))
    job = daemon.press("standard")
    assert job["state"] == "done", f"{job}"  # whole, or pytest shortens it
    measurement = daemon.ask(f"/api/v1/measurements/{job['measurement_id']}").json
    assert (measurement["truth"], measurement["estimate"]["simulated"]) == (None, False)
    for name, truth in TRUTH.items():
        told = measurement["estimate"][name]
        assert told["low"] < truth < told["high"], (name, told)
    rig.press_until_lit()
    assert daemon.stop() == 0
    assert rig.world.is_dark()


@pytest.mark.long
@pytest.mark.parametrize("rig", [{"is_new": True}], indirect=True, ids=[""])
def test_a_new_one_starts_in_the_only_mode_that_it_has_and_asks_for_its_certificate(rig: Rig):
    """As `make provision` leaves it: nobody has said in which mode it presses, and its trial finds every part ready."""
    daemon = rig.start()
    device = daemon.ask("/api/v1/device").json
    assert (device["serial"], device["default_mode"]) == ("TSIS-0007", "paper")
    wait_for(lambda: parts(rig), lambda told: all(part["ready"] for part in told.values()))
    wait_for(lambda: codes(rig), lambda told: "E402" in told)
    refusal = daemon.ask("/api/v1/presses", "POST", {})
    assert (refusal.status, refusal.json["code"]) == (503, "E402")


@pytest.mark.long
def test_one_that_is_killed_while_lit_is_darkened_by_the_command_after_it_and_starts_again(rig: Rig):
    daemon = rig.start()
    rig.press_until_lit()
    daemon.process.kill()
    assert daemon.ended_code() == -signal.SIGKILL
    assert rig.world.is_lit()
    done = rig.led_off()
    assert (done.returncode, done.stderr) == (0, "")
    assert rig.world.is_dark()
    rig.start().stop()


@pytest.mark.long
@pytest.mark.parametrize("rig", [{"watchdog_s": 4.0}], indirect=True, ids=str)
def test_one_that_is_frozen_whole_is_ended_by_the_watchdog_and_darkened(rig: Rig):
    daemon = rig.start()
    rig.press_until_lit()
    daemon.process.send_signal(signal.SIGSTOP)
    assert rig.world.is_lit()
    # Tracing threads that the freeze caught within a call can end in a segmentation fault (cpython issue 116008).
    assert rig.kill_when_not_fed() in (-signal.SIGABRT, -signal.SIGSEGV)
    assert "Fatal Python error: Aborted" in daemon.log_text()
    assert rig.led_off().returncode == 0
    assert rig.world.is_dark()


@pytest.mark.long
def test_a_bus_that_is_lost_and_comes_back_is_a_fault_with_its_code_and_then_over(rig: Rig):
    daemon = rig.start()
    location = rig.press_until_lit()
    rig.world.wish(bus_errno=errno.EREMOTEIO)
    assert daemon.ended(location)["code"] == "E201"
    wait_for(lambda: codes(rig), lambda told: "E201" in told)
    wait_for(lambda: parts(rig)["light"], lambda part: part == {"ready": False, "code": "E201"})
    rig.world.wish(bus_errno=None)
    wait_for(lambda: parts(rig), lambda told: all(part["ready"] for part in told.values()))
    wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
    assert rig.world.is_dark()
    assert daemon.press("quick")["state"] == "done"


@pytest.mark.long
def test_the_parts_are_told_at_once_also_while_a_press_is_under_way(rig: Rig):
    """Asking all the time costs the press nothing."""
    daemon = rig.start()
    wait_for(lambda: parts(rig), lambda told: all(part["ready"] for part in told.values()))
    location = daemon.ask("/api/v1/presses", "POST", {"mode": "quick"}).headers["location"]
    took_s = []
    while daemon.ask(location).json["state"] not in ("done", "rejected", "failed"):
        since_s = time.monotonic()
        told = parts(rig)
        took_s.append(time.monotonic() - since_s)
        assert all(part["ready"] for part in told.values()), told
    assert daemon.ask(location).json["state"] == "done"
    assert sorted(took_s)[len(took_s) // 2] < 0.1


@pytest.mark.long
@pytest.mark.parametrize("rig", [{"is_wired": True}], indirect=True, ids=str)
@pytest.mark.parametrize("how", ["frozen", "killed", "bus hangs"])
def test_with_the_enable_line_wired_it_is_dark_soon_whatever_becomes_of_daemon_and_bus(rig: Rig, how: str):
    """Nobody is there to darken it: no systemd, no command after the end.

    On a machine so busy that the daemon has no processor for 0.75 s the line does what it is there for: pressed again.
    """
    daemon = rig.start()
    job = wait_for(lambda: daemon.press("quick"), lambda job: job["code"] != "E212")
    assert job["state"] == "done", f"{job}"  # whole, or pytest shortens it
    rig.press_until_lit()
    since_s = time.monotonic()
    if how == "bus hangs":
        rig.world.wish(bus_hangs=True)
    else:
        daemon.process.send_signal(signal.SIGSTOP if how == "frozen" else signal.SIGKILL)
    wait_for(rig.world.is_dark, bool)
    dark_s = time.monotonic() - since_s
    assert dark_s < HOLD_S + BUSY_S
    rig.world.wish(bus_hangs=False)
