"""Brightness of the four sides to registers of a TLC59116, every write read back.

Easy to get wrong: after a drop of its supply the chip still acknowledges and holds brightness values, but its
oscillator sleeps and it stays dark; so the read-back covers MODE1 as well. An error flag of 0 is the error: tables 1
and 2 say so and parts behave so (TI E2E forum 467320), the text of 9.5.10 says the opposite.
Source: Texas Instruments TLC59116 datasheet SLDS157E, section 9.5 "Register Maps".
"""

from __future__ import annotations

import time
from enum import IntEnum

from device.errors import HotLedDriverError, LightError, OpenLedError
from device.hardware.i2c_chip import REMEDY, I2cBus, I2cChip, brightness_counts
from device.hardware.interfaces import LED_COUNT
from device.measurement.recording.led_sides import SIDES, LedRatio


class Tlc59116Register(IntEnum):
    """Addresses of the registers used here (datasheet 9.5.1-9.5.3, 9.5.6, 9.5.7, 9.5.10)."""

    MODE1 = 0x00
    MODE2 = 0x01
    PWM0 = 0x02
    LEDOUT0 = 0x14
    SUBADR1 = 0x18
    EFLAG1 = 0x1D


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
SIDES_FULLY_ON = 0b01_01_01_01
"""LEDOUT0 (9.5.6): an open circuit is only detected at an output that is on without PWM (9.3.1)."""
CLEAR_ERRORS = 0x80
"""EFCLR bit of MODE2 (9.5.2): forgets that the chip was too hot; 0 lets it notice again (9.3.2)."""
FLAGS_SETTLE_S = 0.001
"""The datasheet gives no time for the flags; this is a hundred PWM periods."""
IDENTITY = (0xD2, 0xD4, 0xD8, 0xD0)
"""SUBADR1..3 and ALLCALLADR after power-on (9.5.7, 9.5.8); nothing here writes them."""
FULL_SCALE = 255


def is_reset(bus: I2cBus, address: int) -> bool:
    """Return whether the chip is as after power-on or RESET: its oscillator is off, which a set-up starts."""
    [mode1] = I2cChip(bus, address).read(Tlc59116Register.MODE1, 1)
    return bool(mode1 & OSCILLATOR_OFF)


class Tlc59116:
    """The four sides (+x, +y, -x, -y) on outputs 0-3 of one TLC59116. Implements `Lights`."""

    def __init__(self, bus: I2cBus, *, address: int = 0x60) -> None:
        """Start the chip with all sides dark; raise `LightError` when it does not answer or hold its set-up."""
        self._chip = I2cChip(bus, address)
        self._set_up()

    def _set_up(self) -> None:
        self._chip.write(Tlc59116Register.MODE1, [0])
        time.sleep(OSCILLATOR_START_S)
        # Brightness before output mode: whatever the registers held, no side flashes.
        self._chip.write(AUTO_INCREMENT_PWM | Tlc59116Register.PWM0, [0] * PWM_CHANNELS)
        self._chip.write(AUTO_INCREMENT_ALL | Tlc59116Register.LEDOUT0, SIDES_IN_PWM_MODE)
        self._obeys_brightness = True
        self._chip.require_identity("TLC59116", AUTO_INCREMENT_ALL | Tlc59116Register.SUBADR1, IDENTITY)
        held = self._chip.read(AUTO_INCREMENT_ALL | Tlc59116Register.LEDOUT0, len(SIDES_IN_PWM_MODE))
        self._chip.require_held("output modes", SIDES_IN_PWM_MODE, held)

    def set_ratio(self, ratio: LedRatio) -> float:
        """Set the four sides (each 0..1 of full scale) at one instant; return when they changed (s, monotonic).

        Outputs change together at the STOP of the write (9.5.2, OCH = 0), which ends before the returned time.
        Raises `InvalidQuantity` before the bus is touched, `LightError` when the chip does not answer or hold it,
        `LightBusError` when the bus is stuck.
        """
        pwm = brightness_counts(ratio, FULL_SCALE)
        self._chip.write(AUTO_INCREMENT_PWM | Tlc59116Register.PWM0, pwm)
        self._obey_brightness()
        acknowledged_s = time.monotonic()
        mode1, _mode2, *held = self._chip.read(
            AUTO_INCREMENT_ALL | Tlc59116Register.MODE1, Tlc59116Register.PWM0 + LED_COUNT
        )
        if mode1 & OSCILLATOR_OFF:
            self._set_up()
            cause = f"LED chip {self._chip.address:#04x} had lost its set-up: its supply has dipped."
            raise LightError(cause, REMEDY)
        self._chip.require_held("brightness", pwm, held)
        return acknowledged_s

    def check_outputs(self) -> None:
        """Light all sides fully for some milliseconds, and end dark; the chip tells where no current flows.

        Raises `OpenLedError` naming the sides; `HotLedDriverError` when the flags come back once they are cleared, or
        when no side has current: overheating switches all off (9.3.2). Raises `LightError` as `set_ratio` does.
        """
        self.set_ratio((0.0, 0.0, 0.0, 0.0))
        before = self._sides_without_current()
        if not before:
            return
        self._chip.write(Tlc59116Register.MODE2, [CLEAR_ERRORS])
        self._chip.write(Tlc59116Register.MODE2, [0])
        still = self._sides_without_current()
        if len(still) in (0, LED_COUNT):
            cause = f"LED chip {self._chip.address:#04x} had switched off {' and '.join(before)}: it is too hot"
            cause += "." if not still else ", or the LEDs are not connected."
            raise HotLedDriverError(cause, "Let the probe cool down; if it stays, check the LED board's cable.")
        cause = f"No current flows through the LED at {' and '.join(still)}: its circuit is open."
        raise OpenLedError(cause, "Check the LED board's cable; have the LED replaced.")

    def _sides_without_current(self) -> list[str]:
        self._obeys_brightness = False
        self._chip.write(Tlc59116Register.LEDOUT0, [SIDES_FULLY_ON])
        try:
            time.sleep(FLAGS_SETTLE_S)
            [flags] = self._chip.read(Tlc59116Register.EFLAG1, 1)
        finally:
            self._obey_brightness()
        return [side for number, side in enumerate(SIDES) if not flags >> number & 1]

    def _obey_brightness(self) -> None:
        """Leave full brightness, also that of a check whose last write was not acknowledged."""
        if not self._obeys_brightness:
            self._chip.write(Tlc59116Register.LEDOUT0, SIDES_IN_PWM_MODE[:1])
            self._obeys_brightness = True

    def check_line(self) -> bool:
        """Return that there is no enable line."""
        return False

    def go_on(self) -> None:
        """Do nothing: without an enable line the light stays."""

    def close(self) -> None:
        """Darken all sides and release the bus, also when darkening fails (`LightError`)."""
        try:
            self.set_ratio((0.0, 0.0, 0.0, 0.0))
        finally:
            self._chip.close()
