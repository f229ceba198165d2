"""The frames of a press that holds one force: those in the force band, taken while the hand holds still.

A force that only passes through the band does not count. Source: Lee & Won 2013, section IV: ten frames a lesion,
averaged.
"""

from __future__ import annotations

from device.config import PressSection
from device.instrument.bench import Bench
from device.instrument.frame_check import TearWatch
from device.instrument.guidance import Guidance, advise
from device.measurement.tactile_image import Frame

TOUCH_RATIO = 0.7
"""A frame on the way to the hold, at less than this part of its force, shows what the force does to the image."""
FEWEST_COMPARED = 2
"""Whether a frame is torn shows only beside another one."""


class HoldFrames:
    """`count` frames at the target force."""

    def __init__(self, count: int, press: PressSection, bench: Bench, tears: TearWatch) -> None:
        self._count, self._press, self._bench, self._tears = count, press, bench, tears
        self._frames: list[Frame] = []
        self._touch: Frame | None = None

    @property
    def frames(self) -> list[Frame]:
        """The frames so far, at most as many as are needed."""
        return self._frames[-self._count :]

    @property
    def wanted_n(self) -> tuple[float, ...]:
        """Forces (N) at which frames are still wanted: the target, until all are there."""
        return () if self.is_complete else (self._press.target_n,)

    @property
    def is_complete(self) -> bool:
        """Whether all frames are there."""
        return len(self._frames) >= max(self._count, FEWEST_COMPARED)

    def see(self, frame: Frame) -> Guidance:
        """Keep a frame of the touching probe if it counts; return what to do next."""
        self._touch = self._touch or frame
        guidance = advise(frame.force_n, self._press.band_n)
        if guidance is Guidance.HOLD_STILL and self._bench.is_steady(frame.t_s, self._press.steady_n):
            self._tears.append(self._frames, frame)
        return guidance

    def begin_again(self) -> None:
        """Forget all frames: the probe was lifted."""
        self._frames.clear()
        self._touch = None

    def light_and_hard(self) -> tuple[Frame, list[Frame]] | None:
        """Return a frame at a small force and those at the target, or None when the way to the hold was not seen."""
        if self._touch is None or self._touch.force_n >= TOUCH_RATIO * self._press.target_n:
            return None
        return self._touch, self.frames
