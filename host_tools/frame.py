"""A solution to one camera frame, through the linear optics and the camera of the virtual probe."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from device.simulation.renderer import LinearOptics
from device.simulation.sensor import Sensor
from host_tools.forward.solve import Solution
from host_tools.phantom import CAMERA, LIT


@dataclass(frozen=True)
class FrameSettings:
    """Optics and camera of a simulated frame."""

    optics: LinearOptics
    sensor: Sensor
    exposure_us: float
    gain: float
    seed: int


def simulated_frame(solution: Solution, settings: FrameSettings) -> NDArray[np.uint8]:
    """Return the 768 x 492 frame (8 bit) of the deformed face under four equal LEDs."""
    shape = CAMERA.height_px, CAMERA.width_px
    x_mm, y_mm = CAMERA.scale.coordinates_mm(shape)
    w_mm = np.interp(np.hypot(x_mm, y_mm), solution.r_mm, solution.w_mm).astype(np.float32)
    intensity = settings.optics.intensity(settings.optics.led_fields(shape, CAMERA.scale), LIT, w_mm)
    exposure = {"exposure_us": settings.exposure_us, "gain": settings.gain, "seed": (settings.seed, 0)}
    return settings.sensor.expose(intensity, **exposure)  # type: ignore[arg-type]
