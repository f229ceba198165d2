"""One scene drives light, image and force together: what the emulated chips ask when they are asked.

The camera's frame shows the surface under the force that the load cell reports at that time, lit as the LED chip's
registers say. A lump off the axis is the centred one's field moved, good for a small offset and for "far beside".
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.measurement.tactile_image import Image, LedRatio, PixelScale
from device.simulation.hand import VirtualHand
from device.simulation.scenario import Scenario
from device.simulation.surface_table import SurfaceTable

WET_FACE_MM = 0.3
"""A wet face looks as if it were pressed in this far everywhere, however hard it is pressed."""


class VirtualProbe:
    """The physics below the chips: hand to force, force and lump to surface, surface and LEDs to counts."""

    def __init__(self, scenario: Scenario, table: SurfaceTable, shape: tuple[int, int], scale: PixelScale) -> None:
        """Prepare for frames of [height, width]; raise `InvalidQuantity` when the table does not hold the inclusion."""
        self.scenario, self.hand = scenario, VirtualHand(scenario.hand)
        self._table, self._lump_mm_per_n = table, table.lump(scenario.inclusion)
        self._x_mm, self._y_mm = scale.coordinates_mm(shape)
        self._led_fields = scenario.optics.led_fields(shape, scale)
        self._surfaces: dict[tuple[float, float], Image] = {}

    def cell_counts(self, t_s: float) -> float:
        """Return the noise-free load-cell counts at a time."""
        cell = self.scenario.cell
        return cell.zero_counts + cell.counts_per_n * self.hand.force_n(t_s)

    def surface_mm_per_n(self, position_mm: tuple[float, float]) -> Image:
        """Return the surface deformation for 1 N [height, width] with the probe at a position."""
        if position_mm not in self._surfaces:
            from_axis = np.hypot(self._x_mm, self._y_mm)
            from_lump = np.hypot(self._x_mm + position_mm[0], self._y_mm + position_mm[1])
            r_mm = self._table.r_mm
            surface = np.interp(from_axis, r_mm, self._table.w_mm_per_n)
            surface += np.interp(from_lump, r_mm, self._lump_mm_per_n, right=0.0)
            self._surfaces[position_mm] = surface.astype(np.float32)
        return self._surfaces[position_mm]

    def frame_counts(
        self,
        *,
        force_n: float,
        position_mm: tuple[float, float],
        led_ratio: LedRatio,
        exposure_us: float,
        gain: float,
        frame_number: int,
        wet_ratio: float = 0.0,
        ambient_ratio: float = 0.0,
    ) -> NDArray[np.uint8]:
        """Return the counts of one exposure; a wet face shows full contact, foreign light falls on every pixel."""
        w_mm = np.float32(force_n) * self.surface_mm_per_n(position_mm)
        w_mm += np.float32(wet_ratio) * (np.float32(WET_FACE_MM) - w_mm)
        intensity = self.scenario.optics.intensity(self._led_fields, led_ratio, w_mm) + np.float32(ambient_ratio)
        seed = self.scenario.seed, frame_number
        return self.scenario.sensor.expose(intensity, exposure_us=exposure_us, gain=gain, seed=seed)
