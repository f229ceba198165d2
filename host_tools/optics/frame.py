"""A solution to one camera frame, through the light, lens and camera of the virtual probe."""

from __future__ import annotations

import numpy as np

from device.files.shipped import SIMULATED_PROBE
from device.measurement.recording.tactile_image import Counts
from device.simulation.physics.image_formation import ScatteredImage
from device.simulation.physics.lens import Lens
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.skin import Skin
from host_tools.calibration.phantom import CAMERA, LIT
from host_tools.forward.face_points import FacePoints
from host_tools.forward.solution import Solution


def simulated_frame(solution: Solution, *, exposure_us: float, seed: int) -> Counts:
    """Return the 768 x 492 frame (8 bit) of the pressed face under four equal LEDs, default skin, lens and sensor.

    Of the whole face, so an inclusion beside the axis is seen beside it: +x is to the right, +y down.
    """
    shape = CAMERA.height_px, CAMERA.width_px
    image = ScatteredImage(LookupOptics.load(SIMULATED_PROBE), Skin(), Lens(), shape, CAMERA.scale)
    at_pixels = FacePoints(solution.rays, image.x_mm, image.y_mm)
    w_mm = at_pixels(solution.pressed.w_mm).astype(np.float32)
    p_kpa = (at_pixels(np.maximum(solution.pressed.p_kpa, 0)) * at_pixels.is_inside).astype(np.float32)
    intensity = image.intensity(w_mm, np.maximum(p_kpa, 0), LIT)  # a spline may dip below 0
    return Sensor().expose(intensity, exposure_us=exposure_us, gain=CAMERA.gain, seed=(seed, 0))
