"""Frames to a tactile image: (I - dark) / (reference - dark) - 1, how much brighter the inclusion makes each pixel.

The reference is the inclusion-free press at the *force of the frame*: the hand never holds two presses equally hard,
and 1 % of force is several per cent of an inclusion's contrast (`reference_light`). Source: docs/measurement.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.reference_light import HeldLight, RampLight, reference_light
from device.measurement.recording.reference_light import Image as Image

Counts = NDArray[np.uint8] | NDArray[np.uint16]
Role = Literal["dark", "reference", "press"]
LAST_RAMP = 7
"""The largest number that a ramp on the lesion may have."""

LED_STEP = 1 / 255
"""One step of the LED chip's brightness: sides may be off so much by rounding."""
FULL_CONTRAST = 0.4
"""Contrast of the brightest colour, on every picture the same: a shallow hard inclusion of 12 mm reaches it."""
FLOOR_COUNTS = 6.0
"""A reference dimmer than this above dark (of 8 bits) divides noise by noise: the pixel is marked invalid."""


@dataclass(frozen=True)
class Frame:
    """One exposure with what was true while it was taken: role, force (N), time (s), light.

    `ramp`: of a press frame, by how many presses on the lesion it was preceded; 0 of every other frame.
    """

    counts: Counts
    role: Role
    t_s: float
    force_n: float
    led_ratio: LedRatio
    ramp: int = 0

    def __post_init__(self) -> None:
        if self.counts.ndim != 2 or self.counts.dtype not in (np.uint8, np.uint16):
            found = f"{self.counts.dtype} of shape {self.counts.shape}"
            raise InvalidQuantity("frame", found, "a mono image of 8 or 16 bit", "take mono frames")
        if self.role not in ("dark", "reference", "press"):
            raise InvalidQuantity("role", self.role, "dark, reference or press", "say what the frame shows")
        require("force_n", self.force_n, Bound(-1e3, 1e3, "N"), "tare the load cell and take the frame again")
        require("t_s", self.t_s, Bound(-1e12, 1e12, "s"), "give the frame's time")
        for ratio in self.led_ratio:
            require("led_ratio", ratio, Bound(0.0, 1.0, ""), "give the brightness of four sides")
        self._require_ramp()

    def _require_ramp(self) -> None:
        last = LAST_RAMP if self.role == "press" else 0
        is_number = isinstance(self.ramp, int) and not isinstance(self.ramp, bool)
        if not (is_number and 0 <= self.ramp <= last):
            bound = f"a whole number from 0 to {last} in a {self.role} frame"
            raise InvalidQuantity("ramp", repr(self.ramp), bound, "number the presses on the lesion from 0")


@dataclass(frozen=True)
class Reference:
    """The inclusion-free press: dark, and its light above dark at any force, as bright as it was lit at first."""

    dark: Image
    light: HeldLight | RampLight
    led_ratio: LedRatio

    def above_dark(self, force_n: float) -> Image:
        """Return reference minus dark at a force (counts)."""
        return self.light.at(force_n)


@dataclass(frozen=True)
class TactileImage:
    """Corrected contrast [height, width] and where it is valid."""

    contrast: Image
    valid: NDArray[np.bool_]
    scale: PixelScale
    force_n: float


def _floor(counts: Counts) -> float:
    return FLOOR_COUNTS if counts.dtype == np.uint8 else FLOOR_COUNTS * 256


def _mean(frames: Sequence[Frame]) -> Image:
    return np.asarray(np.mean([f.counts for f in frames], axis=0, dtype=np.float32))


def reference(frames: Sequence[Frame]) -> Reference:
    """Return the reference of a recording's dark and reference frames.

    Raises `InvalidQuantity` when a role is missing, shapes differ, or sides are not lit in the first one's proportion.
    """
    by_role = {role: [f for f in frames if f.role == role] for role in ("dark", "reference")}
    for role, found in by_role.items():
        if not found:
            raise InvalidQuantity(f"{role} frames", 0, "at least one", f"record {role} frames before the press")
    require_one_shape(frames)
    dark, lit = _mean(by_role["dark"]), by_role["reference"]
    first = lit[0].led_ratio
    above = [np.asarray((frame.counts - dark) / np.float32(brightness_of(frame.led_ratio, first))) for frame in lit]
    return Reference(dark, reference_light([frame.force_n for frame in lit], above, _floor(lit[0].counts)), first)


def brightness_of(led_ratio: LedRatio, first: LedRatio) -> float:
    """Return how many times as bright a frame is lit as the first one; raises unless every side is so many times."""
    times = sum(led_ratio) / sum(first) if sum(first) > 0 else 0.0
    if times <= 0 or any(
        abs(side - times * of_first) > LED_STEP for side, of_first in zip(led_ratio, first, strict=True)
    ):
        action = "press beside the lesion and on it under one light"
        raise InvalidQuantity("led_ratio of a frame", led_ratio, f"above 0 and in the proportion of {first}", action)
    return times


def require_one_shape(frames: Sequence[Frame]) -> None:
    """Raise `InvalidQuantity` unless all frames have the shape of the first."""
    shapes = {f.counts.shape for f in frames}
    if len(shapes) > 1:
        found = " and ".join(f"{w} x {h}" for h, w in sorted(shapes))
        raise InvalidQuantity("frame shape", f"{found} px", "the same for all frames", "use one camera mode")


def tactile_image(frame: Frame, reference: Reference, scale: PixelScale) -> TactileImage:
    """Return the corrected image of a press frame, as if it were lit as brightly as the reference.

    Refuses a frame of another shape than the reference, or whose sides are lit in another proportion.
    """
    if frame.counts.shape != reference.dark.shape:
        found, expected = ("{1} x {0} px".format(*shape) for shape in (frame.counts.shape, reference.dark.shape))
        raise InvalidQuantity("frame shape", found, f"{expected} like the reference", "use one camera mode")
    base = reference.above_dark(frame.force_n)
    valid = base >= _floor(frame.counts)
    lit = frame.counts.astype(np.float32) - reference.dark
    lit /= np.float32(brightness_of(frame.led_ratio, reference.led_ratio))
    contrast = np.divide(lit, base, out=np.ones_like(base), where=valid) - np.float32(1.0)
    return TactileImage(contrast=contrast, valid=valid, scale=scale, force_n=frame.force_n)


def full_scale(counts: Counts) -> int:
    """Return the counts of a pixel that takes no more light: 255, or in 16 bits what 10 bits say at most, 1023 x 64."""
    return 255 if counts.dtype == np.uint8 else 1023 << 6


def saturated_ratio(counts: Counts) -> float:
    """Return the part of the pixels at full scale."""
    full = full_scale(counts)
    if counts.max(initial=0) < full:  # as almost every frame: a fifth of the time, and no image of answers is made
        return 0.0
    return float(np.count_nonzero(counts >= full) / counts.size)
