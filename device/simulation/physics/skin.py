"""The touched skin as light meets it: how much is in optical contact, what comes back, how far it spreads.

Contact pressure, not deformation, makes the image: dry, rough skin wets the face in ever more places the harder it is
pressed, phi = largest (1 - exp(-p / p0)), a law that is assumed here and must be calibrated on a real probe. Sweat or
gel couples light at any pressure and takes the contrast away. Source: the exponential approach of rough contact to
full area, Persson, J. Chem. Phys. 115, 3840 (2001); frustrated total reflection, Han, UIST 2005.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.quantities import Bound, InvalidQuantity, require

ACTION = "give the optics of a skin"


@dataclass(frozen=True)
class Skin:
    """Optical properties of the touched skin; ratios are 0..1.

    `albedo`: share of the light that enters the skin and comes back. `spread_mm`: mean distance sideways between
    entry and return. `contact_pressure_kpa`: p0 of the contact law. `wet_ratio`: share of the face coupled by gel or
    sweat whatever the pressure. Raises `InvalidQuantity` for a value that no skin can have.
    """

    refractive_index: float = 1.38
    albedo: float = 0.5
    spread_mm: float = 1.0
    contact_pressure_kpa: float = 2.0
    largest_contact_ratio: float = 1.0
    wet_ratio: float = 0.0

    def __post_init__(self) -> None:
        require("skin.refractive_index", self.refractive_index, Bound(1.0, 2.0, ""), ACTION)
        require("skin.spread_mm", self.spread_mm, Bound(0.0, 20.0, "mm"), ACTION)
        above_zero = Bound(0.0, 1e4, "kPa", low_included=False)
        require("skin.contact_pressure_kpa", self.contact_pressure_kpa, above_zero, ACTION)
        for name in ("albedo", "largest_contact_ratio", "wet_ratio"):
            require(f"skin.{name}", getattr(self, name), Bound(0.0, 1.0, ""), ACTION)

    def contact_ratio(self, p_kpa: NDArray[np.floating]) -> NDArray[np.float32]:
        """Return the share of each place in optical contact, 0..1, of the shape of the contact pressure (kPa, >= 0).

        Where there is any pressure, sweat or gel raise it to phi + wet (1 - phi); in the air it is 0.
        Raises `InvalidQuantity` for a pressure that is negative or no number.
        """
        lowest = float(np.min(p_kpa, initial=0.0))
        if not lowest >= 0.0:
            raise InvalidQuantity("p_kpa", lowest, "at least 0 kPa", "clip adhesion: the law knows pressure only")
        pressure = np.asarray(p_kpa, dtype=np.float32)
        dry = np.float32(self.largest_contact_ratio) * (
            1 - np.exp(pressure * np.float32(-1 / self.contact_pressure_kpa))
        )
        if self.wet_ratio == 0.0:
            return np.asarray(dry, dtype=np.float32)
        touched = np.float32(self.wet_ratio) * (pressure > 0)
        return np.asarray(dry + touched * (1 - dry), dtype=np.float32)
