"""A TLC59116 as its I2C bus sees it: message bytes in, the light of outputs 0-3 out.

What counts as light is decided by the registers alone: an output is dark while the oscillator is off or its LEDOUT
mode is "off", whatever its brightness register holds. Group dimming and error flags are not modelled.
Source: Texas Instruments TLC59116 datasheet SLDS157E, section 9.5 "Register Maps".
"""

from __future__ import annotations

import errno
import os
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, Protocol

from device.measurement.tactile_image import LedRatio
from device.simulation.faults import NO_FAULTS, FaultTimeline

MODE1, PWM0, GRPPWM, LEDOUT0, SUBADR1, IREF, EFLAG1 = 0x00, 0x02, 0x12, 0x14, 0x18, 0x1C, 0x1D
REGISTER_COUNT = 0x20
OSCILLATOR_OFF = 0x10
FULL_SCALE = 255
OUTPUT_OFF, OUTPUT_FULL = 0, 1

LAST_AND_FIRST = {0b100: (0x1B, 0x00), 0b101: (0x11, 0x02), 0b110: (0x13, 0x12), 0b111: (0x13, 0x02)}
"""Auto-increment options AI2..AI0 (9.5.11): after the last register comes the first. 000 stays on one register."""
POWER_ON = {MODE1: b"\x11", GRPPWM: b"\xff", SUBADR1: b"\xd2\xd4\xd8\xd0", IREF: b"\xff"}
"""Registers that are not 0 after power-on."""

HISTORY = 1024
"""Changes of the light that `ratio_at` remembers: seconds, even when it is switched for every frame."""


class Tlc59116Chip:
    """The registers of one chip, and the light that they make."""

    def __init__(self, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self.nacks_to_come = 0
        self._history: deque[tuple[float, LedRatio]] = deque(maxlen=HISTORY)
        self.power_on()

    def power_on(self) -> None:
        """Put all registers into their state after power-on: oscillator off, outputs off."""
        self._registers = bytearray(REGISTER_COUNT)
        for first, values in POWER_ON.items():
            self._registers[first : first + len(values)] = values
        self._control = 0
        self.stop()

    def write(self, data: bytes) -> None:
        """Take the bytes of one write message: the control register, then register values."""
        if data:
            self._control = data[0]
        for value in data[1:]:
            register = self._step()
            if register < EFLAG1:
                self._registers[register] = value

    def read(self, count: int) -> bytes:
        """Return `count` register values from where the control register points."""
        # Bits 7..5 of MODE1 are read-only and show the auto-increment option (9.5.1).
        self._registers[MODE1] = self._registers[MODE1] & 0x1F | self._control & 0xE0
        return bytes(self._registers[self._step()] for _ in range(count))

    def stop(self) -> None:
        """End a transaction: only now do the outputs change (MODE2 OCH = 0, 9.5.2)."""
        changed_s, light = self._clock(), self._light()
        with self._lock:
            if not self._history or self._history[-1][1] != light:
                self._history.append((changed_s, light))

    def led_ratio(self) -> LedRatio:
        """Return the light of the four sides as it is now."""
        with self._lock:
            return self._history[-1][1]

    def ratio_at(self, t_s: float) -> LedRatio:
        """Return the light of the four sides at time `t_s`; before the first remembered change, that change's."""
        with self._lock:
            return next(
                (ratio for changed_s, ratio in reversed(self._history) if changed_s <= t_s), self._history[0][1]
            )

    def _step(self) -> int:
        """Return the register that the control register points at, and move it on as its options say."""
        register, option = self._control & 0x1F, self._control >> 5
        if option in LAST_AND_FIRST:
            last, first = LAST_AND_FIRST[option]
            following = first if register == last else (register + 1) % REGISTER_COUNT
            self._control = option << 5 | following
        return register

    def _light(self) -> LedRatio:
        plus_x, plus_y, minus_x, minus_y = (self._output(number) for number in range(4))
        return plus_x, plus_y, minus_x, minus_y

    def _output(self, number: int) -> float:
        mode = self._registers[LEDOUT0] >> 2 * number & 0b11
        if self._registers[MODE1] & OSCILLATOR_OFF or mode == OUTPUT_OFF:
            return 0.0
        return 1.0 if mode == OUTPUT_FULL else self._registers[PWM0 + number] / FULL_SCALE


class I2cMessage(Protocol):
    """The kernel's `struct i2c_msg`, as ctypes shows it."""

    addr: Any
    flags: Any
    len: Any
    buf: Any


I2C_M_RD = 0x0001
"""Flag of a message that reads (linux/i2c.h)."""


class EmulatedI2cBus:
    """Stands where `smbus2.SMBus` stands: takes genuine messages and carries them to the chips."""

    def __init__(
        self, chips: Mapping[int, Tlc59116Chip], *, faults: FaultTimeline = NO_FAULTS, log_length: int = 1000
    ) -> None:
        self._chips, self._faults = dict(chips), faults
        self.log: deque[tuple[int, bytes]] = deque(maxlen=log_length)
        self.is_closed = False

    def i2c_rdwr(self, *i2c_msgs: I2cMessage) -> None:
        """Carry out one transaction; raise `OSError` as the kernel does: 121 not acknowledged, 110 stuck bus."""
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

    def _acknowledging(self, address: int) -> Tlc59116Chip:
        chip = self._chips.get(address)
        if chip is None or chip.nacks_to_come > 0:
            if chip is not None:
                chip.nacks_to_come -= 1
            raise OSError(121, "Remote I/O error")  # EREMOTEIO, which macOS does not name
        return chip

    def _carry(self, message: I2cMessage, chip: Tlc59116Chip) -> None:
        if message.flags & I2C_M_RD:
            for index, value in enumerate(chip.read(message.len)):
                message.buf[index] = value
        else:
            data = bytes(message.buf[: message.len])
            self.log.append((message.addr, data))
            chip.write(data)
