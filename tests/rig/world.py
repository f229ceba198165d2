"""The world around a real daemon, in a process of its own: tissue, hand, and the chips that the daemon's wires reach.

`python world.py FOLDER [SCENE]` puts into the folder the socket `i2c` (for i2c_shim.c), the sockets `camera` and `line`
(for the packages picamera2 and gpiod beside this file), the terminal `force`, and `control`, and prints `ready`. Only
I2C bytes, a level, serial bytes and frames go between it and the daemon: a frame shows the light of the registers.
The hand reads the daemon's screen, `GET /api/v1/status`, as a person does. On `control`, a line of JSON is a wish:
`{"url": URL}` lets the hand read that screen, `{"bus_errno": N}` lets the bus fail (null: no more), `{"bus_hangs": B}`
lets it not answer, `{"wired": B}` connects the line to the chip's RESET, `{}` only asks; the answer is
`{"light": [the four sides], "force_n": F}`.
"""

from __future__ import annotations

import http.client
import json
import os
import socketserver
import sys
import tempfile
import threading
import time
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from i2c_over_socket import served

from device.assembly.cell import emulated_amplifier
from device.assembly.probe import _render
from device.config import SIMULATED_PROBE, Config
from device.records.store import ENDED
from device.simulation.chips.camera_server import CameraServer
from device.simulation.chips.i2c_bus import EmulatedI2cBus, I2cMessage
from device.simulation.chips.remote_line import LineServer
from device.simulation.chips.tlc59116_chip import Tlc59116Chip
from device.simulation.chips.virtual_camera import VirtualPicamera2
from device.simulation.faults import NO_FAULTS
from device.simulation.hand import VirtualHand
from device.simulation.scenario import Scenario, read_scenario
from device.simulation.virtual_probe import ProbeTables, VirtualProbe

LOOK_EVERY_S = 0.03


class FailingBus(EmulatedI2cBus):
    """The bus of the LED board; while it has an `error_number` no transaction passes, and none ends while it hangs."""

    error_number: int | None = None

    def __init__(self, *chips: Any) -> None:
        super().__init__(*chips)
        self.goes_on = threading.Event()
        self.goes_on.set()

    def i2c_rdwr(self, *i2c_msgs: I2cMessage) -> None:
        self.goes_on.wait()
        if self.error_number:
            raise OSError(self.error_number, os.strerror(self.error_number))
        super().i2c_rdwr(*i2c_msgs)


class World:
    """Virtual probe, chips and hand, and their wires in a folder."""

    def __init__(self, folder: Path, scenario: Scenario) -> None:
        config = Config(serial=scenario.serial)
        width_px, height_px = config.camera.raw_mode.sensor_px
        tables = ProbeTables.load(SIMULATED_PROBE)
        self.probe = VirtualProbe(scenario, tables, (height_px, width_px), config.camera.sensor_scale)
        self.chip = Tlc59116Chip()
        self.bus = FailingBus({config.light.chip_address: self.chip})
        self.reader = ScreenReader(self.probe.hand)
        self._wires = [
            CameraServer(
                partial(
                    VirtualPicamera2,
                    partial(_render, self.probe, NO_FAULTS),
                    width_px=width_px,
                    height_px=height_px,
                    raw_formats=(config.camera.raw_format,),
                    led_ratio_at=self.chip.ratio_at,
                )
            ),
            emulated_amplifier(config, self.probe, NO_FAULTS),
        ]
        camera, cell = self._wires
        (folder / "camera").symlink_to(camera.address)
        (folder / "force").symlink_to(cell.device_path)
        self._is_wired, self._is_up = False, False
        self._line = LineServer(self._reset)
        (folder / "line").symlink_to(self._line.address)

    def _reset(self, is_up: bool) -> None:
        """Let the chip's RESET follow the line, if it is wired to it."""
        self._is_up = is_up
        self.chip.enable(is_up or not self._is_wired)

    def obey(self, wish: dict[str, Any]) -> dict[str, Any]:
        """Do what a line on `control` says; return what can be seen and felt of the probe now."""
        if "url" in wish:
            self.reader.read(wish["url"])
        if "bus_errno" in wish:
            self.bus.error_number = wish["bus_errno"]
        if "bus_hangs" in wish:
            (self.bus.goes_on.clear if wish["bus_hangs"] else self.bus.goes_on.set)()
        if "wired" in wish:
            self._is_wired = wish["wired"]
            self._reset(self._is_up)
        return {"light": self.chip.led_ratio(), "force_n": self.probe.hand.force_n(time.monotonic())}


class ScreenReader:
    """Eyes for the hand: a thread that looks at the screen many times a second."""

    def __init__(self, hand: VirtualHand) -> None:
        self._hand, self._at = hand, ""
        threading.Thread(target=self._run, name="eyes", daemon=True).start()

    def read(self, url: str) -> None:
        """Look at the screen at `http://host:port` from now on."""
        self._at = urlsplit(url).netloc

    def _run(self) -> None:
        while True:
            with suppress(OSError, http.client.HTTPException, ValueError):
                if self._at:
                    self._follow(self._at)
            time.sleep(LOOK_EVERY_S)

    def _follow(self, at: str) -> None:
        connection, press_id, code = http.client.HTTPConnection(at, timeout=2.0), "", ""
        while at == self._at:
            connection.request("GET", "/api/v1/status")
            status = json.loads(connection.getresponse().read())
            press, shown = status["press"], status["guidance"]["code"]
            if press and press["id"] != press_id and press["state"] not in ENDED:
                press_id, code = press["id"], ""
                self._hand.begin()
            if shown != code:
                code = shown
                self._hand.follow(code, time.monotonic())
            time.sleep(LOOK_EVERY_S)


class Control(socketserver.StreamRequestHandler):
    """One wish a line."""

    def handle(self) -> None:
        for line in self.rfile:
            self.wfile.write(json.dumps(self.server.world.obey(json.loads(line))).encode() + b"\n")


def main(folder: Path, scene: Path | None = None) -> None:
    """Serve until killed; what is in the folder may be used by every user of the machine."""
    tempfile.tempdir = str(folder)  # a unit with PrivateTmp= sees no other place
    world = World(folder, read_scenario(scene) if scene else Scenario())
    with (
        served(world.bus, folder / "i2c"),
        socketserver.ThreadingUnixStreamServer(str(folder / "control"), Control) as s,
    ):
        s.world, s.daemon_threads = world, True
        for path in (folder, *folder.rglob("*")):
            path.chmod(0o777 if path.is_dir() else 0o666)  # follows a link to what it names
        print("ready", flush=True)
        s.serve_forever()


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
