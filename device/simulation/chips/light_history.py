"""When an LED chip's light changed, so that the light of any past exposure is known."""

from __future__ import annotations

import threading
from collections import deque

from device.measurement.recording.led_sides import LedRatio

HISTORY = 1024
"""Changes that are remembered: seconds, even when the light is switched for every frame."""


class LightHistory:
    """The light of the four sides over time. May be asked from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._changes: deque[tuple[float, LedRatio]] = deque(maxlen=HISTORY)

    def note(self, changed_s: float, light: LedRatio) -> None:
        """Note the light from a time (s, monotonic) on."""
        with self._lock:
            if not self._changes or self._changes[-1][1] != light:
                self._changes.append((changed_s, light))

    @property
    def last(self) -> LedRatio:
        """Return the light since the last change."""
        with self._lock:
            return self._changes[-1][1]

    def at(self, t_s: float) -> LedRatio:
        """Return the light at time `t_s`; before the first remembered change, that change's."""
        with self._lock:
            return next(
                (ratio for changed_s, ratio in reversed(self._changes) if changed_s <= t_s), self._changes[0][1]
            )
