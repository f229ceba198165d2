"""A solution to one camera frame, through the light, lens and camera of the virtual probe."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np

from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.tactile_image import Counts
from device.simulation.physics.image_formation import ScatteredImage
from device.simulation.physics.lens import Lens
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.skin import Skin
from host_tools.calibration.phantom import LIT, camera_settings
from host_tools.forward.face_points import FacePoints
from host_tools.forward.solution import Solution
from host_tools.scenes.probe import Probe
from host_tools.scenes.probe_file import simulated_probe


def simulated_frame(
    solution: Solution, *, exposure_us: float, seed: int, probe: Probe | None = None, light: Path = SIMULATED_PROBE
) -> Counts:
    """Return a probe's frame (8 bit) of the pressed face under four equal LEDs, with default skin and sensor.

    Of the whole face, so an inclusion beside the axis is seen beside it: +x is to the right, +y down. The probe is the
    simulated one unless given; axis, distortion and imbalance of its file are left out. Raises `InvalidQuantity` when
    the table in the folder `light` is of another block.
    """
    probe = probe or simulated_probe()
    camera, optics = camera_settings(probe), LookupOptics.load(light)
    _require_own_light(probe, optics)
    lens = Lens(blur_px=probe.camera.blur_px, distance_mm=probe.camera.lens_distance_mm)
    image = ScatteredImage(optics, Skin(), lens, (camera.height_px, camera.width_px), camera.scale)
    at_pixels = FacePoints(solution.rays, image.x_mm, image.y_mm)
    w_mm = at_pixels(solution.pressed.w_mm).astype(np.float32)
    p_kpa = (at_pixels(np.maximum(solution.pressed.p_kpa, 0)) * at_pixels.is_inside).astype(np.float32)
    intensity = image.intensity(w_mm, np.maximum(p_kpa, 0), LIT)  # a spline may dip below 0
    return Sensor().expose(intensity, exposure_us=exposure_us, gain=camera.gain, seed=(seed, 0))


def _require_own_light(probe: Probe, optics: LookupOptics) -> None:
    for name, built in asdict(probe.light_block).items():
        if optics.block[name] != built:
            action = "build this probe's with `host_tools optics build --probe`, and name its folder with --light"
            raise InvalidQuantity(f"light table's {name}", optics.block[name], f"{built} as of {probe.serial}", action)
