"""Phantom recordings to what the untouched probe shows, dark and lit: what each later start is compared with."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from device.measurement.recording import Recording
from device.measurement.tactile_image import Frame
from device.measurement.untouched_face import UntouchedFace, lit_counts, mean_led_ratio, side_levels, split

UNTOUCHED_RATIO = 0.05
"""Reference frames at less than this part of the largest force are of the untouched probe."""


def untouched_face(recordings: Sequence[Recording]) -> UntouchedFace:
    """Return what the untouched probe showed: the mean over recordings, and how much a frame's level scatters.

    Light is a sum over the LEDs, each in proportion to its brightness: so the mean of frames of different brightness is
    that of the mean brightness, but scatters more.
    Raises `InvalidQuantity` when a recording has no dark, no unloaded lit or no pressed reference frames.
    """
    dark_counts, side_counts, pressed_counts = [], [], []
    untouched: list[Frame] = []
    for recording in recordings:
        lit = [frame for frame in recording.with_role("reference") if any(frame.led_ratio)]
        highest_n = max((frame.force_n for frame in lit), default=0.0)
        pressed = [frame for frame in lit if frame.force_n > UNTOUCHED_RATIO * highest_n]
        unloaded = [frame for frame in lit if frame.force_n <= UNTOUCHED_RATIO * highest_n]
        dark, unloaded = split([*recording.with_role("dark"), *unloaded])
        without = side_levels(dark).mean(axis=0)
        dark_counts.append(float(without.mean()))
        side_counts.append(lit_counts(unloaded, without))
        pressed_counts.append(float(lit_counts(pressed, without).mean()))
        untouched += unloaded
    levels, led_ratio = np.concatenate(side_counts), mean_led_ratio(untouched)
    return UntouchedFace(
        dark_counts=round(float(np.mean(dark_counts)), 4),
        side_counts=tuple(round(float(level), 4) for level in levels.mean(axis=0)),
        spread_counts=round(float(levels.std(axis=0, ddof=1).max()), 4),
        pressed_counts=round(float(np.mean(pressed_counts)), 4),
        led_ratio=led_ratio[0] if len(set(led_ratio)) == 1 else led_ratio,
    )
