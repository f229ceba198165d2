"""Force, position and tilt to the deformation and pressure of the whole face, on one grid of points.

An inclusion off the axis is solved in small strain, and changes with the force as the centred one does; moving the
centred field instead would be wrong: a probe that cannot turn answers with a moment. A tilt adds its own fields; where
the pressure would pull the face has lifted, and the rest carries the force. What each costs in accuracy:
docs/simulated_probe.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from device.measurement.arrays import Array
from device.measurement.quantities import Inclusion
from device.measurement.recording.tactile_image import Image
from device.simulation.physics.off_axis_table import OffAxisTable
from device.simulation.physics.slab import NOMINAL, Slab
from device.simulation.physics.surface_table import Face, PressRamps

BEYOND_RIM_MM = 0.5
"""Length over which the deformation of the rim fades outside the face; there is no pressure there."""


@dataclass(frozen=True)
class ProbePlacement:
    """Where the probe stands relative to the lesion (mm), and how far it leans to +x and +y (degrees)."""

    x_mm: float = 0.0
    y_mm: float = 0.0
    tilt_x_deg: float = 0.0
    tilt_y_deg: float = 0.0


class PressedFace:
    """Fields of one inclusion at the points x_mm [1, nx], y_mm [ny, 1]."""

    def __init__(
        self,
        ramps: PressRamps,
        off_axis: OffAxisTable,
        inclusion: Inclusion,
        x_mm: Image,
        y_mm: Image,
        slab: Slab = NOMINAL,
    ) -> None:
        """Pressing far off the axis later raises `InvalidQuantity` for an inclusion that the table does not hold."""
        self._ramps, self._off_axis, self._inclusion, self._slab = ramps, off_axis, inclusion, slab
        self._x_mm, self._y_mm = np.broadcast_arrays(x_mm, y_mm)
        from_axis_mm = np.hypot(self._x_mm, self._y_mm)
        self._from_axis = RadialProfiles(ramps.r_mm, from_axis_mm)
        self._solid = RadialProfiles(off_axis.r_mm, from_axis_mm)
        self._tilt = [self._tilt_field(axis, from_axis_mm, off_axis.tilt_in(slab)) for axis in (self._x_mm, self._y_mm)]
        self._aside = lru_cache(maxsize=8)(self._aside_per_n)

    def at(self, force_n: float, place: ProbePlacement) -> tuple[Image, Image]:
        """Return w_mm and p_kpa [ny, nx]; the pressure is never negative and carries the force."""
        if force_n <= 0:
            return np.zeros(self._x_mm.shape, np.float32), np.zeros(self._x_mm.shape, np.float32)
        baseline, inclusion_field = self._ramps.baseline.at(force_n), self._ramps.inclusion_field.at(force_n)
        share = self._off_axis.centred_share(float(np.hypot(place.x_mm, place.y_mm)))
        w_mm, p_kpa = (self._from_axis(b + share * extra) for b, extra in zip(baseline, inclusion_field, strict=True))
        if share < 1:
            grown_w, grown_p = (np.float32(force_n * growth) for growth in self._growth(inclusion_field, force_n))
            further_w, further_p = self._aside(place.x_mm, place.y_mm)
            w_mm, p_kpa = w_mm + grown_w * further_w, p_kpa + grown_p * further_p
        return self._tilted(w_mm, p_kpa, place)

    def _growth(self, inclusion_field: Face, force_n: float) -> list[float]:
        """Return how much larger the centred inclusion's w and p are than in small strain, as the table has it.

        By the root mean square over the face: peaks jump from radius to radius, and the image would with them.
        """
        small = (self._ramps.tabulated_inclusion_field or self._ramps.inclusion_field).at_small_strain(force_n)
        squares = [
            (self._ramps.r_mm @ now**2, self._ramps.r_mm @ before**2)
            for now, before in zip(inclusion_field, small, strict=True)
        ]
        return [math.sqrt(now / before) if before > 0 else 1.0 for now, before in squares]

    def _aside_per_n(self, x_mm: float, y_mm: float) -> list[Image]:
        """Return w and p for 1 N of an inclusion at -(x, y) from the axis, but for the centred inclusion's share."""
        modes = self._off_axis.modes(self._inclusion, float(np.hypot(x_mm, y_mm)), self._slab)
        angle = np.arctan2(self._y_mm, self._x_mm) - np.arctan2(-y_mm, -x_mm)
        cosines = [np.cos(k * angle) for k in range(len(modes[0]))]
        return [
            np.asarray(sum(self._solid(mode) * cosine for mode, cosine in zip(field, cosines, strict=True)), np.float32)
            for field in modes
        ]

    def _tilt_field(
        self, along_mm: NDArray[np.floating], from_axis_mm: NDArray[np.floating], tilt_per_deg: Array
    ) -> list[Image]:
        cosine = np.divide(along_mm, from_axis_mm, out=np.zeros_like(from_axis_mm), where=from_axis_mm > 0)
        return [np.asarray(self._solid(field) * cosine, np.float32) for field in tilt_per_deg]

    def _tilted(self, w_mm: Image, p_kpa: Image, place: ProbePlacement) -> tuple[Image, Image]:
        for degrees, field in zip((place.tilt_x_deg, place.tilt_y_deg), self._tilt, strict=True):
            if degrees:
                w_mm, p_kpa = w_mm + np.float32(degrees) * field[0], p_kpa + np.float32(degrees) * field[1]
        inside = self._from_axis.inside
        carried = float((p_kpa * inside).sum())
        p_kpa = np.maximum(p_kpa, 0) * inside
        pressed = float(p_kpa.sum())
        return w_mm, p_kpa * np.float32(carried / pressed) if pressed > 0 else p_kpa


class RadialProfiles:
    """Linear interpolation of radial profiles at the points of a grid, prepared once."""

    def __init__(self, r_mm: NDArray[np.float64], at_mm: NDArray[np.floating]) -> None:
        place = np.clip(at_mm / (r_mm[1] - r_mm[0]), 0, len(r_mm) - 1)
        self._low = np.minimum(place.astype(np.int32), len(r_mm) - 2)
        self._share = np.asarray(place - self._low, np.float32)
        beyond_mm = np.maximum(at_mm - r_mm[-1], 0)
        self.inside = np.asarray(at_mm <= r_mm[-1], np.float32)
        self._fade = np.asarray(np.exp(-beyond_mm / BEYOND_RIM_MM), np.float32)

    def __call__(self, profile: NDArray[np.float64]) -> Image:
        """Return the profile [R] at the points [ny, nx]; beyond the rim it fades."""
        values = np.asarray(profile, np.float32)
        steps = np.diff(values)
        return np.asarray((values[self._low] + self._share * steps[self._low]) * self._fade)
