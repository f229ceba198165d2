"""Deformed surface to light: the paper's linear optics, intensity = light field * (a w + b).

It is the paper's own assumption (three straight lines from image to deformation), not a picture of how skin in contact
scatters light. The light field is uneven, brighter towards each LED, and dark beyond the face.
Source: Lee & Won 2013, section III.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.led_sides import LedRatio
from device.measurement.pixel_scale import PixelScale
from device.measurement.quantities import Bound, require
from device.measurement.tactile_image import Image

ACTION = "use physical optics"


@dataclass(frozen=True)
class LinearOptics:
    """Slope a (1/mm) and intercept b of the linear tier; where the LEDs stand and how far their light reaches."""

    slope_per_mm: float = 1.0
    intercept: float = 0.15
    led_distance_mm: float = 13.0
    led_reach_mm: float = 12.0
    face_radius_mm: float = 11.0

    def __post_init__(self) -> None:
        for name in ("slope_per_mm", "led_reach_mm", "face_radius_mm"):
            require(f"optics.{name}", getattr(self, name), Bound(0.0, 1e3, "", low_included=False), ACTION)
        require("optics.intercept", self.intercept, Bound(0.0, 1e3, ""), ACTION)
        bound = Bound(self.face_radius_mm, 1e3, "mm, outside the face")
        require("optics.led_distance_mm", self.led_distance_mm, bound, "place the LEDs outside the lens's view")

    def led_fields(self, shape: tuple[int, int], scale: PixelScale) -> NDArray[np.float32]:
        """Return the light of each LED at full brightness [4, height, width]; together they are 1 in the middle."""
        x, y = scale.coordinates_mm(shape)
        places = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)]) * self.led_distance_mm
        fields = np.array([1 / (1 + ((x - px) ** 2 + (y - py) ** 2) / self.led_reach_mm**2) for px, py in places])
        middle = 4 / (1 + (self.led_distance_mm / self.led_reach_mm) ** 2)
        return np.asarray(fields * (x**2 + y**2 <= self.face_radius_mm**2) / middle, dtype=np.float32)

    def intensity(self, led_fields: NDArray[np.float32], led_ratio: LedRatio, w_mm: Image) -> Image:
        """Return the relative intensity [height, width]; 1 is full light in the middle where a w + b = 1."""
        light = np.tensordot(np.asarray(led_ratio, dtype=np.float32), led_fields, 1)
        return np.asarray(light * (np.float32(self.slope_per_mm) * w_mm + np.float32(self.intercept)))
