"""How often something may be started again: so many times in any window, then not before the oldest has left it.

Source: systemd's StartLimitBurst= and StartLimitIntervalSec=, but for a window that moves on by itself.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable


class RestartLimit:
    """Counts restarts of the last `window_s` seconds."""

    def __init__(self, max_restarts: int, window_s: float, *, clock: Callable[[], float] = time.monotonic) -> None:
        self.max_restarts, self.window_s, self._clock = max_restarts, window_s, clock
        self._begun_s: deque[float] = deque()

    def allows_one(self) -> bool:
        """Return whether another restart may begin now, and count it if so."""
        now_s = self._clock()
        while self._begun_s and self._begun_s[0] <= now_s - self.window_s:
            self._begun_s.popleft()
        if len(self._begun_s) >= self.max_restarts:
            return False
        self._begun_s.append(now_s)
        return True
