"""A camera's geometry against its own formula, and images against what the simulator's camera makes of them."""

from dataclasses import fields

import numpy as np
import pytest

from device.config import CameraSection
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.camera_geometry import AXIS, RIM_DISTORTION, RIM_MM, CameraGeometry, face_map
from device.measurement.recording.pixel_scale import PixelScale
from device.settings.catalogue import SETTINGS
from device.simulation.physics.lens import Lens, Projection, TrueCamera

SCALE, SHAPE = PixelScale(0.125, 0.11), (160, 190)


@pytest.mark.parametrize("percent", [-10.0, -2.0, 0.0, 2.0, 10.0])
def test_image_to_face_and_back_is_where_one_began(percent):
    geometry = CameraGeometry(SCALE, 0.7, -0.4, percent)
    x_mm, y_mm = np.meshgrid(np.linspace(-12, 12, 25), np.linspace(-9, 9, 19))
    np.testing.assert_allclose(geometry.image_mm(*geometry.face_mm(x_mm, y_mm)), (x_mm, y_mm), atol=1e-9)


def test_the_rim_is_seen_farther_out_by_the_distortion_and_aside_by_the_axis():
    x_mm, y_mm = CameraGeometry(SCALE, 0.5, -0.2, 2.0).face_mm(np.array(RIM_MM), np.array(0.0))
    assert (float(x_mm), float(y_mm)) == pytest.approx((1.02 * RIM_MM + 0.5, -0.2))


def test_a_place_that_no_pixel_shows_has_none():
    """At -10 % the image folds back: nothing beyond 13.4 mm from the axis is in it."""
    x_mm, _ = CameraGeometry(SCALE, rim_distortion_percent=-10.0).image_mm(np.array([13.0, 14.0]), np.zeros(2))
    assert np.isfinite(x_mm).tolist() == [True, False]


def test_an_ideal_camera_costs_nothing():
    assert face_map(CameraGeometry(SCALE), SHAPE, SCALE) is None


def test_what_the_simulators_camera_does_is_undone():
    """A bump as wide as an inclusion's, through the lens of a camera of any geometry and through an ideal one."""
    grid_mm, blur = np.linspace(-14, 14, 449), Lens(blur_px=0.5, vignetting=False)
    bump = np.exp(-((grid_mm - 3) ** 2 + (grid_mm[:, None] + 2) ** 2) / 8)
    camera = TrueCamera(1.01, 0.98, 0.4, -0.3, rim_distortion_percent=3.0)
    true_scale = PixelScale(1.01 * SCALE.mm_per_px_x, 0.98 * SCALE.mm_per_px_y)
    seen = Projection(blur, grid_mm, grid_mm, SHAPE, SCALE, camera)(bump)
    ideal = Projection(blur, grid_mm, grid_mm, SHAPE, true_scale)(bump)
    undo = face_map(CameraGeometry(true_scale, 0.4, -0.3, 3.0), SHAPE, true_scale)
    assert np.abs(seen - ideal).max() > 0.1
    assert np.abs(undo(seen) - ideal)[undo.seen].max() < 2e-3
    assert undo.seen.mean() > 0.9


def test_what_lies_beside_the_image_is_not_seen():
    undo = face_map(CameraGeometry(SCALE, axis_x_mm=1.0), SHAPE, SCALE)
    np.testing.assert_array_equal(undo.seen[80], np.arange(190) >= 8)


@pytest.mark.parametrize(
    ("name", "value"), [("axis_x_mm", 2.1), ("axis_y_mm", float("nan")), ("rim_distortion_percent", -11.0)]
)
def test_a_geometry_that_no_camera_has_is_refused(name, value):
    with pytest.raises(InvalidQuantity, match=f"camera.{name}"):
        CameraGeometry(SCALE, **{name: value})


def test_the_settings_have_the_same_keys_and_bounds():
    names = [field.name for field in fields(CameraGeometry)][1:]
    bounds = dict(zip(names, (AXIS, AXIS, RIM_DISTORTION), strict=True))
    assert {name: SETTINGS[f"camera.{name}"].bound for name in names} == bounds
    assert {getattr(CameraSection(), name) for name in names} == {0.0}
