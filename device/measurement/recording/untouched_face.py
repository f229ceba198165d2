"""Frames of the untouched probe, dark and lit, to the light near each side, and how far it is from a certificate's.

An untouched face may be quite dark, since total reflection keeps the LEDs' light inside. Then its light says nothing
about the LEDs, only whether residue on the face lets light out that does not come from a press. The light near a side
comes from all four LEDs, so it is compared under the certificate's own brightness, never scaled to it.
Source: frustrated total reflection, Han, UIST 2005.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.led_sides import SIDES, LedRatio
from device.measurement.recording.tactile_image import Counts, Frame

RESOLVED_COUNTS = 2.0
"""Light above dark, of 8 bits, below which a camera without noise would round a tenth of it away."""
LEAST_CHANGE_RATIO = 0.1
"""The change that has to be told."""
SPREADS = 5.0
"""So many standard deviations of a frame's level that change must be."""
SAME_RATIO = 0.002
"""Half a step of an 8-bit brightness."""
ACTION = "calibrate the probe again"


@dataclass(frozen=True)
class Drift:
    """The largest change of a side: of its light, or when the certificate's is too dim, in parts of a press's light.

    `change_ratio` is negative where light was lost.
    """

    side: str
    change_ratio: float
    is_of_its_own_light: bool


@dataclass(frozen=True)
class UntouchedFace:
    """What a certificate keeps of the untouched probe: mean counts of 8 bits, without the dark but for `dark_counts`.

    `side_counts`: of the quarter of the image next to each side, in the order of `SIDES`, with all LEDs on at
    `led_ratio`, one number for the four sides or, where they differ, four; `spread_counts`: standard deviation of such
    a level from frame to frame; `pressed_counts`: of the whole image in the press without an inclusion.
    """

    dark_counts: float
    side_counts: tuple[float, ...]
    spread_counts: float
    pressed_counts: float
    led_ratio: float | tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.side_counts) != len(SIDES):
            raise InvalidQuantity("untouched.side_counts", list(self.side_counts), "one number a side", ACTION)
        counts = Bound(-255.0, 255.0, "counts")
        for level in (self.dark_counts, *self.side_counts):
            require("untouched counts", level, counts, ACTION)
        require("untouched.spread_counts", self.spread_counts, Bound(0.0, 255.0, "counts"), ACTION)
        above = Bound(0.0, 255.0, "counts", low_included=False)
        require("untouched.pressed_counts", self.pressed_counts, above, ACTION)
        for ratio in self.led_ratio if isinstance(self.led_ratio, tuple) else (self.led_ratio,):
            require("untouched.led_ratio", ratio, Bound(0.0, 1.0, "", low_included=False), ACTION)
        _ = self.lit_ratio

    @property
    def lit_ratio(self) -> LedRatio:
        """The brightness of each side at the calibration; raises `InvalidQuantity` when it is not that of four."""
        sides = self.led_ratio if isinstance(self.led_ratio, tuple) else (self.led_ratio,) * len(SIDES)
        if len(sides) != len(SIDES):
            raise InvalidQuantity("untouched.led_ratio", list(sides), "one number, or one a side", ACTION)
        plus_x, plus_y, minus_x, minus_y = sides
        return plus_x, plus_y, minus_x, minus_y

    @property
    def is_resolved(self) -> bool:
        """Whether a change of a tenth can be told on every side."""
        dimmest = min(self.side_counts)
        return dimmest >= RESOLVED_COUNTS and LEAST_CHANGE_RATIO * dimmest >= SPREADS * self.spread_counts

    def drift(self, unloaded: Sequence[Frame]) -> Drift:
        """Return the largest change of a side in unloaded frames, dark and lit at `lit_ratio`.

        A side gives its quarter only 36-41 % of the light (`tests/host_tools/calibration/test_untouched_frames.py`, the
        simulated probes), so what another brightness would have shown cannot be told from one lit frame. Raises
        `InvalidQuantity` when dark or lit frames are missing, or for another brightness.
        """
        dark, lit = split(unloaded)
        if not np.allclose(mean_led_ratio(lit), self.lit_ratio, rtol=0.0, atol=SAME_RATIO):
            bound = f"{self.lit_ratio} as at the calibration"
            raise InvalidQuantity("led_ratio of unloaded frames", mean_led_ratio(lit), bound, "light them so")
        certified = np.array(self.side_counts)
        light = lit_counts(lit, side_levels(dark).mean(axis=0)).mean(axis=0) - certified
        change = light / certified if self.is_resolved else np.maximum(light, 0.0) / self.pressed_counts
        side = int(np.argmax(np.abs(change)))
        return Drift(SIDES[side], float(change[side]), self.is_resolved)


def split(unloaded: Sequence[Frame]) -> tuple[list[Frame], list[Frame]]:
    """Return the dark and the lit frames; raise `InvalidQuantity` when there are none."""
    dark = [frame for frame in unloaded if frame.role == "dark"]
    lit = [frame for frame in unloaded if frame.role != "dark" and any(frame.led_ratio)]
    for name, frames in (("dark frames", dark), ("lit unloaded frames", lit)):
        if not frames:
            raise InvalidQuantity(name, 0, "at least one", "record the untouched probe before the press")
    return dark, lit


def lit_counts(lit: Sequence[Frame], dark_counts: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the light near each side above dark [frames, sides]."""
    return side_levels(lit) - dark_counts


def mean_led_ratio(lit: Sequence[Frame]) -> tuple[float, ...]:
    """Return the brightness of each side, the mean over lit frames."""
    return tuple(round(float(ratio), 6) for ratio in np.mean([frame.led_ratio for frame in lit], axis=0))


def side_levels(frames: Sequence[Frame]) -> NDArray[np.float64]:
    """Return the mean counts, of 8 bits, in the quarter of the image next to each side [frames, sides]."""
    quarters = _quarters(frames[0].counts.shape)
    return np.array([[_counts(frame.counts[quarter]) for quarter in quarters] for frame in frames])


def _counts(counts: Counts) -> float:
    return float(counts.mean()) / (1 if counts.dtype == np.uint8 else 256)


@lru_cache(maxsize=2)
def _quarters(shape: tuple[int, int]) -> tuple[NDArray[np.bool_], ...]:
    """Return the quarters between the diagonals, in the order of `SIDES`; +y is down, as in the image."""
    height, width = shape
    x = ((np.arange(width) - (width - 1) / 2) / width)[None, :]
    y = ((np.arange(height) - (height - 1) / 2) / height)[:, None]
    along_x = np.abs(x) > np.abs(y)
    return along_x & (x > 0), ~along_x & (y > 0), along_x & (x < 0), ~along_x & (y < 0)
