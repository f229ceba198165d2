"""Whether the load cell's zero still holds: by what the cell reads while nothing touches the probe.

A zero that is 3 mN off moves the answers of a ramp by more than their intervals say, and no image tells. Cells and
amplifiers creep by as much as they warm up, and with how the probe is held. So what is read before each press is taken
off while it is small and steady, a little at a time, as a weighing instrument's zero-tracking does (OIML R 76-1:2006,
4.5.7). What is left of it may be a touch: it is told. Far below zero nothing can be touched: there the zero is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from device.errors import DeviceError, ZeroOffWarning, ZeroShiftError
from device.hardware.interfaces import Newtons
from device.instrument.watch.calibration_watch import UNTOUCHED_N
from device.measurement.recording.tactile_image import Frame

TARE = "Let nothing touch the probe; if the message stays, tare it."
MOST_MOVED_N, STEADY_N, TOLD_N = 0.002, 0.005, 0.003
"""What is taken off before one press, by how much the force may vary meanwhile, and what is told of what is left.

A cell that warms up creeps by less than the first in half a minute; a touch that is lighter than a hand can feel is
followed by no more than that.
"""


class MovableZero(Protocol):
    """What gives forces, and whose zero can be moved."""

    def move_zero(self, read_n: Newtons) -> None:
        """Let what was read as a force (N) be zero from now on; raises `ZeroShiftError` where that is too far."""
        ...


class ZeroWatch:
    """Follows the zero from press to press; `contact_n` (N) is a touch."""

    def __init__(self, contact_n: float) -> None:
        self._contact_n = contact_n
        self._off: ZeroOffWarning | None = None

    def saw(self, unloaded: Sequence[Frame], force: MovableZero) -> list[Frame]:
        """Take off what unloaded frames read, or note what is left; return them with forces from the zero of now.

        Raises `ZeroShiftError` where they read less than minus a touch.
        """
        forces_n = np.array([frame.force_n for frame in unloaded])
        read_n, why, moved_n = float(forces_n.mean()), "", 0.0
        is_steady = np.abs(forces_n).max() <= UNTOUCHED_N and np.ptp(forces_n) <= STEADY_N
        if read_n <= -self._contact_n:
            cause = f"Unloaded, the load cell reads {read_n:+.3f} N: its zero was taken under a load, or has moved."
            raise ZeroShiftError(cause, TARE)
        if is_steady:
            moved_n = min(max(read_n, -MOST_MOVED_N), MOST_MOVED_N)
            try:
                force.move_zero(Newtons(moved_n))
            except ZeroShiftError as refusal:
                moved_n, why = 0.0, f" {refusal.cause}"
        left_n = abs(read_n - moved_n) if is_steady else float(np.abs(forces_n).max())
        cause = f"Unloaded, the load cell reads up to {left_n:.3f} N from zero.{why}"
        self._off = ZeroOffWarning(cause, TARE) if left_n > TOLD_N else None
        return [replace(frame, force_n=frame.force_n - moved_n) for frame in unloaded]

    def warned(self, others: Sequence[DeviceError]) -> tuple[DeviceError, ...]:
        """Return these warnings with that of the zero brought up to date."""
        kept = tuple(one for one in others if not isinstance(one, ZeroOffWarning))
        return (*kept, self._off) if self._off else kept
