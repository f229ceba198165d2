"""The pressed face and its light to the intensity on the pixels: the paper's linear assumption, or scattered light.

Both take w (mm) and p (kPa) on a grid of their own and give intensity [height, width]; at intensity 1 a pixel collects
`sensitivity_e_per_us`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol

import numpy as np

from device.measurement.led_sides import LedRatio
from device.measurement.pixel_scale import PixelScale
from device.measurement.tactile_image import Image
from device.simulation.lens import Lens, Projection
from device.simulation.lookup_optics import LookupOptics
from device.simulation.renderer import LinearOptics
from device.simulation.skin import Skin

WET_FACE_MM = 0.3
"""In the linear tier a wet face looks as if it were pressed in this far everywhere, however hard it is pressed."""
UNIT_RADIANCE = 1.5e-4
"""Radiance (1/(sr mm2) per unit of LED light) of intensity 1: about that of skin in full contact, brightest place."""


class ImageFormation(Protocol):
    """Intensity from a face; `x_mm` [1, nx] and `y_mm` [ny, 1] are where it wants the face."""

    x_mm: Image
    y_mm: Image

    def intensity(self, w_mm: Image, p_kpa: Image, led_ratio: LedRatio, *, wet_ratio: float = 0.0) -> Image:
        """Return the intensity of every pixel [height, width]; `wet_ratio` of the face is coupled by gel."""


class LinearImage:
    """The paper's straight line from deformation to intensity, on the pixels themselves; pressure does not count."""

    def __init__(self, optics: LinearOptics, shape: tuple[int, int], scale: PixelScale) -> None:
        self.x_mm, self.y_mm = scale.coordinates_mm(shape)
        self._optics, self._led_fields = optics, optics.led_fields(shape, scale)

    def intensity(self, w_mm: Image, p_kpa: Image, led_ratio: LedRatio, *, wet_ratio: float = 0.0) -> Image:
        """Return light field x (slope w + intercept)."""
        seen_mm = w_mm + np.float32(wet_ratio) * (np.float32(WET_FACE_MM) - w_mm) if wet_ratio else w_mm
        return self._optics.intensity(self._led_fields, led_ratio, seen_mm)


class ScatteredImage:
    """Light that the touched skin takes out of the block and gives back, through the lens to the pixels."""

    def __init__(self, lookup: LookupOptics, skin: Skin, lens: Lens, shape: tuple[int, int], scale: PixelScale) -> None:
        self.x_mm, self.y_mm = lookup.x_mm[None, :], lookup.y_mm[:, None]
        self._lookup, self._skin = lookup, skin
        self._projection = Projection(lens, lookup.x_mm, lookup.y_mm, shape, scale)

    def intensity(self, w_mm: Image, p_kpa: Image, led_ratio: LedRatio, *, wet_ratio: float = 0.0) -> Image:
        """Return the radiance on the pixels, in units of `UNIT_RADIANCE`."""
        skin = replace(self._skin, wet_ratio=max(self._skin.wet_ratio, wet_ratio)) if wet_ratio else self._skin
        radiance = self._lookup.radiance(w_mm, p_kpa, led_ratio, skin, bool(p_kpa.any()))
        return self._projection(radiance / np.float32(UNIT_RADIANCE))
