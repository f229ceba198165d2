"""The touched skin as light meets it: how much is in optical contact, what comes back, how far it spreads.

Contact pressure, not deformation, makes the image: dry, rough skin wets the face in ever more places the harder it is
pressed, phi = largest (1 - exp(-p / p0)), a law that is assumed here and must be calibrated on a real probe; another
probe may have another exponent or form. Sweat or gel couples light at any pressure and takes the contrast away. Source:
the exponential approach of rough contact to full area, Persson, J. Chem. Phys. 115, 3840 (2001); frustrated total
reflection, Han, UIST 2005.

A texture is a sum of random waves whose wave numbers are normal: it has a squared exponential correlation, everywhere
and without end, and the field of any place follows from the seed alone. Source: Rahimi & Recht, Random Features for
Large-Scale Kernel Machines, NIPS 2007.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Single
from device.measurement.quantities import Bound, InvalidQuantity, require

ACTION = "give the optics of a skin"
TEXTURE_ACTION, WAVES = "name the texture that a skin may have", 512
LAWS = ("exponential", "langmuir")
LANGMUIR_SCALE = 1 / (math.e - 1)
"""Langmuir's x / (x + this) is at p0 what 1 - exp(-x) is."""


@dataclass(frozen=True)
class ContactLaw:
    """How contact grows with x = (p / p0)^exponent: "exponential", 1 - exp(-x), or "langmuir", x / (x + 0.582).

    Both are the same at p0. `largest_ratio` is of the skin's own largest contact.
    """

    form: str = "exponential"
    exponent: float = 1.0
    largest_ratio: float = 1.0

    def __post_init__(self) -> None:
        if self.form not in LAWS:
            raise InvalidQuantity("world.contact.form", repr(self.form), " or ".join(LAWS), "choose one of them")
        require("world.contact.exponent", self.exponent, Bound(0.5, 2.0, ""), "name an exponent that a skin may have")
        bound = Bound(0.0, 1.0, "", low_included=False)
        require("world.contact.largest_ratio", self.largest_ratio, bound, "give a share of the skin's largest contact")

    def share(self, pressure: NDArray[np.float32], contact_pressure_kpa: float) -> NDArray[np.float32]:
        """Return the share of the largest contact, of the shape of the pressure (kPa, >= 0)."""
        if self.exponent == 1.0 and self.form == "exponential":
            return np.asarray(1 - np.exp(pressure * np.float32(-1 / contact_pressure_kpa)))
        x = (pressure * np.float32(1 / contact_pressure_kpa)) ** np.float32(self.exponent)
        return np.asarray(x / (x + np.float32(LANGMUIR_SCALE)) if self.form == "langmuir" else 1 - np.exp(-x))


AS_ASSUMED = ContactLaw()


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

    def contact_ratio(self, p_kpa: NDArray[np.floating], law: ContactLaw = AS_ASSUMED) -> NDArray[np.float32]:
        """Return the share of each place in optical contact, 0..1, of the shape of the contact pressure (kPa, >= 0).

        Where there is any pressure, sweat or gel raise it to phi + wet (1 - phi); in the air it is 0.
        Raises `InvalidQuantity` for a pressure that is negative or no number.
        """
        lowest = float(np.min(p_kpa, initial=0.0))
        if not lowest >= 0.0:
            raise InvalidQuantity("p_kpa", lowest, "at least 0 kPa", "clip adhesion: the law knows pressure only")
        pressure = np.asarray(p_kpa, dtype=np.float32)
        largest = np.float32(self.largest_contact_ratio * law.largest_ratio)
        dry = largest * law.share(pressure, self.contact_pressure_kpa)
        if self.wet_ratio == 0.0:
            return np.asarray(dry, dtype=np.float32)
        touched = np.float32(self.wet_ratio) * (pressure > 0)
        return np.asarray(dry + touched * (1 - dry), dtype=np.float32)


@dataclass(frozen=True)
class SkinTexture:
    """Standard deviation of the light from place to place, and the length over which it is alike.

    The correlation at a distance d is exp(-d^2 / (2 length^2)).
    """

    level_percent: float = 0.0
    length_mm: float = 2.0
    seed: int = 1

    def __post_init__(self) -> None:
        require("world.texture.level_percent", self.level_percent, Bound(0.0, 10.0, "%"), TEXTURE_ACTION)
        require("world.texture.length_mm", self.length_mm, Bound(0.5, 50.0, "mm"), TEXTURE_ACTION)
        require("world.texture.seed", self.seed, Bound(0, 2**63, ""), "give a whole number from 0")

    def light_ratio(self, x_mm: Single, y_mm: Single) -> Single:
        """Return the factor [ny, nx] of the light at x_mm [1, nx], y_mm [ny, 1] of the skin; never negative."""
        rng = np.random.default_rng(self.seed)
        k_x, k_y = rng.standard_normal((2, WAVES, 1)) / self.length_mm
        along_x = np.exp(1j * (k_x @ np.asarray(x_mm, np.float64) + rng.uniform(0, 2 * math.pi, (WAVES, 1))))
        along_y = np.exp(1j * np.asarray(y_mm, np.float64) @ k_y.T)
        field = (along_y @ along_x).real * math.sqrt(2 / WAVES)
        return np.asarray(np.maximum(1 + self.level_percent / 100 * field, 0), np.float32)
