"""Frames from one process to another: slots of shared memory, each with the number of the frame that lies in it.

The number says which frame it is; the message that names it travels by a pipe, which also orders writing before
reading. A reader that comes too late finds another number, before or after its copy, and takes nothing.
"""

from __future__ import annotations

from multiprocessing.shared_memory import SharedMemory

import numpy as np
from numpy.typing import NDArray

from device.errors import TornFrameError

SLOTS = 4
"""A frame may be read until so many others have been begun."""
BEING_WRITTEN = 0


class FrameRing:
    """The slots, seen from one of the two processes; frames are numbered from 1."""

    def __init__(self, memory: SharedMemory, shape: tuple[int, int]) -> None:
        """Lay the slots for frames of [height_px, width_px] over a memory."""
        self._memory = memory
        self._slots = np.ndarray(SLOTS, _slot(shape), buffer=memory.buf)
        self._written = 0

    @classmethod
    def create(cls, shape: tuple[int, int]) -> FrameRing:
        """Return a new ring, which has a name until `unlink`."""
        return cls(SharedMemory(create=True, size=SLOTS * _slot(shape).itemsize), shape)

    @classmethod
    def attach(cls, name: str, shape: tuple[int, int]) -> FrameRing:
        """Return the ring of that name, made for frames of the same shape by another process."""
        return cls(SharedMemory(name), shape)

    @property
    def name(self) -> str:
        """What another process attaches by."""
        return self._memory.name

    def write(self, counts: NDArray[np.uint8]) -> int:
        """Put a frame [height_px, width_px] over the oldest one; return its number."""
        self._written += 1
        slot = self._slots[self._written % SLOTS]
        slot["number"] = BEING_WRITTEN
        slot["counts"] = counts
        slot["number"] = self._written
        return self._written

    def read(self, number: int) -> NDArray[np.uint8]:
        """Return a copy of a frame [height_px, width_px]; raise `TornFrameError` when a later one lies over it."""
        slot = self._slots[number % SLOTS]
        before = int(slot["number"])
        counts: NDArray[np.uint8] = slot["counts"].copy()
        after = int(slot["number"])
        if not before == number == after:
            cause = f"Frame {number} was overwritten before it was read."
            raise TornFrameError(cause, "Lower camera.frame_rate_hz.")
        return counts

    def unlink(self) -> None:
        """Take the name away: the memory ends with the last process that has it open, however that one ends."""
        self._memory.unlink()

    def close(self) -> None:
        """Give the memory back as far as this process goes."""
        del self._slots  # a memory that is looked into cannot be closed
        self._memory.close()


def _slot(shape: tuple[int, int]) -> np.dtype[np.void]:
    return np.dtype([("number", np.uint64), ("counts", np.uint8, shape)], align=True)
