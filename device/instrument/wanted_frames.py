"""The frames that a press of a mode wants: what holds and ramps have in common, and which of the two a mode takes."""

from __future__ import annotations

from typing import Protocol

from device.instrument.frame_check import TearWatch
from device.instrument.guidance import Guidance
from device.instrument.hold_frames import HoldFrames
from device.instrument.outlier_frames import Outlier
from device.instrument.press_state import PressState
from device.instrument.ramp_frames import RampFrames, ramp_targets_n
from device.measurement.mode import FRAMES, Mode
from device.measurement.tactile_image import Frame, Role
from device.settings.press_section import PressSection


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
