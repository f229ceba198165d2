"""Whether frames show the light that they were taken under, judged by their mean counts alone.

A frame is taken only if it began after the chip acknowledged the light; but a time stamp may be that of another
picture, when a buffer is queued too late or counted wrongly. Then the first frame under a new light shows the old one.
Only a loaded face tells: an untouched one is dark under any light (total reflection).
Source: picamera2 issue 1287, a picture that does not belong to its settings.
"""

from __future__ import annotations

from collections.abc import Sequence

from device.errors import DarkSideError, StaleFrameError
from device.instrument.acquisition.light_check import FEWEST_COUNTS, level_counts
from device.measurement.recording.tactile_image import Frame

LEAST_CHANGE_COUNTS = 2 * FEWEST_COUNTS
STALE_RATIO = 0.25
"""So much of the change a frame may show and still be of the light before; a torn one shows some half of it."""
LIKE_FORCE_RATIO = 0.1
"""Frames whose forces differ by more than this part differ in level by themselves."""


class LevelWatch:
    """Compares the first two frames under each light with the last one under the light before."""

    def __init__(self) -> None:
        self._last: list[Frame] = []

    def saw(self, frame: Frame) -> None:
        """Note the next frame; raise `StaleFrameError` when the one before it shows the light from before its change.

        That is so when it has the level under the old light, and its successor under the new one has not.
        """
        self._last = [*self._last[-2:], frame]
        if len(self._last) < 3:
            return
        old, first, second = self._last
        if old.led_ratio == first.led_ratio or first.led_ratio != second.led_ratio or not _are_alike(self._last):
            return
        before, between, after = (level_counts(one) for one in self._last)
        change = abs(after - before)
        if change >= LEAST_CHANGE_COUNTS and abs(between - before) < STALE_RATIO * change:
            cause = (
                f"The camera gave an old image, from before the light was changed: it has {between:.0f} counts, "
                f"as under the old one ({before:.0f}), and the next has {after:.0f}."
            )
            raise StaleFrameError(cause, "Restart the probe; if it comes back, have its camera software checked.")


def require_lit(press: Sequence[Frame], dark_counts: float) -> None:
    """Raise `DarkSideError` when a frame of a press, taken with light on a loaded face, is as dark as without."""
    darkest = min(press, key=level_counts)
    light = level_counts(darkest) - dark_counts
    if light < FEWEST_COUNTS:
        cause = (
            f"No light from any side although all are switched on: "
            f"{light:.1f} counts above dark at {darkest.force_n:.2f} N, below {FEWEST_COUNTS:g}; "
            f"or nothing touches the face, and the load cell is wrong."
        )
        raise DarkSideError(cause, "Check the LED board's cable and the load cell's zero; have the LEDs replaced.")


def _are_alike(frames: Sequence[Frame]) -> bool:
    forces = [frame.force_n for frame in frames]
    return max(forces) - min(forces) <= LIKE_FORCE_RATIO * max(forces)
