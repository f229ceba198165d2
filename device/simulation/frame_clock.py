"""Number of a frame to the instants of its exposure, in whole ns of the one monotonic clock, as picamera2 counts them.

Frame k is exposed from start_ns + k * frame_ns whether or not anyone asks for it.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, eq=False)
class FrameClock:
    """When the frames of one stream are exposed: every frame_ns, for exposure_ns. Two streams are never equal."""

    start_ns: int
    frame_ns: int
    exposure_ns: int

    def frame(self, number: int) -> ClockedFrame:
        """Return the frame of that number, counted from 0."""
        start_ns = self.start_ns + number * self.frame_ns
        return ClockedFrame(self, number, start_ns, start_ns + self.exposure_ns)

    def first_begun_after(self, t_ns: int) -> int:
        """Return the number of the first frame whose exposure begins at or after a time."""
        return max(0, -((self.start_ns - t_ns) // self.frame_ns))

    def last_ended_before(self, t_ns: int) -> int:
        """Return the number of the last frame whose exposure has ended at a time; negative when none has."""
        return (t_ns - self.start_ns - self.exposure_ns) // self.frame_ns


@dataclass(frozen=True)
class ClockedFrame:
    """One frame of a stream; `exposure_end_ns` is what picamera2 calls SensorTimestamp."""

    clock: FrameClock
    number: int
    exposure_start_ns: int
    exposure_end_ns: int
