"""Frames that should not be trusted: those that come late, and those put together from two exposures.

A late frame is not wrong (its force is that of its own time), but a camera that leaves out most of them is failing.
A torn frame shows as a step between two rows, right across the face, against a frame taken under the same light. The
hand cannot make one: skin and force change an image smoothly or along the round edge of contact. A tear between
two equal exposures is not seen and does no harm.
"""

from __future__ import annotations

from collections import deque

import cv2
import numpy as np
from numpy.typing import NDArray

from device.errors import LateFrameError, TornFrameError
from device.measurement.recording.tactile_image import Counts, Frame

REMEDY = "Check the camera's ribbon cable, then restart the probe."
COLUMN_BLOCKS = 8
TORN_BLOCKS = 3
"""A step counts when at least so many of the blocks, side by side, show it in the same row."""
BAND_ROWS = 4
"""Rows that are averaged above and below a step, against noise."""
LOOKED_AT_FRAMES, LATE_FRAMES = 8, 4
LOOKED_AT_PAIRS, TORN_PAIRS = 20, 3

Blocks = NDArray[np.float64]
"""Mean of each row in each block of columns [height, 8]."""


class FramePace:
    """Watches how long after it was asked for a frame began."""

    def __init__(self, longest_wait_s: float) -> None:
        """Take a wait (s) above which a frame is late."""
        self._longest_wait_s = longest_wait_s
        self._late: deque[bool] = deque(maxlen=LOOKED_AT_FRAMES)

    def saw(self, asked_s: float, begun_s: float) -> None:
        """Note a frame; raise `LateFrameError` when half of the last eight were late."""
        self._late.append(begun_s - asked_s > self._longest_wait_s)
        if sum(self._late) >= LATE_FRAMES:
            self._late.clear()
            cause = f"The camera leaves out frames: the last began {begun_s - asked_s:.2f} s after it was asked for."
            raise LateFrameError(cause, REMEDY)


class TearWatch:
    """Compares neighbouring frames of one light."""

    def __init__(self, step_counts: float) -> None:
        """Take the step (counts) above which one of two frames is torn."""
        self._step_counts = step_counts
        self._torn: deque[bool] = deque(maxlen=LOOKED_AT_PAIRS)
        self._last: tuple[Counts, Blocks] | None = None

    def agree(self, one: Frame, other: Frame) -> bool:
        """Return False when one of two frames is torn, nobody can say which; raise `TornFrameError` when it goes on."""
        step_counts, row = largest_step(self._blocks_of(one.counts) - self._blocks_of(other.counts))
        self._torn.append(step_counts > self._step_counts)
        if sum(self._torn) >= TORN_PAIRS:
            self._torn.clear()
            cause = f"Frames are torn again and again, the last at row {row} by {step_counts:.0f} counts."
            raise TornFrameError(cause, REMEDY)
        return step_counts <= self._step_counts

    def _blocks_of(self, counts: Counts) -> Blocks:
        """Return a frame's blocks; those of the last one are kept, for the next frame is compared with it."""
        if self._last is None or self._last[0] is not counts:
            self._last = counts, blocks(counts)
        return self._last[1]

    def append(self, frames: list[Frame], frame: Frame) -> None:
        """Add a frame of the same light, unless it or the last one is torn: then neither stays."""
        if frames and not self.agree(frames[-1], frame):
            frames.pop()
        else:
            frames.append(frame)


def largest_step(difference: Blocks) -> tuple[float, int]:
    """Return the largest step (counts) that a straight row of a difference of two frames' `blocks` shows, and its row.

    Frames are at least 8 x 8, of 8 bits. The step is that of the third-most affected of eight column blocks, so that
    the edge of contact, which is round, does not count.
    """
    sums = np.cumsum(np.vstack([np.zeros(COLUMN_BLOCKS), difference]), axis=0)
    bands = (sums[BAND_ROWS:] - sums[:-BAND_ROWS]) / BAND_ROWS
    steps = np.sort(np.abs(bands[BAND_ROWS:] - bands[:-BAND_ROWS]), axis=1)[:, -TORN_BLOCKS]
    row = int(np.argmax(steps))
    return float(steps[row]), row + BAND_ROWS


def blocks(counts: Counts) -> Blocks:
    """Return each row's mean in eight blocks of columns [height, 8]; columns that are left over are not looked at.

    Sums of whole numbers are exact, so these are the means that NumPy gives, in a tenth of the time.
    """
    width = counts.shape[1] // COLUMN_BLOCKS
    columns = (counts[:, block * width : (block + 1) * width] for block in range(COLUMN_BLOCKS))
    sums = [cv2.reduce(block, 1, cv2.REDUCE_SUM, dtype=cv2.CV_32S) for block in columns]
    return np.asarray(np.hstack(sums) / float(width))
