"""The process that keeps the enable line, and the driver above it: whatever ends or freezes, the line falls."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gpiod
import pytest
from daemon_process import ROOT, wait_for
from gpiod.line import Direction, Value

from device.config import LightSection
from device.errors import LightCutError, LightLineError
from device.hardware import light_keeper
from device.hardware.enable_line import KeptLine
from device.hardware.led_driver import keeper_command
from device.hardware.light_keeper import DOWN, HOLD, HOLD_S, OPENED, UP, WAS_DOWN, WAS_UP, GpioLine, keep
from device.simulation.chips.remote_line import LineServer

pytestmark = pytest.mark.real_time
LIGHT = LightSection(enable_line=17)


class Wire:
    """The line's level over time, as the LED chip sees it."""

    def __init__(self) -> None:
        self.changes: list[tuple[float, bool]] = []
        self.is_busy = False
        self.server = LineServer(self.obey, lambda: self.is_busy)

    def obey(self, is_up: bool) -> None:
        if not self.changes or self.changes[-1][1] != is_up:
            self.changes.append((time.monotonic(), is_up))

    @property
    def is_up(self) -> bool:
        return self.changes[-1][1]

    def kept(self) -> KeptLine:
        """Return the line above the keeper as it is on a probe, but for the kernel."""
        _, safe, *program = keeper_command(LIGHT)
        command = [sys.executable, safe, str(ROOT / "tests" / "gpiod_over_socket.py"), self.server.address, *program]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(ROOT), str(ROOT / "tests")])}
        return KeptLine(command, environment)


@pytest.fixture
def wire() -> Iterator[Wire]:
    made = Wire()
    yield made
    made.server.close()


@pytest.fixture
def line(wire: Wire) -> Iterator[KeptLine]:
    made = wire.kept()
    yield made
    made.close()


def pid_of(line: KeptLine) -> int:
    assert line._keeper is not None
    return line._keeper.pid


def test_the_line_is_low_until_it_is_asked_up_and_after_it_is_let_go(wire, line):
    assert not wire.is_up
    assert line.up() is False
    assert wire.is_up
    line.close()
    wait_for(lambda: wire.is_up, lambda is_up: not is_up)


def test_the_line_is_held_as_long_as_it_is_told_and_no_longer(wire, line):
    """A test that is kept waiting for so long by its machine begins anew: then it is the line that is right."""
    for _ in range(20):
        line.up()
        held_s = asked_s = time.monotonic()
        try:
            while held_s - asked_s < 2 * HOLD_S:
                held_s = time.monotonic()
                line.hold()
                time.sleep(0.01)
        except LightCutError:
            continue
        break
    wait_for(lambda: wire.is_up, lambda is_up: not is_up)
    assert wire.changes[-1][0] - asked_s >= 2 * HOLD_S
    assert wire.changes[-1][0] - held_s >= HOLD_S
    with pytest.raises(LightCutError, match="nothing asked for it for 0.75 s") as cut:
        line.hold()
    assert cut.value.code == "E212"
    assert not wire.is_up, "to hold a line that has fallen does not raise it"
    assert line.up() is False
    assert line.up() is True


def test_a_keeper_that_is_killed_takes_the_line_with_it_and_the_next_light_has_another(wire, line):
    line.up()
    os.kill(pid_of(line), signal.SIGKILL)
    wait_for(lambda: wire.is_up, lambda is_up: not is_up)
    with pytest.raises(LightCutError, match="has ended or hangs"):
        line.hold()
    line.down()
    assert line.up() is False
    assert wire.is_up


def test_a_keeper_that_is_frozen_while_the_light_is_on_is_replaced(wire, line):
    line.up()
    frozen = pid_of(line)
    os.kill(frozen, signal.SIGSTOP)
    with pytest.raises(LightCutError, match="has ended or hangs"):
        line.hold()
    line.down()
    assert not wire.is_up
    assert pid_of(line) != frozen
    with pytest.raises(ProcessLookupError):
        os.kill(frozen, 0)


def test_a_line_that_another_program_has_is_a_fault_that_names_the_settings(wire):
    wire.is_busy = True
    with pytest.raises(LightLineError, match="cannot be had: Device or resource busy") as refusal:
        wire.kept()
    assert refusal.value.code == "E213"
    assert "light.enable_line" in refusal.value.remedy


