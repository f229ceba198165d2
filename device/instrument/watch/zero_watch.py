"""Whether the load cell's zero still holds: by what the cell reads while nothing touches the probe.

A zero that is 3 mN off moves the answers of a ramp by more than their intervals say, and no image tells. Cells and
amplifiers creep by as much as they warm up, and with how the probe is held. So what is read before each press is taken
off while it is small and steady, as a weighing instrument's zero-tracking does (OIML R 76-1:2006, 4.5.7). More than
that may be a touch: it is told and left as it is. Far below zero nothing can be touched: there the zero is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from device.errors import DeviceError, ZeroOffWarning, ZeroShiftError
from device.hardware.interfaces import Newtons
from device.instrument.watch.calibration_watch import UNTOUCHED_N
from device.measurement.recording.tactile_image import Frame

TARE = "Let nothing touch the probe; if the message stays, tare it."


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

    def saw(self, unloaded: Sequence[Frame], force: MovableZero) -> None:
        """Take off what unloaded frames read, or note why not.

        Raises `ZeroShiftError` where they read less than minus a touch, or the zero has come too far from that of
        commissioning.
        """
        forces_n = [frame.force_n for frame in unloaded]
        read_n, farthest_n = float(np.mean(forces_n)), float(np.max(np.abs(forces_n)))
        self._off = None
        if farthest_n <= UNTOUCHED_N:
            force.move_zero(Newtons(read_n))
        elif read_n <= -self._contact_n:
            cause = f"Unloaded, the load cell reads {read_n:+.3f} N: its zero was taken under a load, or has moved."
            raise ZeroShiftError(cause, TARE)
        else:
            cause = f"Unloaded, the load cell reads {read_n:+.3f} N, more than {UNTOUCHED_N:g} N from zero."
            self._off = ZeroOffWarning(cause, TARE)

    def warned(self, others: Sequence[DeviceError]) -> tuple[DeviceError, ...]:
        """Return these warnings with that of the zero brought up to date."""
        kept = tuple(one for one in others if not isinstance(one, ZeroOffWarning))
        return (*kept, self._off) if self._off else kept
