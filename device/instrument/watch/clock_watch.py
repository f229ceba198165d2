"""Whether the wall clock was set: it is compared with the monotonic clock, on which everything is measured.

Slewing (at most 500 ppm, adjtimex(2)) is not a jump, because each look starts afresh from the last.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from datetime import UTC, datetime

from device.errors import ClockJumpError


class ClockWatch:
    """The daemon's one source of wall time."""

    def __init__(
        self,
        max_jump_s: float,
        wall_time_s: Callable[[], float] = time.time,
        monotonic_s: Callable[[], float] = time.monotonic,
    ) -> None:
        self._max_jump_s, self._wall_time_s, self._monotonic_s = max_jump_s, wall_time_s, monotonic_s
        self._offset_s = self.offset_s

    @property
    def offset_s(self) -> float:
        """Return wall minus monotonic time, which stays while nobody sets the clock."""
        return self._wall_time_s() - self._monotonic_s()

    def now(self) -> str:
        """Return the time as RFC 3339 in UTC."""
        moment = datetime.fromtimestamp(self._wall_time_s(), UTC)
        return moment.isoformat(timespec="milliseconds").replace("+00:00", "Z")

    def warning(self) -> ClockJumpError | None:
        """Return the warning that the clock deserves for having been set since the last look, or None."""
        offset_s = self.offset_s
        jump_s, self._offset_s = offset_s - self._offset_s, offset_s
        if abs(jump_s) <= self._max_jump_s:
            return None
        cause = f"The clock was set by {jump_s:+.1f} s: times of presses before it, or since, are wrong by that."
        return ClockJumpError(cause, "Check the board's clock and its time server.")
