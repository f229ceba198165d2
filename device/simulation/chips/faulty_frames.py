"""What a faulty camera makes of its frames: some do not come, some show the exposure before, and calls do not return.

A fault is looked up at the start of a frame's exposure, so that a frame is faulty as a whole. Provoked by the kinds
`camera_...` of device/simulation/faults.py.
"""

from __future__ import annotations

from device.simulation.chips.frame_clock import ClockedFrame
from device.simulation.faults import FaultTimeline

LATE_CAMERA_KEEPS_EVERY = 10
"""A camera that leaves out frames delivers those whose number is a multiple of this."""


class CameraCrash(Exception):  # noqa: N818 - the camera's library ends its process without a word
    """Here the process that called the camera's library dies."""


class FaultyFrames:
    """The frames of a camera as its faults let them through; without a fault, as they are."""

    def __init__(self, faults: FaultTimeline) -> None:
        self._faults = faults

    def answer(self) -> None:
        """Return as soon as a call of a camera that hangs does; raise `CameraCrash` where its process dies."""
        if self._faults.is_active("camera_crashed"):
            raise CameraCrash
        self._faults.hold_up("camera_hung")

    def is_delivered(self, frame: ClockedFrame) -> bool:
        """Return whether a frame comes at all."""
        if self._is_active("camera_late", frame) and frame.number % LATE_CAMERA_KEEPS_EVERY:
            return False
        return not self._is_active("camera_stall", frame)

    def shown_in(self, frame: ClockedFrame) -> ClockedFrame:
        """Return the frame whose exposure is delivered as that of `frame`: the one before when the camera is stale."""
        return _before(frame) if frame.number and self._is_active("camera_stale", frame) else frame

    def torn_into(self, frame: ClockedFrame) -> ClockedFrame | None:
        """Return the frame whose exposure the lower rows of a torn frame show, or None when it is whole."""
        return _before(frame) if frame.number and self._is_active("camera_torn", frame) else None

    def _is_active(self, kind: str, frame: ClockedFrame) -> bool:
        return self._faults.is_active(kind, 1e-9 * frame.exposure_start_ns)


def _before(frame: ClockedFrame) -> ClockedFrame:
    return frame.clock.frame(frame.number - 1)
