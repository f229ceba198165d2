"""A solution to one camera frame, through the light, lens and camera of the virtual probe."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from device.measurement.recording.tactile_image import Counts
from device.simulation.physics.image_formation import ScatteredImage
from device.simulation.physics.lens import Lens
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.skin import Skin
from host_tools.calibration.phantom import CAMERA, LIT
from host_tools.forward.solution import Solution

TABLES = Path(__file__).resolve().parents[2] / "models" / "simulated_probe"


def simulated_frame(solution: Solution, *, exposure_us: float, seed: int) -> Counts:
    """Return the 768 x 492 frame (8 bit) of the pressed face under four equal LEDs, default skin, lens and sensor."""
    shape = CAMERA.height_px, CAMERA.width_px
    image = ScatteredImage(LookupOptics.load(TABLES), Skin(), Lens(), shape, CAMERA.scale)
    r_mm = np.hypot(image.x_mm, image.y_mm)
    w_mm = np.interp(r_mm, solution.r_mm, solution.w_mm).astype(np.float32)
    p_kpa = np.interp(r_mm, solution.r_mm, np.maximum(solution.p_kpa, 0), right=0.0).astype(np.float32)
    intensity = image.intensity(w_mm, p_kpa, LIT)
    return Sensor().expose(intensity, exposure_us=exposure_us, gain=CAMERA.gain, seed=(seed, 0))
