"""How long the LEDs are on: over all presses, where it is limited, in one press, and altogether, for the hours counter.

Counted from when light is asked for until darkness is acknowledged: after an error of the chip nobody knows what the
light is, and it counts as on. The flash of a current check, some milliseconds, is left out.
What limits is the light of a sliding window, so that no succession of presses keeps a face lit: near infrared has no
glare that makes anybody look away, and what it warms cools in minutes. Its limit for the eye falls with time until
1000 s (IEC 62471:2006, 4.3.7), so it is the mean over minutes that counts, not a single press.
"""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Callable, Iterator

from device.errors import LightBudgetError, LightRestError

WINDOW_RATIO = 1.5
"""The window, as a multiple of the light that it may hold: at most two thirds of the time are lit."""
LEFT_RATIO = 0.1
"""A press begins only with this part of the budget left, 30 s: those of a hand that knows the probe take 3 to 10 s.

A scan of five presses on the lesion is six where that is two, and begins with three times as much.
"""


class LightBudget:
    """Seconds with light on any side; without a limit it only counts.

    The procedure's thread tells it, and at a stop the one that darkens: each reads the light's beginning once.
    """

    def __init__(self, max_on_s: float = math.inf, *, clock: Callable[[], float] = time.monotonic) -> None:
        """Allow `max_on_s` of light in any `WINDOW_RATIO` times as long."""
        self._max_on_s, self._clock = max_on_s, clock
        self._lit_since_s: float | None = None
        self._spells: deque[tuple[float, float]] = deque()
        self._before_s = self._press_from_s = self._saved_s = 0.0

    def note_lit(self) -> None:
        """Note that light is asked for now."""
        if self._lit_since_s is None:
            self._lit_since_s = self._clock()

    def note_dark(self) -> None:
        """Note that the chip has acknowledged darkness."""
        lit_since_s, now_s = self._lit_since_s, self._clock()
        if lit_since_s is None:
            return
        self._before_s += now_s - lit_since_s
        self._spells.append((lit_since_s, now_s))
        self._lit_since_s = None
        while self._spells[0][1] < self._window_from_s:
            self._spells.popleft()

    def begin_press(self) -> None:
        """Count the seconds of a press from here."""
        self._press_from_s = self.on_s

    @property
    def press_s(self) -> float:
        """Seconds of light since the press began."""
        return self.on_s - self._press_from_s

    @property
    def on_s(self) -> float:
        """Seconds of light since the start."""
        lit_since_s = self._lit_since_s
        now_s = 0.0 if lit_since_s is None else self._clock() - lit_since_s
        return self._before_s + now_s

    @property
    def window_s(self) -> float:
        """Seconds of light within the window that ends now."""
        return sum(until_s - from_s for from_s, until_s in self._inside())

    def require_left(self) -> None:
        """Raise `LightBudgetError` when the light of the window is used up: that of the press goes off."""
        if self.window_s > self._max_on_s:
            cause = f"The LEDs were on for {self.window_s:.0f} s {self._within}, above {self._max_on_s:g} s."
            error = LightBudgetError(cause, "Lift the probe and let the skin rest: the screen says how long.")
            error.wait_s = self._rest_s(ramps=1)
            raise error

    def require_for_press(self, ramps: int = 1) -> None:
        """Raise `LightRestError` when too little light is left to begin, with how long to wait.

        `ramps`: presses on the lesion there may be, after the one beside it.
        """
        wait_s = self._rest_s(ramps)
        if not wait_s:
            return
        cause = f"The LEDs were on for {self.window_s:.0f} s {self._within}, of at most {self._max_on_s:g} s."
        error = LightRestError(cause, f"Wait {wait_s} s: the probe is ready again by itself.")
        error.wait_s = wait_s
        raise error

    def _rest_s(self, ramps: int) -> int:
        """Return in how many seconds enough light is left to begin a press of so many ramps, 0 when there is now."""
        too_much_s = self.window_s - (1 - LEFT_RATIO * (1 + ramps) / 2) * self._max_on_s
        return math.ceil(self._wait_s(too_much_s)) if too_much_s > 0.0 else 0

    @property
    def unsaved_s(self) -> float:
        """Seconds of light that the hours counter has not been told yet."""
        return self.on_s - self._saved_s

    def note_saved(self, seconds: float) -> None:
        """Note that the hours counter has been told of so many seconds."""
        self._saved_s += seconds

    @property
    def _within(self) -> str:
        return f"in the last {WINDOW_RATIO * self._max_on_s:.0f} s"

    @property
    def _window_from_s(self) -> float:
        return self._clock() - WINDOW_RATIO * self._max_on_s

    def _inside(self) -> Iterator[tuple[float, float]]:
        """Yield from when until when it was lit within the window, oldest first."""
        begin_s, lit_s = self._window_from_s, self._lit_since_s
        for from_s, until_s in [*self._spells, *([] if lit_s is None else [(lit_s, self._clock())])]:
            if until_s > begin_s:
                yield max(from_s, begin_s), until_s

    def _wait_s(self, too_much_s: float) -> float:
        """Return after how long in the dark so much of the window's light lies behind it."""
        left_s, begin_s = too_much_s, self._window_from_s
        for from_s, until_s in self._inside():
            if left_s <= until_s - from_s:
                return from_s + left_s - begin_s
            left_s -= until_s - from_s
        return WINDOW_RATIO * self._max_on_s
