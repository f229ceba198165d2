"""An inclusion to the image features that a perfect camera would see: no noise, no rounding, force held exactly.

The light is the virtual probe's own, so that what differs from `phantom_recording` is the camera and the hand alone.
Source: Lee & Won, IEEE JBHI 17(2), 2013: "We assume that there is no noise in the tactile data."
"""

from __future__ import annotations

import numpy as np

from device.measurement.features import FeatureSettings, extract_features
from device.measurement.quantities import Inclusion
from device.measurement.tactile_image import FLOOR_COUNTS, Image, TactileImage
from device.simulation.image_formation import ImageFormation, LinearImage, ScatteredImage
from device.simulation.pressed_face import Placement, PressedFace
from device.simulation.scenario import Scenario
from device.simulation.virtual_probe import ProbeTables
from host_tools.inverse.network import Array
from host_tools.phantom import CAMERA, LIT, TARGET_N

CENTRED = Placement()
FULL_SCALE_COUNTS = 255
LUMP_FREE = Inclusion(0.0, 8.0, 80.0)
"""Without size, depth and modulus only have to be in the table."""


class PerfectCamera:
    """Sees the virtual probe's face as it is; `scenario` says by which light."""

    def __init__(self, scenario: Scenario, tables: ProbeTables) -> None:
        self._tables, self._formation = tables, _formation(scenario, tables)
        self._reference = self._intensity(LUMP_FREE)
        sensor = scenario.sensor
        counts_per_intensity = sensor.sensitivity_e_per_us * CAMERA.exposure_us * FULL_SCALE_COUNTS / sensor.full_well_e
        self._valid = self._reference * counts_per_intensity >= FLOOR_COUNTS

    def features(self, inclusion: Inclusion, settings: FeatureSettings) -> Array:
        """Return the image features [3] of a press with `TARGET_N`, against the lump-free press of the same force.

        Raises `InvalidQuantity` when the probe's table does not hold the inclusion.
        """
        reference = np.where(self._valid, self._reference, np.float32(1.0))
        contrast = np.where(self._valid, self._intensity(inclusion) / reference - 1, np.float32(0.0))
        return extract_features(TactileImage(contrast, self._valid, CAMERA.scale, TARGET_N), settings).as_row()

    def _intensity(self, inclusion: Inclusion) -> Image:
        ramps, light = self._tables.centred.ramps(inclusion), self._formation
        face = PressedFace(ramps, self._tables.off_axis, inclusion, light.x_mm, light.y_mm)
        return light.intensity(*face.at(TARGET_N, CENTRED), LIT)


def _formation(scenario: Scenario, tables: ProbeTables) -> ImageFormation:
    shape = CAMERA.height_px, CAMERA.width_px
    if scenario.light == "linear":
        return LinearImage(scenario.optics, shape, CAMERA.scale)
    return ScatteredImage(tables.light, scenario.skin, scenario.lens, shape, CAMERA.scale)
