"""A PCA9685 as its I2C bus sees it: message bytes in, the light of outputs 0-3 out.

What counts as light is decided by the registers alone. New brightness shows at the end of the PWM period in which the
transaction ended, as the datasheet's figure 10 draws it; within a period the light is its mean. Sub- and all-call
addresses, RESTART and an external clock are not modelled.
Source: NXP PCA9685 datasheet rev. 4 (16 April 2015), section 7.3.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from device.measurement.recording.led_sides import LedRatio
from device.simulation.chips.light_history import LightHistory

MODE1, MODE2, SUBADR1, LED0_ON_L, LED15_OFF_H = 0x00, 0x01, 0x02, 0x06, 0x45
ALL_LED_ON_L, ALL_LED_OFF_H, PRE_SCALE = 0xFA, 0xFD, 0xFE
REGISTER_COUNT = 0x100
OUTPUTS = 16
SLEEP, AUTO_INCREMENT, FULL = 0x10, 0x20, 0x10
SMALLEST_PRESCALE = 3
STEPS = 4096
INTERNAL_HZ = 25e6
POWER_ON = {MODE1: b"\x11\x04", SUBADR1: b"\xe2\xe4\xe8\xe0", LED0_ON_L: b"\0\0\0\x10" * OUTPUTS, PRE_SCALE: b"\x1e"}
"""Registers that are not 0 after power-on: asleep, answering to all-call, every output always off (tables 5-9)."""


class Pca9685Chip:
    """The registers of one chip, and the light that they make."""

    def __init__(self, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._history = clock, LightHistory()
        self.nacks_to_come, self.is_answering, self._is_enabled = 0, True, True
        self.power_on()

    def enable(self, is_enabled: bool) -> None:
        """Set the level of OE: disabled, every output is off at once, whatever its registers hold (7.4, OUTNE = 0)."""
        self._is_enabled = is_enabled
        self._history.note(self._clock(), self._light())

    def power_on(self) -> None:
        """Put all registers into their state after power-on: asleep, outputs off."""
        self._registers = bytearray(REGISTER_COUNT)
        for first, values in POWER_ON.items():
            self._registers[first : first + len(values)] = values
        self._register = 0
        self.stop()

    def write(self, data: bytes) -> None:
        """Take the bytes of one write message: the address of a register, then register values."""
        if data:
            self._register = data[0]
        for value in data[1:]:
            self._put(self._step(), value)

    def read(self, count: int) -> bytes:
        """Return `count` register values from the present register on; those of all outputs read 0."""
        registers = [self._step() for _ in range(count)]
        return bytes(0 if ALL_LED_ON_L <= number <= ALL_LED_OFF_H else self._registers[number] for number in registers)

    def stop(self) -> None:
        """End a transaction: the outputs change at the end of the PWM period (MODE2 OCH = 0, figure 10)."""
        period_s = STEPS * (self._registers[PRE_SCALE] + 1) / INTERNAL_HZ
        self._history.note(math.ceil(self._clock() / period_s) * period_s, self._light())

    def led_ratio(self) -> LedRatio:
        """Return the light of the four sides as it was set last."""
        return self._history.last

    def ratio_at(self, t_s: float) -> LedRatio:
        """Return the light of the four sides at time `t_s`."""
        return self._history.at(t_s)

    def _step(self) -> int:
        """Return the present register, and move on if MODE1 says so (7.3, table 4, remark)."""
        register = self._register
        if self._registers[MODE1] & AUTO_INCREMENT:
            self._register = 0 if register in (LED15_OFF_H, PRE_SCALE) else (register + 1) % REGISTER_COUNT
        return register

    def _put(self, register: int, value: int) -> None:
        if ALL_LED_ON_L <= register <= ALL_LED_OFF_H:
            for output in range(OUTPUTS):
                self._registers[LED0_ON_L + 4 * output + register - ALL_LED_ON_L] = value
        elif register == PRE_SCALE:
            if self._registers[MODE1] & SLEEP:
                self._registers[PRE_SCALE] = max(value, SMALLEST_PRESCALE)
        elif register <= LED15_OFF_H:
            self._registers[register] = value

    def _light(self) -> LedRatio:
        plus_x, plus_y, minus_x, minus_y = (self._output(number) for number in range(4))
        return plus_x, plus_y, minus_x, minus_y

    def _output(self, number: int) -> float:
        first = LED0_ON_L + 4 * number
        on_low, on_high, off_low, off_high = self._registers[first : first + 4]
        if not self._is_enabled or self._registers[MODE1] & SLEEP or off_high & FULL:
            return 0.0
        if on_high & FULL:
            return 1.0
        return (off_low + 256 * off_high - on_low - 256 * on_high) % STEPS / STEPS
