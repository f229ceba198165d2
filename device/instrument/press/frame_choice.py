"""The frames that a press of a mode wants: those of one held force, or the nearest to each force of a ramp.

Which frame counts is for the press machine to say. A hold wants ten that are alike (Lee & Won 2013, section IV: ten
frames a lesion, averaged). A ramp keeps a frame for a target within half a spacing, on the way up or down; it is
complete when every target has its frame and the hand is at the top, where it then holds. Which forces an estimate
needs: device/measurement/mode.py.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from device.config import PressSection
from device.instrument.acquisition.frame_check import TearWatch
from device.instrument.press.frame_outliers import Outlier, ramp_outlier, worst_outlier
from device.instrument.press.states import HELD_GUIDANCE, Guidance, PressState
from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N, Mode
from device.measurement.recording.tactile_image import Frame, Role

TOUCH_RATIO = 0.7
"""A frame on the way to the hold, at less than this part of its force, shows what the force does to the image."""
FEWEST_COMPARED = 2
"""Whether a frame is torn shows only beside another one."""
REFERENCE_BEYOND_N = 0.02
"""So much further the reference ramp reaches at both ends: no press frame's flat field is extrapolated."""


class WantedFrames(Protocol):
    """Frames of one press: those that are kept so far, and the forces at which more are wanted."""

    is_ramp: bool

    @property
    def frames(self) -> list[Frame]:
        """The frames so far, at most as many as the mode needs."""

    @property
    def window_n(self) -> tuple[float, float]:
        """Forces (N) between which frames are wanted."""

    @property
    def wanted_n(self) -> tuple[float, ...]:
        """Forces (N) at which a frame is still wanted."""

    @property
    def is_complete(self) -> bool:
        """Whether all frames are there."""

    def see(self, frame: Frame, state: PressState) -> Guidance:
        """Keep a frame of the touching probe if it counts; return what to do next."""

    def drop_outlier(self, dark_counts: float) -> Outlier | None:
        """Drop the frame that is most unlike the others and return it, or None when they are alike."""

    def begin_again(self) -> None:
        """Forget all frames: the probe was lifted."""

    def light_and_hard(self) -> tuple[Frame, list[Frame]] | None:
        """Return a frame at a small force and those at the largest, or None when no small one was seen."""


def wanted_frames(mode: Mode, role: Role, press: PressSection, tears: TearWatch) -> WantedFrames:
    """Return what a press of a mode and role wants."""
    count = FRAMES[mode].count
    if FRAMES[mode].is_ramp:
        return RampFrames(ramp_targets_n(count, role), tears)
    return HoldFrames(count, press, tears)


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


class RampFrames:
    """One frame for each of two or more target forces, evenly spaced and growing."""

    is_ramp = True

    def __init__(self, targets_n: tuple[float, ...], tears: TearWatch) -> None:
        self._targets_n, self._reach_n = targets_n, (targets_n[1] - targets_n[0]) / 2
        self._tears = tears
        self._kept: dict[float, Frame] = {}
        self._before: Frame | None = None
        self._is_rising = True

    @property
    def frames(self) -> list[Frame]:
        """The frames so far, by growing target."""
        return [self._kept[target] for target in self._targets_n if target in self._kept]

    @property
    def window_n(self) -> tuple[float, float]:
        """Forces (N) between which frames are wanted: half a spacing beyond both ends of the ramp."""
        return self._targets_n[0] - self._reach_n, self._targets_n[-1] + self._reach_n

    @property
    def wanted_n(self) -> tuple[float, ...]:
        """Forces (N) at which a frame is still wanted."""
        return tuple(target for target in self._targets_n if target not in self._kept)

    @property
    def is_complete(self) -> bool:
        """Whether all frames are there and the hand has come to the top."""
        return not self.wanted_n and self._before is not None and self._before.force_n >= self._targets_n[-1]

    def see(self, frame: Frame, state: PressState) -> Guidance:
        """Keep a frame of the touching probe if it counts; return what to do next."""
        is_whole = self._agrees_with_the_one_before(frame)
        if is_whole and state is PressState.CAPTURING:
            self._keep(frame)
        return Guidance.SLOWER if state is PressState.UNSTEADY else self._advise(frame.force_n)

    def drop_outlier(self, dark_counts: float) -> Outlier | None:
        """Drop the frame that lies furthest from the course of the others and return it; None when all follow it."""
        worst = ramp_outlier(self.frames, dark_counts)
        if worst:
            self._kept = {target: kept for target, kept in self._kept.items() if kept is not worst.frame}
        return worst

    def begin_again(self) -> None:
        """Forget all frames: the probe was lifted."""
        self._kept.clear()
        self._before, self._is_rising = None, True

    def light_and_hard(self) -> tuple[Frame, list[Frame]]:
        """Return the frame at the smallest force, and in a list that at the largest."""
        return self.frames[0], self.frames[-1:]

    def _agrees_with_the_one_before(self, frame: Frame) -> bool:
        """Compare neighbours in time, whose forces hardly differ; when one is torn, neither stays."""
        before, self._before = self._before, frame
        if before is None or self._tears.agree(before, frame):
            return True
        self._kept = {target: kept for target, kept in self._kept.items() if kept is not before}
        self._before = None
        return False

    def _keep(self, frame: Frame) -> None:
        def miss_n(other: Frame) -> float:
            return abs(other.force_n - target)

        target = min(self._targets_n, key=lambda force: abs(force - frame.force_n))
        kept = self._kept.get(target)
        if miss_n(frame) <= self._reach_n and (kept is None or miss_n(frame) < miss_n(kept)):
            self._kept[target] = frame

    def _advise(self, force_n: float) -> Guidance:
        """Lead up past every open target, and only from the last one down again to those that were missed."""
        wanted_n = self.wanted_n or self._targets_n[-1:]
        if min(wanted_n) >= force_n - self._reach_n:
            self._is_rising = True
        elif max(wanted_n) < force_n - self._reach_n:
            self._is_rising = False
        if not self.wanted_n and force_n >= self._targets_n[-1]:
            return Guidance.HOLD_STILL
        return Guidance.PRESS_SLOWLY if self._is_rising else Guidance.PRESS_LIGHTER


def ramp_targets_n(count: int, role: Role) -> tuple[float, ...]:
    """Return the `count` forces (N), evenly spaced and growing, at which a press of a role is to be seen."""
    beyond_n = REFERENCE_BEYOND_N if role == "reference" else 0.0
    return tuple(float(force) for force in np.linspace(RAMP_FROM_N - beyond_n, RAMP_TO_N + beyond_n, count))
