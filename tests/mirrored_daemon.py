"""The simulated daemon on an LED chip that outlives it: every transaction also goes to the bus in the test's process.

As a program: `python mirrored_daemon.py SOCKET [ARGUMENT]...` is `python -m device [ARGUMENT]...`. The environment
names the chip's enable line outside, if it has one, as `OUTSIDE_LINE`.
"""

from __future__ import annotations

import os
import runpy
import sys
import time
from pathlib import Path
from typing import Any

from i2c_over_socket import stand_in_for_the_kernel
from smbus2 import SMBus, i2c_msg

from device.assembly import light, probe
from device.simulation.chips.i2c_bus import I2C_M_RD, EmulatedI2cBus, I2cMessage

ASKED = "asked_s"
"""File in the daemon's folder: when its bus was last asked (s, monotonic)."""


class MirroredBus(EmulatedI2cBus):
    """The emulated bus; what it has carried is carried again to the chips outside."""

    def __init__(self, *chips: Any, **settings: Any) -> None:
        super().__init__(*chips, **settings)
        self._outside = SMBus(1)

    def i2c_rdwr(self, *i2c_msgs: I2cMessage) -> None:
        Path(ASKED).write_text(repr(time.monotonic()))
        super().i2c_rdwr(*i2c_msgs)
        for message in i2c_msgs:
            if not message.flags & I2C_M_RD:
                self._outside.i2c_rdwr(i2c_msg.write(message.addr, bytes(message.buf[: message.len])))

    def close(self) -> None:
        super().close()
        self._outside.close()


if __name__ == "__main__":
    stand_in_for_the_kernel(sys.argv[1])
    probe.EmulatedI2cBus = MirroredBus
    if outside := os.environ.get("OUTSIDE_LINE"):
        light.PROGRAM = (str(Path(__file__).with_name("mirrored_keeper.py")), outside)
    sys.argv = ["device", *sys.argv[2:]]
    runpy.run_module("device", run_name="__main__", alter_sys=True)
