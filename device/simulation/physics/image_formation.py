"""The pressed face and its light to the intensity on the pixels: the paper's linear assumption, or scattered light.

Both take w (mm) and p (kPa) on a grid of their own and give intensity [height, width]; at intensity 1 a pixel collects
`sensitivity_e_per_us`.

The paper's linear optics are intensity = light field * (a w + b): its own assumption (three straight lines from image
to deformation), not a picture of how skin in contact scatters light. The light field is uneven, brighter towards each
LED, and dark beyond the face.
Source: Lee & Won 2013, section III.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, require
from device.measurement.recording.led_sides import LedRatio
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import Image
from device.simulation.physics.lens import Lens, Projection
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.skin import Skin
from device.simulation.physics.world import AS_BELIEVED, World

ACTION = "use physical optics"
CENTRED = ProbePlacement()


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


WET_FACE_MM = 0.3
"""In the linear tier a wet face looks as if it were pressed in this far everywhere, however hard it is pressed."""
UNIT_RADIANCE = 1.5e-4
"""Radiance (1/(sr mm2) per unit of LED light) of intensity 1: about that of skin in full contact, brightest place."""


class ImageFormation(Protocol):
    """Intensity from a face; `x_mm` [1, nx] and `y_mm` [ny, 1] are where it wants the face."""

    x_mm: Image
    y_mm: Image

    def intensity(
        self,
        w_mm: Image,
        p_kpa: Image,
        led_ratio: LedRatio,
        *,
        wet_ratio: float = 0.0,
        place: ProbePlacement = CENTRED,
    ) -> Image:
        """Return the intensity of every pixel [height, width]; `wet_ratio` of the face is coupled by gel.

        `place` says which skin is pressed, in a world where that differs.
        """


class LinearImage:
    """The paper's straight line from deformation to intensity, on the pixels themselves; pressure does not count."""

    def __init__(self, optics: LinearOptics, shape: tuple[int, int], scale: PixelScale) -> None:
        self.x_mm, self.y_mm = scale.coordinates_mm(shape)
        self._optics, self._led_fields = optics, optics.led_fields(shape, scale)

    def intensity(
        self,
        w_mm: Image,
        p_kpa: Image,
        led_ratio: LedRatio,
        *,
        wet_ratio: float = 0.0,
        place: ProbePlacement = CENTRED,
    ) -> Image:
        """Return light field x (slope w + intercept)."""
        seen_mm = w_mm + np.float32(wet_ratio) * (np.float32(WET_FACE_MM) - w_mm) if wet_ratio else w_mm
        return self._optics.intensity(self._led_fields, led_ratio, seen_mm)


class ScatteredImage:
    """Light that the touched skin takes out of the block and gives back, through the lens to the pixels."""

    def __init__(
        self,
        lookup: LookupOptics,
        skin: Skin,
        lens: Lens,
        shape: tuple[int, int],
        scale: PixelScale,
        world: World = AS_BELIEVED,
        print_on: Callable[[Image, Image], Image] | None = None,
    ) -> None:
        """Skin, lens and scale are as believed; `world` says how far off that is.

        Of a printed plate in place of skin, `print_on` gives the light [ny, nx] over that of a blank one, at x, y;
        beside the lesion's place it is blank.
        """
        self.x_mm, self.y_mm = lookup.x_mm[None, :], lookup.y_mm[:, None]
        self._lookup, self._world = lookup, world
        self._projection = Projection(lens, lookup.x_mm, lookup.y_mm, shape, scale, world.camera)
        self._skin = lru_cache(maxsize=8)(lambda share: world.lesion.skin(skin, share))
        self._skin_light = lru_cache(maxsize=8)(self._skin_light_at)
        self._print = print_on(self.x_mm, self.y_mm) if print_on else None

    def intensity(
        self,
        w_mm: Image,
        p_kpa: Image,
        led_ratio: LedRatio,
        *,
        wet_ratio: float = 0.0,
        place: ProbePlacement = CENTRED,
    ) -> Image:
        """Return the radiance on the pixels, in units of `UNIT_RADIANCE`."""
        world, share, touching = self._world, self._world.lesion_share(place), bool(p_kpa.any())
        skin = self._skin(share)
        if wet_ratio:
            skin = replace(skin, wet_ratio=max(skin.wet_ratio, wet_ratio))
        lit = world.light.lit(led_ratio, share)
        radiance = self._lookup.radiance(w_mm, p_kpa, lit, skin, touching, world.contact)
        if touching and self._print is not None and share > 0.5:
            radiance *= self._print
        if touching and world.texture.level_percent:
            radiance *= self._skin_light(place.x_mm, place.y_mm)
        return self._projection(radiance / np.float32(UNIT_RADIANCE))

    def _skin_light_at(self, x_mm: float, y_mm: float) -> Image:
        return self._world.texture.light_ratio(self.x_mm + x_mm, self.y_mm + y_mm)
