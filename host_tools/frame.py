"""A solution to one camera frame, through the linear optics and the camera of the virtual probe."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from device.simulation.renderer import LinearOptics
from device.simulation.sensor import Sensor
from host_tools.forward.solution import Solution
from host_tools.phantom import CAMERA, LIT


def simulated_frame(solution: Solution, *, exposure_us: float, seed: int) -> NDArray[np.uint8]:
    """Return the 768 x 492 frame (8 bit) of the deformed face under four equal LEDs, default optics and sensor."""
    optics, shape = LinearOptics(), (CAMERA.height_px, CAMERA.width_px)
    x_mm, y_mm = CAMERA.scale.coordinates_mm(shape)
    w_mm = np.interp(np.hypot(x_mm, y_mm), solution.r_mm, solution.w_mm).astype(np.float32)
    intensity = optics.intensity(optics.led_fields(shape, CAMERA.scale), LIT, w_mm)
    return Sensor().expose(intensity, exposure_us=exposure_us, gain=CAMERA.gain, seed=(seed, 0))
