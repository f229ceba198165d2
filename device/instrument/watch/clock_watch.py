"""Whether the wall clock was set: it is compared with the monotonic clock, on which everything is measured.

Slewing (at most 500 ppm, adjtimex(2)) is not a jump, because each look starts afresh from the last.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime

from device.errors import ClockJumpError
from device.records.audit import recorded

STEADY_S = 900.0
"""So long has nobody set the wall clock when ages are believed: a time server answers within a minute."""


class ClockWatch:
    """The daemon's one source of wall time. All methods may be called from any thread."""

    def __init__(
        self,
        max_jump_s: float,
        wall_time_s: Callable[[], float] = time.time,
        monotonic_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._max_jump_s, self._wall_time_s, self._monotonic_s = max_jump_s, wall_time_s, monotonic_s
        self._lock, self._jump_s = threading.Lock(), 0.0
        self._offset_s, self._steady_from_s = self.offset_s, monotonic_s()

    @property
    def offset_s(self) -> float:
        """Return wall minus monotonic time, which stays while nobody sets the clock."""
        return self._wall_time_s() - self._monotonic_s()

    def now(self) -> str:
        """Return the time as RFC 3339 in UTC."""
        return recorded(datetime.fromtimestamp(self._wall_time_s(), UTC))

    def warning(self) -> ClockJumpError | None:
        """Return the warning that the clock deserves for having been set since the last look, or None."""
        self._look()
        with self._lock:
            jump_s, self._jump_s = self._jump_s, 0.0
        if abs(jump_s) <= self._max_jump_s:
            return None
        cause = f"The clock was set by {jump_s:+.1f} s: times of presses before it, or since, are wrong by that."
        return ClockJumpError(cause, "Check the board's clock and its time server.")

    @property
    def steady_s(self) -> float:
        """For how long nobody has set the clock, since the daemon began."""
        self._look()
        return self._monotonic_s() - self._steady_from_s

    @property
    def is_steady(self) -> bool:
        """Whether nobody has set the clock for so long that ages are believed."""
        return self.steady_s >= STEADY_S

    def _look(self) -> None:
        with self._lock:
            offset_s = self.offset_s
            step_s, self._offset_s = offset_s - self._offset_s, offset_s
            if abs(step_s) > self._max_jump_s:
                self._jump_s, self._steady_from_s = self._jump_s + step_s, self._monotonic_s()
