"""The daemon's whole procedure on emulated chips in simulated time: no processes, no terminals, everything else as is.

The camera's driver reads the virtual camera in this process, and the load cell's reads lines from memory. What becomes
of a camera's process that hangs or dies, and of a real terminal, is tested in real time.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any

import pytest
import serial
from simulated_time import SimulatedTime

from device.assembly import camera as camera_assembly
from device.assembly import probe
from device.config import CameraSection
from device.errors import LightCutError, LightLineError
from device.hardware import load_cell
from device.hardware.camera import RawMonoCamera
from device.hardware.light_keeper import HOLD_S
from device.simulation.chips.emulated_amplifier import MAX_UNREAD_BYTES, EmulatedAmplifier


class CameraInProcess:
    """Stands for a `CameraServer`: its address is what opens the camera."""

    def __init__(self, open_camera: Callable[[], Any]) -> None:
        self.address = open_camera

    def close(self) -> None:
        pass


def camera_in_process(settings: CameraSection, open_camera: Callable[[], Any]) -> RawMonoCamera:
    return RawMonoCamera(open_camera(), **camera_assembly._driver_settings(settings))


class LineInProcess:
    """Stands for a `LineServer` and the keeper above it: its address is itself; it falls by the clock of the test."""

    def __init__(self, obey: Callable[[bool], None], is_busy: Callable[[], bool]) -> None:
        if is_busy():
            raise LightLineError("The line that enables the LEDs cannot be had: busy.", "See who has it.")
        self._obey, self._until_s, self.address = obey, 0.0, self
        obey(False)

    def up(self) -> bool:
        was_up = self._is_held()
        self._obey(True)
        self._until_s = probe.time.monotonic() + HOLD_S
        return was_up

    def hold(self) -> None:
        if not self._is_held():
            raise LightCutError("The light went off: nothing asked for it in time.", "Press again.")
        self._until_s = probe.time.monotonic() + HOLD_S

    def down(self) -> None:
        self._obey(False)
        self._until_s = 0.0

    def close(self) -> None:
        self.down()

    def _is_held(self) -> bool:
        """Return whether the line is up still; a driver that comes back too late finds it fallen."""
        if probe.time.monotonic() >= self._until_s:
            self.down()
        return self._until_s > 0.0


class Terminal:
    """What the amplifier has sent and nobody has read, while it is plugged in."""

    def __init__(self) -> None:
        self.unread, self.is_plugged = bytearray(), True


class Terminals:
    """The load cells' lines by their paths, and `serial.Serial` for them."""

    def __init__(self, clock: SimulatedTime) -> None:
        self._clock, self._plugged = clock, dict[str, Terminal]()

    def plug_in(self, amplifier: EmulatedAmplifier) -> None:
        self._plugged[amplifier.device_path] = Terminal()
        amplifier._is_plugged = True

    def unplug(self, amplifier: EmulatedAmplifier) -> None:
        if amplifier._is_plugged:
            amplifier._is_plugged = False
            self._plugged.pop(amplifier.device_path).is_plugged = False

    def send(self, amplifier: EmulatedAmplifier, line: bytes) -> None:
        unread = self._plugged[amplifier.device_path].unread
        if len(unread) + len(line) <= MAX_UNREAD_BYTES:
            unread += line

    def opened(self, path: str, baudrate: int, exclusive: bool) -> Port:
        if path not in self._plugged:
            raise serial.SerialException(f"could not open port {path}")
        return Port(self._clock, self._plugged[path])


class Port:
    """The part of `serial.Serial` that a line is read with."""

    timeout: float | None = None
    write_timeout: float | None = None

    def __init__(self, clock: SimulatedTime, terminal: Terminal) -> None:
        self._clock, self._terminal = clock, terminal

    @property
    def in_waiting(self) -> int:
        return len(self._terminal.unread)

    def read(self, size: int) -> bytes:
        self._clock.wait(lambda: bool(self._terminal.unread) or not self._terminal.is_plugged, self.timeout)
        if not self._terminal.is_plugged:
            raise serial.SerialException("device reports readiness to read but returned no data")
        read = bytes(self._terminal.unread[:size])
        del self._terminal.unread[:size]
        return read

    def close(self) -> None:
        pass


def simulate_time(monkeypatch: pytest.MonkeyPatch) -> SimulatedTime:
    """Let probes that are opened from now on live in simulated time; the thread that asks has the first turn."""
    clock = SimulatedTime()
    for verb in ("focus", "record", "self_test"):
        import_module(f"device.commands.{verb}")  # what is imported later keeps the real clock
    clock.replace("device", monkeypatch)
    monkeypatch.setattr(probe, "CameraServer", CameraInProcess)
    monkeypatch.setattr(probe, "emulated_camera", camera_in_process)
    monkeypatch.setattr(probe, "LineServer", LineInProcess)
    monkeypatch.setattr(probe, "emulated_line", lambda line: line)
    terminals = Terminals(clock)
    monkeypatch.setattr(load_cell, "serial", type("serial", (), {"Serial": staticmethod(terminals.opened)}))
    for name, method in (("_plug_in", "plug_in"), ("_unplug", "unplug"), ("_send", "send")):
        act = getattr(terminals, method)
        monkeypatch.setattr(EmulatedAmplifier, name, lambda *parts, act=act: act(*parts))
    return clock
