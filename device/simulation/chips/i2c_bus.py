"""An I2C bus below smbus2: genuine messages in, the bytes carried to emulated chips.

Answers are those of Linux' i2c-dev; nothing above is told what is emulated.
Source: linux/i2c.h (`struct i2c_msg`); NXP UM10204 rev. 7.0, section 3.1.
"""

from __future__ import annotations

import errno
import os
from collections import deque
from collections.abc import Mapping
from typing import Any, Protocol

from device.measurement.recording.led_sides import LedRatio
from device.simulation.faults import NO_FAULTS, FaultTimeline

I2C_M_RD = 0x0001
"""Flag of a message that reads (linux/i2c.h)."""


class I2cMessage(Protocol):
    """The kernel's `struct i2c_msg`, as ctypes shows it."""

    addr: Any
    flags: Any
    len: Any
    buf: Any


class EmulatedChip(Protocol):
    """What the bus asks of a chip."""

    nacks_to_come: int
    is_answering: bool

    def write(self, data: bytes) -> None:
        """Take the bytes of one write message."""

    def read(self, count: int) -> bytes:
        """Return the bytes of one read message."""

    def stop(self) -> None:
        """End a transaction."""


class EmulatedLedChip(EmulatedChip, Protocol):
    """A chip that makes light of what it is written, while it is enabled."""

    def enable(self, is_enabled: bool) -> None:
        """Set the level of the line that enables its outputs; without one they are."""

    def led_ratio(self) -> LedRatio:
        """Return the light of the four sides as it was set last."""

    def ratio_at(self, t_s: float) -> LedRatio:
        """Return the light of the four sides at a time (s, monotonic)."""


class EmulatedI2cBus:
    """Stands where `smbus2.SMBus` stands: takes genuine messages and carries them to the chips."""

    def __init__(
        self, chips: Mapping[int, EmulatedChip], *, faults: FaultTimeline = NO_FAULTS, log_length: int = 1000
    ) -> None:
        self._chips, self._faults = dict(chips), faults
        self.log: deque[tuple[int, bytes]] = deque(maxlen=log_length)
        self.is_closed = False

    def i2c_rdwr(self, *i2c_msgs: I2cMessage) -> None:
        """Carry out one transaction; raise `OSError` as the kernel does: 121 not acknowledged, 110 stuck bus."""
        self._faults.hold_up("i2c_frozen")
        error = errno.EBADF if self.is_closed else self._faults.i2c_errno()
        if error is not None:
            raise OSError(error, os.strerror(error))
        for message in i2c_msgs:
            self._carry(message, self._acknowledging(message.addr))
        for address in {message.addr for message in i2c_msgs}:
            self._chips[address].stop()

    def close(self) -> None:
        """Release the bus; the chips keep their light, as real ones do."""
        self.is_closed = True

    def _acknowledging(self, address: int) -> EmulatedChip:
        chip = self._chips.get(address)
        if chip is None or chip.nacks_to_come > 0 or not chip.is_answering:
            if chip is not None and chip.nacks_to_come > 0:
                chip.nacks_to_come -= 1
            raise OSError(121, "Remote I/O error")  # EREMOTEIO, which macOS does not name
        return chip

    def _carry(self, message: I2cMessage, chip: EmulatedChip) -> None:
        if message.flags & I2C_M_RD:
            for index, value in enumerate(chip.read(message.len)):
                message.buf[index] = value
        else:
            data = bytes(message.buf[: message.len])
            self.log.append((message.addr, data))
            chip.write(data)
