"""An LED chip whose outputs a line enables: the line is up only while light is wanted, or while the chip is asked.

Easy to get wrong: two chips obey in two ways. RESET of a TLC59116 takes it off the bus and forgets every register, so
the line goes up first and the chip is set up anew; that it has forgotten shows that the line is wired to it. OE of a
PCA9685 switches its outputs alone, so its registers are dark, or right, before the line goes up.
Source: TLC59116 datasheet SLDS157E, "External Reset"; PCA9685 datasheet rev. 4, 7.4 "Active LOW output enable input".
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress

from device.errors import LightCutError, LightError, LightLineError
from device.hardware.enable_line import EnableLine
from device.hardware.interfaces import Lights
from device.measurement.recording.led_sides import LedRatio

DARK: LedRatio = (0.0, 0.0, 0.0, 0.0)


class ResettingLights:
    """A chip on whose RESET the line acts. Implements `Lights`."""

    def __init__(self, set_up: Callable[[], Lights], is_reset: Callable[[], bool], line: EnableLine) -> None:
        """Set the chip up, dark, and see that it obeys the line; `is_reset` says whether it has forgotten its set-up.

        Raises `LightError` when the chip does not answer, `LightLineError` when it does not obey.
        """
        self._set_up, self._is_reset, self._line = set_up, is_reset, line
        self._chip: Lights | None = None
        self.check_line()

    def set_ratio(self, ratio: LedRatio) -> float:
        """Set the four sides as the chip does; raise `LightCutError` when that took longer than the line is held."""
        with self._held(is_lit=any(ratio)):
            return self._ready().set_ratio(ratio)

    def check_outputs(self) -> None:
        """Look at the currents as the chip does; end dark."""
        with self._held(is_lit=False):
            self._ready().check_outputs()

    def check_line(self) -> bool:
        """Return that the chip has shown that it obeys the line; raise `LightLineError` if it does not. Ends dark."""
        self.set_ratio(DARK)  # set up, then off
        self.set_ratio(DARK)  # and seen to have been
        return True

    def go_on(self) -> None:
        """Hold the light; raise `LightCutError` when it has gone off."""
        self._line.hold()

    def close(self) -> None:
        """Darken all sides and release bus and line."""
        try:
            with suppress(LightLineError):  # told long ago; the chip is on the bus all the same
                self._ready()
            if self._chip:
                self._chip.close()
        finally:
            self._line.close()

    def _ready(self) -> Lights:
        """Return the chip with the line up, set up anew when that was down."""
        if self._line.up() and self._chip:
            return self._chip
        has_obeyed = self._chip is None or self._is_reset()
        self._chip = self._set_up()
        if not has_obeyed:
            cause = "The line that enables the LEDs was low, but the LED chip has not been reset by it."
            raise LightLineError(cause, "Check the wire from light.enable_line to RESET; see docs/contracts.md.")
        return self._chip

    @contextmanager
    def _held(self, *, is_lit: bool) -> Iterator[None]:
        """Hold the line for light, and take it down else; one that has fallen is what is wrong, not the chip."""
        try:
            yield
            if is_lit:
                self._line.hold()
        except LightCutError:
            self._line.down()
            raise
        except LightError:
            try:
                self._line.hold()
            finally:
                self._line.down()
            raise
        if not is_lit:
            self._line.down()


class GatedLights:
    """A chip on whose output enable the line acts. Implements `Lights`."""

    def __init__(self, chip: Lights, line: EnableLine) -> None:
        """Take a chip that is dark already: its outputs are enabled with the first light."""
        self._line, self._chip = line, chip

    def set_ratio(self, ratio: LedRatio) -> float:
        """Set the four sides as the chip does, and let them shine after that."""
        try:
            changed_s = self._chip.set_ratio(ratio)
        except LightError:
            self._line.down()
            raise
        if not any(ratio):
            self._line.down()
        elif not self._line.up():
            changed_s = max(changed_s, time.monotonic())
        return changed_s

    def check_outputs(self) -> None:
        """Look at the currents as the chip does; end dark."""
        self._line.down()
        self._chip.check_outputs()

    def check_line(self) -> bool:
        """Return that nothing was shown: the chip's registers do not tell whether its outputs are enabled."""
        return False

    def go_on(self) -> None:
        """Hold the light; raise `LightCutError` when it has gone off."""
        self._line.hold()

    def close(self) -> None:
        """Darken all sides and release bus and line."""
        try:
            self._line.down()
            self._chip.close()
        finally:
            self._line.close()
