"""The camera's frame of a solution: an inclusion beside the axis is seen beside it, one below it as before."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from device.files.shipped import SIMULATED_PROBE
from device.measurement.quantities import Inclusion
from device.simulation.physics.image_formation import ScatteredImage
from device.simulation.physics.lens import Lens
from device.simulation.physics.lookup_optics import LookupOptics
from device.simulation.physics.sensor import Sensor
from device.simulation.physics.skin import Skin
from host_tools.calibration.phantom import CAMERA, LIT
from host_tools.forward.plan import model_plan
from host_tools.forward.solve import solve
from host_tools.optics.frame import simulated_frame
from host_tools.scenes.scene import Placement, Press, Scene

INCLUSION, PRESS = Inclusion(10.0, 6.0, 80.0), Press(force_n=0.4)
BLACK_COUNTS = 4.0


@cache
def frames(placement):
    """The frame of a press and that of the same press without the inclusion, in counts above black."""
    scene = Scene(INCLUSION, PRESS, placement=placement)
    solution = solve(scene, replace(model_plan(scene), grading="coarse", order=2))
    states = (solution.pressed, solution.baseline)
    return [
        simulated_frame(replace(solution, pressed=state), exposure_us=4000.0, seed=1) - BLACK_COUNTS for state in states
    ]


def spot_mm(pressed, baseline):
    """Centroid (x, y) of where the contrast is above half of its largest, inside the central window."""
    x_mm, y_mm = CAMERA.scale.coordinates_mm(pressed.shape)
    contrast = np.where(np.hypot(x_mm, y_mm) < 9.9, pressed / np.maximum(baseline, 10.0) - 1, 0.0)
    spot = np.where(contrast > 0.5 * np.quantile(contrast, 0.999), contrast, 0.0)
    return [float((spot * axis).sum() / spot.sum()) for axis in (x_mm, y_mm)]


@pytest.mark.parametrize("place", [Placement(6.0), Placement(0.0, -6.0)], ids=["right", "above"])
def test_an_inclusion_beside_the_axis_is_bright_there(place):
    """The probe's own light is brighter in the middle and the skin spreads it: the spot lies 5 mm out, not 6."""
    along = spot_mm(*frames(place))
    assert along == pytest.approx([place.offset_x_mm, place.offset_y_mm], abs=1.5)


def test_the_picture_is_lopsided_along_the_offset_and_even_across_it():
    pressed, baseline = frames(Placement(6.0))
    sides, ends = pressed - pressed[:, ::-1], pressed - pressed[::-1]
    assert np.abs(sides).mean() > 3 * np.abs(baseline - baseline[:, ::-1]).mean()
    assert np.abs(ends).mean() < 1.1 * np.abs(baseline - baseline[::-1]).mean()


def test_the_picture_of_an_inclusion_below_the_middle_is_that_of_its_radial_profile():
    """One ray says all: the same counts as when every pixel takes the profile at its own radius."""
    solution = solve(Scene(INCLUSION, PRESS))
    image = ScatteredImage(
        LookupOptics.load(SIMULATED_PROBE), Skin(), Lens(), (CAMERA.height_px, CAMERA.width_px), CAMERA.scale
    )
    r_mm = np.hypot(image.x_mm, image.y_mm)
    w_mm = np.interp(r_mm, solution.r_mm, solution.w_mm).astype(np.float32)
    p_kpa = np.interp(r_mm, solution.r_mm, np.maximum(solution.p_kpa, 0), right=0.0).astype(np.float32)
    expected = Sensor().expose(image.intensity(w_mm, p_kpa, LIT), exposure_us=4000.0, gain=CAMERA.gain, seed=(1, 0))
    np.testing.assert_array_equal(simulated_frame(solution, exposure_us=4000.0, seed=1), expected)