@pytest.mark.parametrize("chip", ["/dev/gpiochip250", "/dev/null"])
def test_without_the_chip_the_keeper_as_it_is_on_a_probe_says_so(chip):
    with pytest.raises(LightLineError, match="cannot be had: ") as refusal:
        KeptLine(keeper_command(LightSection(enable_chip=chip, enable_line=17)))
    assert "does not start" not in refusal.value.cause


def test_a_program_that_is_no_keeper_is_told(tmp_path):
    with pytest.raises(LightLineError, match="does not start"):
        KeptLine([sys.executable, "-c", ""])


class KernelLine:
    """`gpiod.LineRequest` as far as it is used; notes what it is told."""

    def __init__(self) -> None:
        self.log: list[Any] = []

    def set_value(self, line: int, value: Value) -> None:
        self.log.append((line, value))

    def release(self) -> None:
        self.log.append("released")


@pytest.mark.parametrize(("chip", "active_low"), [("tlc59116", False), ("pca9685", True)])
def test_the_kernel_is_asked_for_an_output_that_takes_the_light_away(monkeypatch, chip, active_low):
    light = LightSection(chip=chip, enable_chip="/dev/gpiochip4", enable_line=17)
    kernel, asked = KernelLine(), []

    def request_lines(path: str, **how: Any) -> KernelLine:
        asked.append((path, how))
        return kernel

    monkeypatch.setattr(gpiod, "request_lines", request_lines)
    _, _, _, path, offset, level = keeper_command(light)
    line = GpioLine(path, int(offset), active_low=level == "low")
    line.switch(True)
    line.close()
    settings = gpiod.LineSettings(direction=Direction.OUTPUT, active_low=active_low, output_value=Value.INACTIVE)
    assert asked == [("/dev/gpiochip4", {"consumer": "tsis-light", "config": {17: settings}})]
    assert kernel.log == [(17, Value.ACTIVE), (17, Value.INACTIVE), "released"]


class Level:
    """A line in this process."""

    def __init__(self) -> None:
        self.log: list[object] = []

    def switch(self, is_up: bool) -> None:
        self.log.append(is_up)

    def close(self) -> None:
        self.log.append("closed")


def test_a_request_that_comes_too_late_finds_the_line_down_although_it_was_read_first(monkeypatch):
    """As for a keeper that had no processor for a second: what is asked meanwhile has waited in the pipe."""
    now_s = [0.0]
    monkeypatch.setattr(light_keeper.time, "monotonic", lambda: now_s[0])
    (requests, asking), (hearing, answers) = os.pipe(), os.pipe()
    level = Level()
    keeping = threading.Thread(target=keep, args=(level, requests, answers))
    keeping.start()

    def answer(request: bytes = b"") -> bytes:
        os.write(asking, request)
        return os.read(hearing, 1)

    assert answer() == OPENED
    assert answer(UP) == WAS_DOWN
    now_s[0] = 0.9 * HOLD_S
    assert answer(HOLD) == WAS_UP
    now_s[0] = 1.8 * HOLD_S
    assert answer(HOLD) == WAS_UP
    now_s[0] = 2.9 * HOLD_S
    assert answer(HOLD) == WAS_DOWN
    assert answer(DOWN) == WAS_DOWN
    os.close(asking)
    keeping.join()
    assert level.log == [True, False, "closed"]
    for handle in (requests, hearing, answers):
        os.close(handle)


def test_a_line_whose_number_the_chip_does_not_have_is_an_error_of_the_system(monkeypatch):
    def request_lines(*_: Any, **__: Any) -> None:
        raise ValueError("no such line")

    monkeypatch.setattr(gpiod, "request_lines", request_lines)
    with pytest.raises(OSError, match="has no line 99"):
        GpioLine("/dev/gpiochip0", 99, active_low=False)


def test_it_loads_nothing_of_ours_but_itself():
    """It has to be there quickly, and while the rest of the software is broken."""
    lines = Path(light_keeper.__file__).read_text(encoding="utf-8").splitlines()
    imports = [line.split()[1] for line in lines if line.lstrip().startswith(("import ", "from "))]
    assert "gpiod" in imports
    assert not [name for name in imports if name.startswith("device")]
