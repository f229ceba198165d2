"""A plate printed with a grid of dots, in a cap round the face: what a camera's pixels are measured by.

It lies flat in a film of oil, so that light passes everywhere alike and the face is not deformed. The dots stand on a
square grid about the cap's middle; the one in the middle is larger. Print and film blur their edges. Pressed beside the
lesion's place the plate is blank: the flat field.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from device.measurement.quantities import Bound, InvalidQuantity, require
from device.measurement.recording.tactile_image import Image
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.physics.skin import Skin

ACTION = "name a grid that can be printed"
EDGE_MM = 0.08
"""Over so much a dot's edge falls: its slope is that of a blur of 0.15 mm."""
OIL_KPA = 1.0
"""Pressure of the film of oil; anything above 0 couples light."""


@dataclass(frozen=True)
class GridTarget:
    """Dots of `dot_mm` every `pitch_mm`, that in the middle of `middle_dot_mm`, which give back `ink_ratio` of the
    plate's light: at 1 it is blank. The grid's middle is at x, y of the face, turned by `turn_deg`: a cap has play.
    """

    pitch_mm: float = 2.0
    dot_mm: float = 0.8
    middle_dot_mm: float = 1.2
    ink_ratio: float = 0.3
    x_mm: float = 0.0
    y_mm: float = 0.0
    turn_deg: float = 0.0
    PLATE: ClassVar[Skin] = Skin(refractive_index=1.42, albedo=0.4, spread_mm=0.5, wet_ratio=1.0)
    """White film in oil."""

    def __post_init__(self) -> None:
        require("grid.pitch_mm", self.pitch_mm, Bound(0.5, 5.0, "mm"), ACTION)
        require("grid.dot_mm", self.dot_mm, Bound(0.2, 0.5 * self.pitch_mm, "mm, half the pitch"), ACTION)
        bound = Bound(self.dot_mm, 0.75 * self.pitch_mm, "mm, three quarters of the pitch")
        require("grid.middle_dot_mm", self.middle_dot_mm, bound, ACTION)
        require("grid.ink_ratio", self.ink_ratio, Bound(0.0, 1.0, ""), ACTION)
        for name in ("x_mm", "y_mm"):
            require(f"grid.{name}", getattr(self, name), Bound(-5.0, 5.0, "mm"), ACTION)
        if not math.isfinite(self.turn_deg):
            raise InvalidQuantity("grid.turn_deg", self.turn_deg, "finite", ACTION)

    def light_ratio(self, x_mm: Image, y_mm: Image) -> Image:
        """Return the plate's light [ny, nx] over that of its blank film, at x_mm [1, nx], y_mm [ny, 1] of the face."""
        turn = math.radians(self.turn_deg)
        x, y = x_mm - self.x_mm, y_mm - self.y_mm
        along, across = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
        column, row = np.rint(along / self.pitch_mm), np.rint(across / self.pitch_mm)
        from_dot_mm = np.hypot(along - column * self.pitch_mm, across - row * self.pitch_mm)
        radius_mm = np.where((column == 0) & (row == 0), self.middle_dot_mm, self.dot_mm) / 2
        inked = 0.5 - 0.5 * np.tanh((from_dot_mm - radius_mm) / (2 * EDGE_MM))
        return np.asarray(1 - (1 - self.ink_ratio) * inked, np.float32)


class CappedFace:
    """The face below the plate at x_mm [1, nx], y_mm [ny, 1]: flat, and coupled everywhere once the cap is on it."""

    def __init__(self, radius_mm: float, x_mm: Image, y_mm: Image) -> None:
        self._pressed_kpa = np.asarray(OIL_KPA * (np.hypot(x_mm, y_mm) <= radius_mm), np.float32)
        self._flat_mm = np.zeros_like(self._pressed_kpa)

    def at(self, force_n: float, place: ProbePlacement, pressed_s: float | None = None) -> tuple[Image, Image]:
        """Return w_mm and p_kpa [ny, nx], as a pressed face does; without a force the cap is off."""
        return self._flat_mm, self._pressed_kpa if force_n > 0 else self._flat_mm
