"""The inclusion-free press's light at any force: answers worked out on paper."""

import numpy as np
import pytest

from device.measurement.recording.reference_light import (
    BEYOND_RATIO,
    EXPONENT,
    RAMP_DEGREE,
    HeldLight,
    RampLight,
    reference_light,
)

SHAPE = (3, 4)
SLOPES = np.linspace(50, 300, 12, dtype=np.float32).reshape(SHAPE)
RAMP_N = np.linspace(0.1, 0.6, 9)


def cubic(force_n):
    """Every pixel has a cubic of its own."""
    return SLOPES * np.float32(force_n) - (SLOPES - 40) * np.float32(force_n**2) + 30 * np.float32(force_n**3)


def light_of(forces_n, law=cubic, floor_counts=6.0):
    return reference_light(list(forces_n), [np.asarray(law(f), np.float32) for f in forces_n], floor_counts)


@pytest.mark.parametrize("force_n", [0.08, 0.12, 0.333, 0.6, 0.65])
def test_over_a_ramp_every_pixels_own_cubic_comes_back(force_n):
    np.testing.assert_allclose(light_of(RAMP_N).at(force_n), cubic(force_n), rtol=1e-4)


def test_the_order_of_the_frames_does_not_matter():
    np.testing.assert_allclose(light_of(RAMP_N[::-1]).at(0.3), light_of(RAMP_N).at(0.3), rtol=1e-5)


def test_far_beyond_the_ramp_the_light_stays_what_it_is_at_the_end_of_what_is_followed():
    light, (low, high) = light_of(RAMP_N), BEYOND_RATIO
    for force_n, end_n in ((0.0, low * 0.1), (-0.1, low * 0.1), (0.05, low * 0.1), (0.9, high * 0.6)):
        np.testing.assert_array_equal(light.at(force_n), light.at(end_n))
    np.testing.assert_allclose(light.at(5.0), cubic(high * 0.6), rtol=1e-4)


def test_frames_of_the_untouched_face_are_no_part_of_a_ramp():
    touched, all_frames = light_of(RAMP_N), light_of([0.0, 0.0, 0.002, *RAMP_N])
    np.testing.assert_array_equal(all_frames.at(0.3), touched.at(0.3))
    assert all_frames.smallest_n == 0.1


@pytest.mark.parametrize(
    ("forces_n", "kind"),
    [
        (np.linspace(0.25, 0.5, RAMP_DEGREE + 1), RampLight),
        (np.linspace(0.26, 0.5, RAMP_DEGREE + 1), HeldLight),
        (np.linspace(0.1, 0.6, RAMP_DEGREE), HeldLight),
    ],
)
def test_a_ramp_doubles_the_force_and_has_more_frames_than_its_degree(forces_n, kind):
    assert isinstance(light_of(forces_n), kind)


@pytest.mark.parametrize("exponent", [0.4, 1.0])
def test_a_held_press_is_followed_by_the_one_power_that_its_tremor_shows(exponent):
    light = light_of(np.linspace(0.47, 0.53, 10), lambda f: SLOPES * f**exponent)
    assert light.exponent == pytest.approx(exponent, abs=2e-3)
    np.testing.assert_allclose(light.at(0.6), SLOPES * 0.6**exponent, rtol=1e-3)


def test_a_held_press_too_dim_to_tell_has_the_power_that_was_expected():
    assert light_of([0.48, 0.5, 0.52], lambda f: SLOPES * f, floor_counts=1e4).exponent == EXPONENT


def test_without_any_force_the_light_is_the_frames_mean_at_every_force():
    light = reference_light([0.0, 0.0], [np.full(SHAPE, v, np.float32) for v in (90, 110)], 6.0)
    for force_n in (0.0, 0.5):
        np.testing.assert_array_equal(light.at(force_n), np.full(SHAPE, 100, np.float32))
