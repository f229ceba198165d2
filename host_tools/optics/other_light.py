"""Light that the models of a design do not know: another block, and skin that scatters by another law.

The block's walls give back more than twice as much, its LEDs sit higher and shine more forward, its index is another.
Half of what the skin scatters sideways is spread normally, as by many small steps, instead of exponentially, and half
as much comes back at the face. Rows then differ by some 0.25 % of the light in contrast and 1.6 % in the reference
response, about as much as those of an independent tracer did (tests/host_tools/optics/test_other_light.py).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from device.simulation.physics.light_table import LightTable
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.skin import Skin
from host_tools.optics.build_lookup import make_light_table
from host_tools.scenes.probe_file import simulated_probe

WALL_REFLECTANCE, LED_HEIGHT_MM, LENS_EXPONENT, REFRACTIVE_INDEX = 0.12, 5.15, 1.1, 1.415
NORMAL_PART, RETURNED_PART = 0.5, 0.5


class OtherOptics(LookupOptics):
    """A block's light, scattered by another law than the design's."""

    def _prepare(self, skin: Skin) -> None:
        super()._prepare(skin)
        variance = skin.spread_mm**2 * 2 / math.pi  # of a normal spread of the same mean distance
        normal = skin.albedo * np.exp(-self._square_wavenumber * variance / 2)
        self._spread = np.asarray((1 - NORMAL_PART) * self._spread + NORMAL_PART * normal, np.float32)
        self._again_wet, self._again_dry = (
            np.float32(RETURNED_PART * again) for again in (self._again_wet, self._again_dry)
        )


def other_optics(rays: int = 20_000_000, seed: int = 11) -> OtherOptics:
    """Return the optics of another block, traced with so many rays: ten seconds for the default."""
    return OtherOptics(other_light(rays, seed))


def other_light(rays: int, seed: int) -> LightTable:
    """Return the light of the other block."""
    block = replace(
        simulated_probe().light_block,
        wall_reflectance=WALL_REFLECTANCE,
        led_height_mm=LED_HEIGHT_MM,
        led_lens_exponent=LENS_EXPONENT,
        refractive_index=REFRACTIVE_INDEX,
    )
    return make_light_table(block, rays, seed, lambda step: None)
