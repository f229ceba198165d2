"""The optics that are fixed when a probe is built: block, LEDs, walls, glass and camera.

Four LEDs stand in the middle of the four side walls (+x, +y, -x, -y). "air" puts each behind its flat window, so that
refraction confines its light to the block; "embedded" casts it into the block, and its light leaks. The skin is not
part of it: see `device.simulation.physics.skin`. Coordinates: z = 0 at the glass, z = thickness_mm at the undeformed
face.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from device.measurement.quantities import Bound, InvalidQuantity, require

ACTION = "give the optics of a block that can be built"
POSITIVE = Bound(0.0, 1e3, "mm", low_included=False)
SIDES = ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))
"""Outward normals of the walls that carry the LEDs, in the order of every `led_ratio`."""


@dataclass(frozen=True)
class LightBlock:
    """A square block on a glass plate, lit from its four side walls and seen from below.

    `led_lens_exponent` m: an LED radiates as cos(angle)^m, 1 is Lambertian. `wall_reflectance` is diffuse.
    `haze_per_mm` is the isotropic scattering coefficient of the block.
    Raises `InvalidQuantity` for a value that no block can have.
    """

    half_width_mm: float = 12.0
    thickness_mm: float = 10.0
    refractive_index: float = 1.41
    led_height_mm: float = 5.0
    led_radius_mm: float = 0.75
    led_coupling: Literal["air", "embedded"] = "air"
    led_lens_exponent: float = 1.0
    wall_reflectance: float = 0.05
    haze_per_mm: float = 0.0
    glass_refractive_index: float = 1.52
    glass_thickness_mm: float = 1.0
    aperture_radius_mm: float = 2.0
    camera_distance_mm: float = 20.0

    def __post_init__(self) -> None:
        for name in ("half_width_mm", "thickness_mm", "led_radius_mm", "aperture_radius_mm", "camera_distance_mm"):
            require(name, getattr(self, name), POSITIVE, ACTION)
        for name in ("refractive_index", "glass_refractive_index"):
            require(name, getattr(self, name), Bound(1.0, 4.0, ""), ACTION)
        require("glass_thickness_mm", self.glass_thickness_mm, Bound(0.0, 1e3, "mm"), ACTION)
        require("wall_reflectance", self.wall_reflectance, Bound(0.0, 1.0, ""), ACTION)
        require("haze_per_mm", self.haze_per_mm, Bound(0.0, 10.0, "1/mm"), ACTION)
        require("led_lens_exponent", self.led_lens_exponent, Bound(1.0, 1e3, ""), ACTION)
        if self.led_coupling not in ("air", "embedded"):
            raise InvalidQuantity("led_coupling", repr(self.led_coupling), "'air' or 'embedded'", ACTION)
        self._require_places()

    def _require_places(self) -> None:
        lowest, highest = self.led_radius_mm, self.thickness_mm - self.led_radius_mm
        place = "keep the whole LED on its wall"
        require("led_radius_mm", self.led_radius_mm, Bound(0.0, min(self.half_width_mm, highest), "mm"), place)
        require("led_height_mm", self.led_height_mm, Bound(lowest, highest, "mm"), place)
        lens = Bound(0.0, self.half_width_mm, "mm", high_included=False)
        require("aperture_radius_mm", self.aperture_radius_mm, lens, "keep the LEDs' walls outside the camera's lens")
        beyond = Bound(self.glass_thickness_mm, 1e3, "mm", low_included=False)
        require("camera_distance_mm", self.camera_distance_mm, beyond, "place the camera below the glass")
