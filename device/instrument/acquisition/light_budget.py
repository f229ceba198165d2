"""How long the LEDs are on: in the press under way, where it is limited, and altogether, for the hours counter.

Counted from when light is asked for until darkness is acknowledged: after an error of the chip nobody knows what the
light is, and it counts as on. The flash of a current check, some milliseconds, is left out.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from device.errors import LightBudgetError


class LightBudget:
    """Seconds with light on any side. The procedure's thread alone tells it; without a limit it only counts."""

    def __init__(self, max_on_s: float = math.inf, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._max_on_s, self._clock = max_on_s, clock
        self._lit_since_s: float | None = None
        self._before_s = self._press_from_s = self._saved_s = 0.0

    def note_lit(self) -> None:
        """Note that light is asked for now."""
        if self._lit_since_s is None:
            self._lit_since_s = self._clock()

    def note_dark(self) -> None:
        """Note that the chip has acknowledged darkness."""
        self._before_s, self._lit_since_s = self._on_s, None

    def begin_press(self) -> None:
        """Count the seconds of a press from here."""
        self._press_from_s = self._on_s

    @property
    def press_s(self) -> float:
        """Seconds of light since the press began."""
        return self._on_s - self._press_from_s

    def require_left(self) -> None:
        """Raise `LightBudgetError` when the light of this press is used up."""
        if self.press_s > self._max_on_s:
            cause = f"The LEDs were on for {self.press_s:.0f} s in this press, above {self._max_on_s:g} s."
            raise LightBudgetError(cause, "Lift the probe, let the skin rest, and press again.")

    @property
    def unsaved_s(self) -> float:
        """Seconds of light that the hours counter has not been told yet."""
        return self._on_s - self._saved_s

    def note_saved(self, seconds: float) -> None:
        """Note that the hours counter has been told of so many seconds."""
        self._saved_s += seconds

    @property
    def _on_s(self) -> float:
        now_s = 0.0 if self._lit_since_s is None else self._clock() - self._lit_since_s
        return self._before_s + now_s
