"""Linear optics: intensity = light field * (a w + b), each LED on its own."""

import math

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.simulation.physics.image_formation import LinearOptics

SHAPE = (61, 81)
SCALE = PixelScale(0.35, 0.45)
OPTICS = LinearOptics(slope_per_mm=1.2, intercept=0.1)
FIELDS = OPTICS.led_fields(SHAPE, SCALE)
ALL_ON = (1.0, 1.0, 1.0, 1.0)
W_MM = np.random.default_rng(1).uniform(0.2, 0.6, SHAPE).astype(np.float32)


def test_intensity_is_linear_in_the_deformation():
    """Twice the step of w is twice the step of intensity, and the slope is a times the light."""
    flat, once, twice = (OPTICS.intensity(FIELDS, ALL_ON, step * W_MM) for step in (np.float32(s) for s in (0, 1, 2)))
    np.testing.assert_allclose(twice - flat, 2 * (once - flat), rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(once - flat, FIELDS.sum(axis=0) * 1.2 * W_MM, rtol=1e-4, atol=1e-6)


def test_without_deformation_the_light_times_the_intercept_is_seen():
    flat = OPTICS.intensity(FIELDS, ALL_ON, np.zeros(SHAPE, np.float32))
    np.testing.assert_allclose(flat, 0.1 * FIELDS.sum(axis=0), rtol=1e-5)


def test_the_light_of_the_leds_adds_up():
    one_by_one = sum(OPTICS.intensity(FIELDS, tuple(map(float, row)), W_MM) for row in np.eye(4))
    np.testing.assert_allclose(one_by_one, OPTICS.intensity(FIELDS, ALL_ON, W_MM), rtol=1e-5)


def test_each_led_is_dimmed_by_its_own_ratio():
    expected = np.tensordot([0.1, 0.2, 0.3, 0.4], FIELDS, 1) * (1.2 * W_MM + 0.1)
    np.testing.assert_allclose(OPTICS.intensity(FIELDS, (0.1, 0.2, 0.3, 0.4), W_MM), expected, rtol=1e-5)


def test_all_leds_off_is_dark():
    assert not OPTICS.intensity(FIELDS, (0.0, 0.0, 0.0, 0.0), W_MM).any()


def test_all_leds_together_are_one_in_the_middle():
    assert FIELDS.sum(axis=0)[30, 40] == pytest.approx(1.0)


def test_beyond_the_face_it_is_dark_and_inside_it_is_not():
    x, y = SCALE.coordinates_mm(SHAPE)
    outside = np.hypot(x, y) > OPTICS.face_radius_mm
    assert outside.any()
    assert not FIELDS[:, outside].any()
    assert (FIELDS[:, ~outside] > 0).all()


def test_opposite_leds_are_each_others_mirror_image():
    plus_x, plus_y, minus_x, minus_y = FIELDS
    np.testing.assert_array_equal(plus_x, minus_x[:, ::-1])
    np.testing.assert_array_equal(plus_y, minus_y[::-1])


def test_each_led_is_brightest_on_its_own_side():
    plus_x, plus_y, minus_x, minus_y = FIELDS
    assert plus_x[30, 60] > plus_x[30, 20]
    assert minus_x[30, 20] > minus_x[30, 60]
    assert plus_y[45, 40] > plus_y[15, 40]
    assert minus_y[15, 40] > minus_y[45, 40]


def test_the_light_falls_to_half_at_the_reach_of_an_led():
    """1 / (1 + (r / reach)^2): half at r = reach, against the light at the LED itself."""
    optics = LinearOptics(led_distance_mm=12.0, led_reach_mm=12.0)
    middle = 4 / (1 + (12 / 12) ** 2)
    assert optics.led_fields(SHAPE, SCALE)[0, 30, 40] * middle == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("slope_per_mm", 0.0),
        ("slope_per_mm", math.nan),
        ("intercept", -0.01),
        ("led_reach_mm", 0.0),
        ("face_radius_mm", -1.0),
        ("led_distance_mm", 10.99),
    ],
)
def test_impossible_optics_are_refused_by_name(name, value):
    with pytest.raises(InvalidQuantity, match=rf"^optics\.{name} is"):
        LinearOptics(**{name: value})


def test_an_led_may_stand_at_the_very_rim_of_the_face():
    assert LinearOptics(led_distance_mm=11.0).led_distance_mm == 11.0
