"""Number of a frame to the instants of its exposure, in whole ns of the one monotonic clock, as picamera2 counts them.

Frame k is exposed whether or not anyone asks for it. What is set while the sensor runs holds from a later frame on.
"""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass


@dataclass(frozen=True)
class Timing:
    """How the frames are taken from one of them on: one every frame_ns, each exposed for exposure_ns at a gain."""

    frame_ns: int
    exposure_ns: int
    gain: float = 1.0


@dataclass(frozen=True)
class _Span:
    first: int
    start_ns: int
    timing: Timing


class FrameClock:
    """The frames of one stream, from 0. Two streams are never equal."""

    def __init__(self, start_ns: int, timing: Timing) -> None:
        self._spans = [_Span(0, start_ns, timing)]

    def change(self, number: int, timing: Timing) -> None:
        """Take the frames from `number` on in another way; a change that was to come then or later is forgotten."""
        start_ns = self.frame(number).exposure_start_ns
        self._spans = [span for span in self._spans if span.first < number] + [_Span(number, start_ns, timing)]

    def frame(self, number: int) -> ClockedFrame:
        """Return the frame of that number, counted from 0."""
        span = self._spans[bisect_right(self._spans, number, key=lambda span: span.first) - 1]
        start_ns = span.start_ns + (number - span.first) * span.timing.frame_ns
        return ClockedFrame(self, number, start_ns, span.timing)

    def first_begun_after(self, t_ns: int) -> int:
        """Return the number of the first frame whose exposure begins at or after a time."""
        span = self._span_at(t_ns)
        number = span.first - ((span.start_ns - t_ns) // span.timing.frame_ns)
        return max(0, min([number, *(later.first for later in self._spans if later.start_ns >= t_ns)]))

    def last_ended_before(self, t_ns: int) -> int:
        """Return the number of the last frame whose exposure has ended at a time; negative when none has."""
        number = self.first_begun_after(t_ns)
        while number >= 0 and self.frame(number).exposure_end_ns > t_ns:
            number -= 1
        return number

    def _span_at(self, t_ns: int) -> _Span:
        begun = [span for span in self._spans if span.start_ns <= t_ns]
        return begun[-1] if begun else self._spans[0]


@dataclass(frozen=True)
class ClockedFrame:
    """One frame of a stream; `exposure_end_ns` is what picamera2 calls SensorTimestamp."""

    clock: FrameClock
    number: int
    exposure_start_ns: int
    timing: Timing

    @property
    def exposure_end_ns(self) -> int:
        """When the exposure is over."""
        return self.exposure_start_ns + self.timing.exposure_ns
