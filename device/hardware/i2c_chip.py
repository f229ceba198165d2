"""One chip on the I2C bus: register values out and in, and what can go wrong told in words.

Easy to get wrong: two chips at one address both acknowledge, and each line of the bus shows 0 where either sends 0; so
a chip is asked who it is by registers that nobody writes.
Source: NXP UM10204 rev. 7.0 "I2C-bus specification", section 3.1; the errors are those of Linux' i2c-dev.
"""

from __future__ import annotations

import errno
from collections.abc import Sequence
from typing import Protocol

from smbus2 import i2c_msg

from device.errors import LightBusError, LightError
from device.hardware.interfaces import LED_COUNT
from device.measurement.quantities import Bound, InvalidQuantity, require

REMEDY = "Check the cable and the supply of the LED board."
STUCK_ERRNO = (errno.ETIMEDOUT, errno.EBUSY, errno.EAGAIN)
"""A line held low: the kernel's driver waits in vain, finds the bus busy, or loses the arbitration."""


class I2cBus(Protocol):
    """The part of `smbus2.SMBus` that a driver needs."""

    def i2c_rdwr(self, *i2c_msgs: i2c_msg) -> None:
        """Send and receive the messages as one transaction; raise `OSError` when one is not acknowledged."""

    def close(self) -> None:
        """Release the bus."""


class I2cChip:
    """The LED chip at one address. Every method raises `LightError`, or `LightBusError` when the bus is stuck."""

    def __init__(self, bus: I2cBus, address: int) -> None:
        self._bus = bus
        self.address = address

    def write(self, register: int, values: Sequence[int]) -> None:
        """Write values from a register (or control byte) on, in one transaction."""
        self._transfer(i2c_msg.write(self.address, [register, *values]))

    def read(self, register: int, count: int) -> list[int]:
        """Return `count` values from a register (or control byte) on."""
        answer = i2c_msg.read(self.address, count)
        self._transfer(i2c_msg.write(self.address, [register]), answer)
        return list(answer.buf[:count])

    def require_held(self, what: str, written: Sequence[int], held: Sequence[int]) -> None:
        """Raise `LightError` when what was read back is not what was written."""
        if list(held) != list(written):
            cause = f"LED chip {self.address:#04x} holds {what} {list(held)} instead of {list(written)}."
            raise LightError(cause, REMEDY)

    def require_identity(self, kind: str, register: int, values: Sequence[int]) -> None:
        """Raise `LightError` when registers that nobody writes do not hold what this kind of chip powers on with."""
        held = self.read(register, len(values))
        if held != list(values):
            cause = (
                f"At {self.address:#04x} is no {kind}, or another device too: it answers {held}, not {list(values)}."
            )
            raise LightError(cause, "Set light.chip and light.address as on the LED board; one device an address.")

    def close(self) -> None:
        """Release the bus."""
        self._bus.close()

    def _transfer(self, *messages: i2c_msg) -> None:
        try:
            self._bus.i2c_rdwr(*messages)
        except OSError as error:
            words = f"{error.strerror} (errno {error.errno})."
            if error.errno in STUCK_ERRNO:
                remedy = "Switch the probe off and on; if it stays, a chip on the bus or its cable is broken."
                raise LightBusError(f"The I2C bus of the LED chip is stuck: {words}", remedy) from error
            raise LightError(f"LED chip {self.address:#04x} does not answer: {words}", REMEDY) from error


def brightness_counts(ratio: Sequence[float], full_scale: int) -> list[int]:
    """Return the brightness of the four sides in whole steps of `full_scale`; raise `InvalidQuantity` beyond 0..1."""
    action = "give four sides (+x, +y, -x, -y) as a ratio of full scale"
    if len(ratio) != LED_COUNT:
        raise InvalidQuantity("led_ratio", ratio, f"{LED_COUNT} numbers", action)
    bound = Bound(0.0, 1.0, "")
    return [round(full_scale * require(f"led_ratio[{side}]", value, bound, action)) for side, value in enumerate(ratio)]
