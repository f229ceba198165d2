"""Whether the probe's computer has voltage, is cool and knows the date: looked at twice a second, told with each press.

A thread of its own looks, since a voltage that is too low for two seconds in a press would be missed by whoever looks
before and after it; and whatever reading does, no press waits for it. What was seen stays seen until it is taken, so
that the press in which it was tells of it. A computer that says nothing of itself is not warned of.

Sources: a Raspberry Pi's cores are slowed down from 80 degrees on (Raspberry Pi documentation, "Frequency management
and thermal control"); its voltage alarm holds for two seconds (device/hardware/computer.py).
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

from device.errors import ClockNotSetError, ComputerHotError, DeviceError, SupplyLowError
from device.hardware.interfaces import Computer

LOOK_EVERY_S = 0.5
SLOW_FROM_C = 80.0
SUPPLY_LOW = SupplyLowError(
    "The computer's supply voltage was too low: the light or a frame may be wrong.",
    "Use the power supply and cable that belong to the probe; if it stays, have them replaced.",
)
CLOCK_NOT_SET = ClockNotSetError(
    "No time server and no battery clock has set this probe's clock since it was switched on: its date may be wrong.",
    "Compare the date on the screen with another clock, and give the probe a time server.",
)


class ComputerWatch:
    """Looks from its start until it is closed. `taken` may be called from any thread."""

    def __init__(self, computer: Computer) -> None:
        self._computer, self._lock = computer, threading.Lock()
        self._seen: dict[str, DeviceError] = {}
        self._is_date_sure = True
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="computer", daemon=True)

    def start(self) -> None:
        """Look from now on."""
        self._thread.start()

    def close(self) -> None:
        """Look no more; a look that hangs is left alone."""
        self._stopping.set()
        self._thread.join(timeout=1.0)

    def taken(self) -> tuple[DeviceError, ...]:
        """Return a warning of each kind that was seen since the last call."""
        with self._lock:
            seen, self._seen = self._seen, {}
        return tuple(seen.values())

    def warned(self, others: Sequence[DeviceError]) -> tuple[DeviceError, ...]:
        """Return these warnings with that of the date brought up to date: a time server may answer late."""
        kept = tuple(one for one in others if not isinstance(one, ClockNotSetError))
        with self._lock:
            return kept if self._is_date_sure else (*kept, CLOCK_NOT_SET)

    def look(self) -> None:
        """Remember what the computer says now, where that is a warning; of a temperature the highest."""
        state = self._computer.read()
        with self._lock:
            if state.is_supply_low:
                self._seen[SUPPLY_LOW.code] = SUPPLY_LOW
            if state.temperature_c is not None and state.temperature_c >= SLOW_FROM_C:
                self._seen[ComputerHotError.code] = _too_hot(state.temperature_c)
            self._is_date_sure = state.is_clock_set is not False

    def _run(self) -> None:
        self.look()
        while not self._stopping.wait(LOOK_EVERY_S):
            self.look()


def _too_hot(temperature_c: float) -> ComputerHotError:
    # In steps of five degrees: another sentence each half second would be another warning each time.
    reached_c = 5 * int(temperature_c // 5)
    cause = f"The probe's computer is at {reached_c} degrees or more: from {SLOW_FROM_C:g} on it works more slowly."
    return ComputerHotError(cause, "Free its openings and let it cool down.")
