"""A TLC59116 as its I2C bus sees it: message bytes in, the light of outputs 0-3 out.

What counts as light is decided by the registers alone: an output is dark while the oscillator is off or its LEDOUT
mode is "off", whatever its brightness register holds. Error flags are those of outputs 0-3 that are on without PWM;
overheating is remembered until it is cleared. Group dimming is not modelled.
Source: Texas Instruments TLC59116 datasheet SLDS157E, section 9.5 "Register Maps".
"""

from __future__ import annotations

import time
from collections.abc import Callable

from device.measurement.recording.led_sides import SIDES, LedRatio
from device.simulation.chips.light_history import LightHistory
from device.simulation.faults import NO_FAULTS, FaultTimeline

MODE1, MODE2, PWM0, GRPPWM, LEDOUT0, SUBADR1, IREF, EFLAG1 = 0x00, 0x01, 0x02, 0x12, 0x14, 0x18, 0x1C, 0x1D
REGISTER_COUNT = 0x20
OSCILLATOR_OFF, CLEAR_ERRORS = 0x10, 0x80
FULL_SCALE = 255
OUTPUT_OFF, OUTPUT_FULL = 0, 1

LAST_AND_FIRST = {0b100: (0x1B, 0x00), 0b101: (0x11, 0x02), 0b110: (0x13, 0x12), 0b111: (0x13, 0x02)}
"""Auto-increment options AI2..AI0 (9.5.11): after the last register comes the first. 000 stays on one register."""
POWER_ON = {MODE1: b"\x11", GRPPWM: b"\xff", SUBADR1: b"\xd2\xd4\xd8\xd0", IREF: b"\xff"}
"""Registers that are not 0 after power-on."""


class Tlc59116Chip:
    """The registers of one chip, and the light that they make."""

    def __init__(self, *, clock: Callable[[], float] = time.monotonic, faults: FaultTimeline = NO_FAULTS) -> None:
        self._clock, self._history, self._faults = clock, LightHistory(), faults
        self.nacks_to_come, self.is_answering = 0, True
        self.power_on()

    def enable(self, is_enabled: bool) -> None:
        """Set the level of RESET: low, the chip is off the bus, and its registers are as after power-on."""
        if not is_enabled:
            self.power_on()
        self.is_answering = is_enabled

    def power_on(self) -> None:
        """Put all registers into their state after power-on: oscillator off, outputs off."""
        self._registers = bytearray(REGISTER_COUNT)
        for first, values in POWER_ON.items():
            self._registers[first : first + len(values)] = values
        self._control, self._was_hot = 0, False
        self.stop()

    def write(self, data: bytes) -> None:
        """Take the bytes of one write message: the control register, then register values."""
        if data:
            self._control = data[0]
        for value in data[1:]:
            register = self._step()
            if register < EFLAG1:
                self._registers[register] = value
            if register == MODE2 and value & CLEAR_ERRORS:
                self._was_hot = False

    def read(self, count: int) -> bytes:
        """Return `count` register values from where the control register points."""
        # Bits 7..5 of MODE1 are read-only and show the auto-increment option (9.5.1).
        self._registers[MODE1] = self._registers[MODE1] & 0x1F | self._control & 0xE0
        self._registers[EFLAG1] = self._error_flags()
        return bytes(self._registers[self._step()] for _ in range(count))

    def stop(self) -> None:
        """End a transaction: only now do the outputs change (MODE2 OCH = 0, 9.5.2)."""
        self._history.note(self._clock(), self._light())

    def led_ratio(self) -> LedRatio:
        """Return the light of the four sides as it is now."""
        return self._history.last

    def ratio_at(self, t_s: float) -> LedRatio:
        """Return the light of the four sides at time `t_s`."""
        return self._history.at(t_s)

    def _step(self) -> int:
        """Return the register that the control register points at, and move it on as its options say."""
        register, option = self._control & 0x1F, self._control >> 5
        if option in LAST_AND_FIRST:
            last, first = LAST_AND_FIRST[option]
            following = first if register == last else (register + 1) % REGISTER_COUNT
            self._control = option << 5 | following
        return register

    def _error_flags(self) -> int:
        """Return EFLAG1 (9.3, tables 1 and 2): a bit is 1 where current flows, 0 where it does not or did not."""
        self._was_hot |= self._faults.is_active("led_driver_hot")
        if self._was_hot or self._registers[MODE1] & OSCILLATOR_OFF:
            return 0
        return sum(
            1 << number
            for number, side in enumerate(SIDES)
            if self._mode(number) == OUTPUT_FULL and not self._faults.is_open(side)
        )

    def _mode(self, number: int) -> int:
        return self._registers[LEDOUT0] >> 2 * number & 0b11

    def _light(self) -> LedRatio:
        plus_x, plus_y, minus_x, minus_y = (self._output(number) for number in range(4))
        return plus_x, plus_y, minus_x, minus_y

    def _output(self, number: int) -> float:
        mode = self._mode(number)
        if self._registers[MODE1] & OSCILLATOR_OFF or mode == OUTPUT_OFF:
            return 0.0
        return 1.0 if mode == OUTPUT_FULL else self._registers[PWM0 + number] / FULL_SCALE
