"""The frames of a press that holds one force: those that count, until enough of them are alike.

Which frame counts is for the press machine to say. Source: Lee & Won 2013, section IV: ten frames a lesion, averaged.
"""

from __future__ import annotations

from device.instrument.frame_check import TearWatch
from device.instrument.guidance import HELD_GUIDANCE, Guidance
from device.instrument.outlier_frames import Outlier, worst_outlier
from device.instrument.press_state import PressState
from device.measurement.tactile_image import Frame
from device.settings.press_section import PressSection

TOUCH_RATIO = 0.7
"""A frame on the way to the hold, at less than this part of its force, shows what the force does to the image."""
FEWEST_COMPARED = 2
"""Whether a frame is torn shows only beside another one."""


class HoldFrames:
    """`count` frames at the target force."""

    is_ramp = False

    def __init__(self, count: int, press: PressSection, tears: TearWatch) -> None:
        self._count, self._press, self._tears = count, press, tears
        self._frames: list[Frame] = []
        self._touch: Frame | None = None

    @property
    def frames(self) -> list[Frame]:
        """The frames so far, at most as many as are needed."""
        return self._frames[-self._count :]

    @property
    def window_n(self) -> tuple[float, float]:
        """Forces (N) between which frames are wanted: the band around the target."""
        return self._press.band_n

    @property
    def wanted_n(self) -> tuple[float, ...]:
        """Forces (N) at which frames are still wanted: the target, until all are there."""
        return () if self.is_complete else (self._press.target_n,)

    @property
    def is_complete(self) -> bool:
        """Whether all frames are there."""
        return len(self._frames) >= max(self._count, FEWEST_COMPARED)

    def see(self, frame: Frame, state: PressState) -> Guidance:
        """Keep a frame of the touching probe if it counts; return what to do next."""
        self._touch = self._touch or frame
        if state is PressState.CAPTURING:
            self._tears.append(self._frames, frame)
        return HELD_GUIDANCE[state]

    def drop_outlier(self, dark_counts: float) -> Outlier | None:
        """Drop the frame that is most unlike the others and return it, or None when they are alike."""
        worst = worst_outlier(self._frames, dark_counts)
        if worst:
            self._frames = [frame for frame in self._frames if frame is not worst.frame]
        return worst

    def begin_again(self) -> None:
        """Forget all frames: the probe was lifted."""
        self._frames.clear()
        self._touch = None

    def light_and_hard(self) -> tuple[Frame, list[Frame]] | None:
        """Return a frame at a small force and those at the target, or None when the way to the hold was not seen."""
        if self._touch is None or self._touch.force_n >= TOUCH_RATIO * self._press.target_n:
            return None
        return self._touch, self.frames
