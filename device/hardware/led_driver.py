"""Brightness of the four sides to registers of the LED chip, every write read back.

Easy to get wrong: after a drop of its supply the chip still acknowledges and holds brightness values, but its
oscillator sleeps and it stays dark; so the read-back covers MODE1 as well.
Source: Texas Instruments TLC59116 datasheet SLDS157E, section 9.5 "Register Maps".
"""

from __future__ import annotations

import errno
import time
from collections.abc import Sequence
from enum import IntEnum
from typing import Protocol

from smbus2 import SMBus, i2c_msg

from device.errors import LightBusError, LightError
from device.hardware.interfaces import LED_COUNT
from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.tactile_image import LedRatio


class Register(IntEnum):
    """Addresses of the registers used here (datasheet 9.5.1, 9.5.3, 9.5.6)."""

    MODE1 = 0x00
    PWM0 = 0x02
    LEDOUT0 = 0x14


AUTO_INCREMENT_ALL = 0x80
"""Control register (9.5.11): step through all registers."""
AUTO_INCREMENT_PWM = 0xA0
"""Control register (9.5.11): step through the individual brightness registers."""
OSCILLATOR_OFF = 0x10
"""OSC bit of MODE1 (9.5.1): set after power-on, and then every output is dark."""
OSCILLATOR_START_S = 0.0005
"""Outputs are not guaranteed until the oscillator has run this long (9.5.1, note)."""
PWM_CHANNELS = 16
SIDES_IN_PWM_MODE = (0b10_10_10_10, 0, 0, 0)
"""LEDOUT0..3 (9.5.6): outputs 0-3 follow their own brightness register, outputs 4-15 are off."""
FULL_SCALE = 255

REMEDY = "Check the cable and the supply of the LED board."
STUCK_ERRNO = (errno.ETIMEDOUT, errno.EBUSY, errno.EAGAIN)
"""A line held low: the kernel's driver waits in vain, finds the bus busy, or loses the arbitration."""


class I2cBus(Protocol):
    """The part of `smbus2.SMBus` that the driver needs."""

    def i2c_rdwr(self, *i2c_msgs: i2c_msg) -> None:
        """Send and receive the messages as one transaction; raise `OSError` when one is not acknowledged."""

    def close(self) -> None:
        """Release the bus."""


class Tlc59116:
    """The four sides (+x, +y, -x, -y) on outputs 0-3 of one TLC59116. Implements `Lights`."""

    def __init__(self, bus: I2cBus, *, address: int = 0x60) -> None:
        """Start the chip with all sides dark; raise `LightError` when it does not answer or hold its set-up."""
        self._bus = bus
        self._address = address
        self._set_up()

    def _set_up(self) -> None:
        self._write(Register.MODE1, [0])
        time.sleep(OSCILLATOR_START_S)
        # Brightness before output mode: whatever the registers held, no side flashes.
        self._write(AUTO_INCREMENT_PWM | Register.PWM0, [0] * PWM_CHANNELS)
        self._write(AUTO_INCREMENT_ALL | Register.LEDOUT0, SIDES_IN_PWM_MODE)
        held = self._read(AUTO_INCREMENT_ALL | Register.LEDOUT0, len(SIDES_IN_PWM_MODE))
        self._require_held("output modes", SIDES_IN_PWM_MODE, held)

    def set_ratio(self, ratio: LedRatio) -> float:
        """Set the four sides (each 0..1 of full scale) at one instant; return when they changed (s, monotonic).

        Outputs change together at the STOP of the write (9.5.2, OCH = 0), which ends before the returned time.
        Raises `InvalidQuantity` before the bus is touched, `LightError` when the chip does not answer or hold it,
        `LightBusError` when the bus is stuck.
        """
        pwm = _pwm_counts(ratio)
        self._write(AUTO_INCREMENT_PWM | Register.PWM0, pwm)
        acknowledged_s = time.monotonic()
        mode1, _mode2, *held = self._read(AUTO_INCREMENT_ALL | Register.MODE1, Register.PWM0 + LED_COUNT)
        if mode1 & OSCILLATOR_OFF:
            self._set_up()
            raise LightError(f"LED chip {self._address:#04x} had lost its set-up: its supply has dipped.", REMEDY)
        self._require_held("brightness", pwm, held)
        return acknowledged_s

    def close(self) -> None:
        """Darken all sides and release the bus, also when darkening fails (`LightError`)."""
        try:
            self.set_ratio((0.0, 0.0, 0.0, 0.0))
        finally:
            self._bus.close()

    def _write(self, control: int, values: Sequence[int]) -> None:
        self._transfer(i2c_msg.write(self._address, [control, *values]))

    def _read(self, control: int, count: int) -> list[int]:
        answer = i2c_msg.read(self._address, count)
        self._transfer(i2c_msg.write(self._address, [control]), answer)
        return list(answer.buf[:count])

    def _transfer(self, *messages: i2c_msg) -> None:
        try:
            self._bus.i2c_rdwr(*messages)
        except OSError as error:
            words = f"{error.strerror} (errno {error.errno})."
            if error.errno in STUCK_ERRNO:
                remedy = "Switch the probe off and on; if it stays, a chip on the bus or its cable is broken."
                raise LightBusError(f"The I2C bus of the LED chip is stuck: {words}", remedy) from error
            raise LightError(f"LED chip {self._address:#04x} does not answer: {words}", REMEDY) from error

    def _require_held(self, what: str, written: Sequence[int], held: Sequence[int]) -> None:
        if list(held) != list(written):
            cause = f"LED chip {self._address:#04x} holds {what} {list(held)} instead of {list(written)}."
            raise LightError(cause, REMEDY)


def _pwm_counts(ratio: Sequence[float]) -> list[int]:
    """Return the brightness registers (0..255) of the four sides."""
    action = "give four sides (+x, +y, -x, -y) as a ratio of full scale"
    if len(ratio) != LED_COUNT:
        raise InvalidQuantity("led_ratio", ratio, f"{LED_COUNT} numbers", action)
    bound = Bound(0.0, 1.0, "")
    return [round(FULL_SCALE * require(f"led_ratio[{side}]", value, bound, action)) for side, value in enumerate(ratio)]


def open_led_driver(bus_number: int, *, address: int = 0x60) -> Tlc59116:
    """Open /dev/i2c-<bus_number> and start the chip; raise `LightError` when there is no bus or no chip."""
    try:
        bus = SMBus(bus_number)
    except OSError as error:
        cause = f"I2C bus {bus_number} cannot be opened: {error.strerror} (errno {error.errno})."
        raise LightError(cause, "Enable I2C on the board and check the bus number in the configuration.") from error
    try:
        return Tlc59116(bus, address=address)
    except LightError:
        bus.close()
        raise
