"""Brightness of the four sides to registers of a PCA9685, every write read back.

Easy to get wrong: new brightness takes effect at the end of a PWM period, not when it is acknowledged; and it flickers
at 24-1526 Hz, so an exposure must be whole periods (`PwmClock`).
Source: NXP PCA9685 datasheet rev. 4 (16 April 2015), section 7.3 "Register definitions".
"""

from __future__ import annotations

import time
from enum import IntEnum

from device.config_chips import STEPS, PwmClock
from device.errors import LightError
from device.hardware.i2c_chip import REMEDY, I2cBus, I2cChip, brightness_counts
from device.hardware.interfaces import LED_COUNT
from device.measurement.recording.led_sides import LedRatio


class Pca9685Register(IntEnum):
    """Addresses of the registers used here (datasheet 7.3, table 4)."""

    MODE1 = 0x00  # 7.3.1
    MODE2 = 0x01  # 7.3.2
    SUBADR1 = 0x02  # 7.3.6; SUBADR2, SUBADR3 and ALLCALLADR (7.3.7) follow
    LED0_ON_L = 0x06  # 7.3.3; four registers an output: ON_L, ON_H, OFF_L, OFF_H
    LED0_OFF_H = 0x09
    ALL_LED_OFF_H = 0xFD  # 7.3.4; write-only
    PRE_SCALE = 0xFE  # 7.3.5; taken only while SLEEP is set


SLEEP = 0x10
"""MODE1 (7.3.1): oscillator off, as after power-on; every output is dark."""
AUTO_INCREMENT = 0x20
"""MODE1 (7.3.1). Bit 0, the all-call address, stays 0: the chip shall answer at its own address alone."""
RESTART = 0x80
"""MODE1 (7.3.1.1): shows that outputs were running when SLEEP was set; of no interest, since they are off by then."""
TOTEM_POLE = 0x04
"""MODE2 (7.3.2): as after power-on; outputs not inverted, and changed at the STOP of a transaction (OCH = 0)."""
FULL = 0x10
"""Bit 4 of an ON_H or OFF_H register (7.3.3): output always on, or always off, which wins."""
OSCILLATOR_START_S = 0.0005
"""The oscillator runs this long after SLEEP is cleared (7.3.1, note 2)."""
IDENTITY = (0xE2, 0xE4, 0xE8, 0xE0)
"""SUBADR1..3 and ALLCALLADR after power-on (7.3.6, 7.3.7); nothing here writes them."""
REGISTERS_PER_OUTPUT = 4


class Pca9685:
    """The four sides (+x, +y, -x, -y) on outputs 0-3 of one PCA9685. Implements `Lights`."""

    def __init__(self, bus: I2cBus, *, address: int = 0x40, clock: PwmClock | None = None) -> None:
        """Start the chip with all outputs dark; raise `LightError` when it does not answer or hold its set-up."""
        self._chip, self._clock = I2cChip(bus, address), clock or PwmClock()
        self._set_up()

    def _set_up(self) -> None:
        # Dark first, which also is the orderly stop that sleeping asks for (7.3.1.1).
        self._chip.write(Pca9685Register.ALL_LED_OFF_H, [FULL])
        self._chip.write(Pca9685Register.MODE1, [AUTO_INCREMENT | SLEEP])
        self._chip.write(Pca9685Register.PRE_SCALE, [self._clock.prescale])
        self._chip.write(Pca9685Register.MODE2, [TOTEM_POLE])
        self._chip.write(Pca9685Register.MODE1, [AUTO_INCREMENT])
        time.sleep(OSCILLATOR_START_S)
        self._chip.require_identity("PCA9685", Pca9685Register.SUBADR1, IDENTITY)
        mode1, mode2 = self._chip.read(Pca9685Register.MODE1, 2)
        modes = [AUTO_INCREMENT, TOTEM_POLE, self._clock.prescale]
        held = [mode1 & ~RESTART, mode2, *self._chip.read(Pca9685Register.PRE_SCALE, 1)]
        self._chip.require_held("modes and prescaler", modes, held)

    def set_ratio(self, ratio: LedRatio) -> float:
        """Set the four sides (each 0..1 of full scale) at one instant; return when they changed (s, monotonic).

        Outputs take new values at the end of the PWM period after the STOP of the write (7.3.3, figure 10): the
        returned time is a period after the acknowledgement.
        Raises `InvalidQuantity` before the bus is touched, `LightError` when the chip does not answer or hold it,
        `LightBusError` when the bus is stuck.
        """
        outputs = [value for counts in brightness_counts(ratio, STEPS) for value in _output_registers(counts)]
        self._chip.write(Pca9685Register.LED0_ON_L, outputs)
        acknowledged_s = time.monotonic()
        count = Pca9685Register.LED0_ON_L + REGISTERS_PER_OUTPUT * LED_COUNT
        mode1, *rest = self._chip.read(Pca9685Register.MODE1, count)
        if mode1 & SLEEP:
            self._set_up()
            cause = f"LED chip {self._chip.address:#04x} had lost its set-up: its supply has dipped."
            raise LightError(cause, REMEDY)
        self._chip.require_held("brightness", outputs, rest[Pca9685Register.LED0_ON_L - 1 :])
        return acknowledged_s + 1e-6 * self._clock.period_us

    def check_outputs(self) -> None:
        """Do nothing: this chip does not measure the current of its outputs."""

    def check_line(self) -> bool:
        """Return that there is no enable line."""
        return False

    def go_on(self) -> None:
        """Do nothing: without an enable line the light stays."""

    def close(self) -> None:
        """Darken all outputs and release the bus, also when darkening fails (`LightError`)."""
        try:
            self._chip.write(Pca9685Register.ALL_LED_OFF_H, [FULL])
            self._chip.require_held("an output that is off", [FULL], self._chip.read(Pca9685Register.LED0_OFF_H, 1))
        finally:
            self._chip.close()


def _output_registers(counts: int) -> tuple[int, int, int, int]:
    """Return ON_L, ON_H, OFF_L, OFF_H of an output that is on for 0..4096 of 4096 steps.

    Equal counts for on and off are not allowed (7.3.4): none and all have bits of their own.
    """
    if counts == 0:
        return 0, 0, 0, FULL
    if counts == STEPS:
        return 0, FULL, 0, 0
    return 0, 0, counts & 0xFF, counts >> 8
