"""Frames to a tactile image: (I - dark) / (reference - dark) - 1, how much brighter the lump makes each pixel.

The reference is the lump-free press at the *force of the frame*: the hand never holds two presses equally hard, so
each pixel's reference is a straight line over force through all reference frames (no contact and press beside the
lesion). Pixels are not square; anything with a length goes through `PixelScale`. Source: docs/measurement.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, InvalidQuantity, require

Counts = NDArray[np.uint8] | NDArray[np.uint16]
Image = NDArray[np.float32]
Role = Literal["dark", "reference", "press"]
LedRatio = tuple[float, float, float, float]
"""Brightness of the sides +x, +y, -x, -y as a ratio of full scale, 0..1."""

FLOOR_COUNTS = 6.0
"""A reference dimmer than this above dark divides noise by noise: the pixel is marked invalid."""
FORCE_SPAN_N = 0.05
"""Reference forces closer together than this do not carry a slope; their mean is the reference."""


@dataclass(frozen=True)
class PixelScale:
    """Size of a pixel on the sensing face in mm; the two differ on the paper's camera by 17 %."""

    mm_per_px_x: float
    mm_per_px_y: float

    def __post_init__(self) -> None:
        for name in ("mm_per_px_x", "mm_per_px_y"):
            require(name, getattr(self, name), Bound(1e-4, 1.0, "mm"), "give the calibrated pixel size")

    @property
    def area_mm2(self) -> float:
        """Area of one pixel."""
        return self.mm_per_px_x * self.mm_per_px_y

    def coordinates_mm(self, shape: tuple[int, int]) -> tuple[Image, Image]:
        """Return x [1, width] and y [height, 1] of the pixel centres, 0 in the middle of the image."""
        height, width = shape
        x = (np.arange(width, dtype=np.float32) - (width - 1) / 2) * self.mm_per_px_x
        y = (np.arange(height, dtype=np.float32) - (height - 1) / 2) * self.mm_per_px_y
        return x[None, :], y[:, None]


@dataclass(frozen=True)
class Frame:
    """One exposure with what was true while it was taken: role, force (N), time (s), light."""

    counts: Counts
    role: Role
    t_s: float
    force_n: float
    led_ratio: LedRatio

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


@dataclass(frozen=True)
class Reference:
    """What each pixel shows without a lump: dark, and a straight line over force (all in counts)."""

    dark: Image
    at_zero: Image
    per_newton: Image

    def above_dark(self, force_n: float) -> Image:
        """Return reference minus dark at a force."""
        return self.at_zero + np.float32(force_n) * self.per_newton - self.dark


@dataclass(frozen=True)
class TactileImage:
    """Corrected contrast [height, width] and where it is valid."""

    contrast: Image
    valid: NDArray[np.bool_]
    scale: PixelScale
    force_n: float


def _mean(frames: Sequence[Frame]) -> Image:
    return np.asarray(np.mean([f.counts for f in frames], axis=0, dtype=np.float32))


def reference(frames: Sequence[Frame]) -> Reference:
    """Return the reference of a recording's dark and reference frames.

    Raises `InvalidQuantity` when a role is missing or shapes differ.
    """
    by_role = {role: [f for f in frames if f.role == role] for role in ("dark", "reference")}
    for role, found in by_role.items():
        if not found:
            raise InvalidQuantity(f"{role} frames", 0, "at least one", f"record {role} frames before the press")
    require_one_shape(frames)
    lit = by_role["reference"]
    force = np.array([f.force_n for f in lit], dtype=np.float32)
    level, offset = _mean(lit), force - force.mean()
    slope = np.zeros_like(level)
    if np.ptp(force) >= FORCE_SPAN_N:
        slope = np.tensordot(offset, np.array([f.counts for f in lit], dtype=np.float32), 1) / np.sum(offset**2)
    return Reference(dark=_mean(by_role["dark"]), at_zero=level - force.mean() * slope, per_newton=slope)


def require_one_shape(frames: Sequence[Frame]) -> None:
    """Raise `InvalidQuantity` unless all frames have the shape of the first."""
    shapes = {f.counts.shape for f in frames}
    if len(shapes) > 1:
        found = " and ".join(f"{w} x {h}" for h, w in sorted(shapes))
        raise InvalidQuantity("frame shape", f"{found} px", "the same for all frames", "use one camera mode")


def tactile_image(frame: Frame, reference: Reference, scale: PixelScale) -> TactileImage:
    """Return the corrected image of a press frame; refuses a frame of another shape than the reference."""
    if frame.counts.shape != reference.dark.shape:
        found, expected = ("{1} x {0} px".format(*shape) for shape in (frame.counts.shape, reference.dark.shape))
        raise InvalidQuantity("frame shape", found, f"{expected} like the reference", "use one camera mode")
    base = reference.above_dark(frame.force_n)
    valid = base >= FLOOR_COUNTS
    lit = frame.counts.astype(np.float32) - reference.dark
    contrast = np.divide(lit, base, out=np.ones_like(base), where=valid) - np.float32(1.0)
    return TactileImage(contrast=contrast, valid=valid, scale=scale, force_n=frame.force_n)


def saturated_ratio(counts: Counts) -> float:
    """Return the part of the pixels that are at full scale of their type."""
    return float(np.mean(counts == np.iinfo(counts.dtype).max))
