"""Frames to contrast, with answers worked out on paper."""

from dataclasses import replace

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.reference_light import EXPONENT, EXPONENT_SPREAD
from device.measurement.recording.tactile_image import FLOOR_COUNTS, Frame, reference, saturated_ratio, tactile_image

SHAPE = (24, 32)
SCALE = PixelScale(0.03, 0.04)
LIGHT = (0.6, 0.6, 0.6, 0.6)


def frame(role, counts, force_n=0.0, shape=SHAPE, dtype=np.uint8):
    return Frame(np.full(shape, counts, dtype), role, 0.0, force_n, LIGHT)


def image_of(press, *references, dark=4):
    return tactile_image(press, reference([frame("dark", dark), *references]), SCALE)


def test_half_again_the_light_of_the_reference_is_a_contrast_of_one_half():
    """(154 - 4) / (104 - 4) - 1 = 0.5."""
    image = image_of(frame("press", 154, 0.5), frame("reference", 104, 0.5))
    np.testing.assert_allclose(image.contrast, 0.5, atol=1e-6)
    assert image.valid.all()
    assert image.force_n == 0.5


def test_a_press_that_looks_like_the_reference_has_no_contrast():
    image = image_of(frame("press", 104), frame("reference", 104))
    assert not image.contrast.any()


def test_a_press_under_half_the_light_is_read_as_if_under_the_whole():
    """(79 - 4) / 0.5 / (104 - 4) - 1 = 0.5."""
    dimmed = replace(frame("press", 79, 0.5), led_ratio=(0.3, 0.3, 0.3, 0.3))
    image = image_of(dimmed, frame("reference", 104, 0.5))
    np.testing.assert_allclose(image.contrast, 0.5, atol=1e-6)


def test_reference_frames_of_two_brightnesses_are_one_light():
    """(54 - 4) / 0.5 is the 100 counts of the other one."""
    dimmed = replace(frame("reference", 54), led_ratio=(0.3, 0.3, 0.3, 0.3))
    assert not image_of(frame("press", 104), frame("reference", 104), dimmed).contrast.any()


@pytest.mark.parametrize("sides", [(0.6, 0.6, 0.6, 0.3), (0.0, 0.0, 0.0, 0.0)])
def test_sides_in_another_proportion_than_the_references_are_refused(sides):
    with pytest.raises(
        InvalidQuantity, match="^led_ratio of a frame is .* press beside the lesion and on it under one"
    ):
        image_of(replace(frame("press", 104), led_ratio=sides), frame("reference", 104))


def test_sixteen_bit_frames_have_the_same_contrast():
    press = frame("press", 15_400, 0.5, dtype=np.uint16)
    base = reference([frame("dark", 400, dtype=np.uint16), frame("reference", 10_400, 0.5, dtype=np.uint16)])
    np.testing.assert_allclose(tactile_image(press, base, SCALE).contrast, 0.5, atol=1e-6)


def test_an_uneven_light_field_leaves_no_trace_of_itself():
    """Whatever the light, 10 % more of it everywhere is a contrast of 0.1 everywhere."""
    light = np.linspace(50, 200, SHAPE[1]).astype(np.uint16)[None, :] * np.ones(SHAPE, np.uint16)
    lit = Frame(100 + 100 * light, "reference", 0.0, 0.5, LIGHT)
    press = Frame(100 + 110 * light, "press", 0.0, 0.5, LIGHT)
    base = reference([frame("dark", 100, dtype=np.uint16), lit])
    np.testing.assert_allclose(tactile_image(press, base, SCALE).contrast, 0.1, atol=1e-5)


def test_the_contrast_of_a_known_pattern_is_that_pattern():
    pattern = np.random.default_rng(4).integers(-50, 51, SHAPE)
    press = Frame((104 + pattern).astype(np.uint8), "press", 0.0, 0.5, LIGHT)
    np.testing.assert_allclose(image_of(press, frame("reference", 104, 0.5)).contrast, pattern / 100, atol=1e-6)


def test_dark_and_reference_are_means_of_their_frames():
    """Dark (2 + 6) / 2 = 4, reference (100 + 110) / 2 = 105: (206 - 4) / (105 - 4) - 1 = 1."""
    frames = [frame("dark", 2), frame("dark", 6), frame("reference", 100), frame("reference", 110)]
    np.testing.assert_allclose(tactile_image(frame("press", 206), reference(frames), SCALE).contrast, 1.0, atol=1e-6)


def pressed(forces_n, exponent, full=40_000):
    """Reference frames of 16 bit whose light is a power of the force."""
    levels = (full * np.asarray(forces_n) ** exponent).round().astype(int)
    return [frame("reference", level, force, dtype=np.uint16) for level, force in zip(levels, forces_n, strict=True)]


@pytest.mark.parametrize("exponent", [0.4, 0.65, 1.0])
def test_light_that_grows_with_a_power_of_the_force_is_followed_by_that_power(exponent):
    """A trembling hand, 0.47 to 0.53 N, shows the power; at 0.4 and 0.6 N the reference is right to 0.1 %."""
    base = reference([frame("dark", 0, dtype=np.uint16), *pressed(np.linspace(0.47, 0.53, 10), exponent)])
    assert base.light.exponent == pytest.approx(exponent, abs=2e-3)
    for force_n in (0.4, 0.5, 0.6):
        np.testing.assert_allclose(base.above_dark(force_n), 40_000 * force_n**exponent, rtol=1e-3)


def test_a_hand_that_does_not_tremble_leaves_the_power_that_was_expected():
    base = reference([frame("dark", 4), frame("reference", 104, 0.5), frame("reference", 104, 0.5)])
    assert base.light.exponent == EXPONENT
    np.testing.assert_allclose(base.above_dark(0.51), 100 * (0.51 / 0.5) ** EXPONENT, rtol=1e-6)


def test_noise_of_the_light_hardly_moves_the_power_of_a_steady_hand():
    """Force holds to 0.02 %, light to 0.1 %: five times what a power of 1 would show, and the power hardly moves."""
    random = np.random.default_rng(3)
    forces = 0.5 * (1 + 2e-4 * random.standard_normal(10))
    levels = (20_000 * (1 + 1e-3 * random.standard_normal(10))).round().astype(int)
    lit = [frame("reference", level, force, dtype=np.uint16) for level, force in zip(levels, forces, strict=True)]
    assert reference([frame("dark", 0, dtype=np.uint16), *lit]).light.exponent == pytest.approx(
        EXPONENT, abs=EXPONENT_SPREAD / 3
    )


def test_frames_of_the_untouched_face_are_no_part_of_the_press():
    base = reference([frame("dark", 4), frame("reference", 5, 0.0), frame("reference", 104, 0.5)])
    np.testing.assert_allclose(base.above_dark(0.5), 100, rtol=1e-6)


def test_without_a_press_the_reference_is_the_same_at_every_force():
    base = reference([frame("dark", 4), frame("reference", 100, 0.0), frame("reference", 120, 0.0)])
    for force_n in (0.0, 0.5):
        np.testing.assert_allclose(base.above_dark(force_n), 106, rtol=1e-6)


def test_sixteen_bits_have_the_same_floor_as_eight():
    counts = np.full(SHAPE, 400 * 64, np.uint16)
    counts[3, 5], counts[3, 6] = (FLOOR_COUNTS - 1) * 256, FLOOR_COUNTS * 256
    lit = Frame(counts, "reference", 0.0, 0.5, LIGHT)
    base = reference([frame("dark", 0, dtype=np.uint16), lit])
    image = tactile_image(frame("press", 500 * 64, 0.5, dtype=np.uint16), base, SCALE)
    assert (image.valid[3, 5], image.valid[3, 6]) == (False, True)


@pytest.mark.parametrize(("level", "is_valid"), [(FLOOR_COUNTS - 1, False), (FLOOR_COUNTS, True)])
def test_a_pixel_whose_reference_is_too_dim_is_invalid_and_has_no_contrast(level, is_valid):
    counts = np.full(SHAPE, 104, np.uint8)
    counts[3, 5] = 4 + level
    image = image_of(frame("press", 204, 0.5), Frame(counts, "reference", 0.0, 0.5, LIGHT))
    assert image.valid[3, 5] == is_valid
    assert (image.contrast[3, 5] != 0.0) == is_valid
    assert image.valid.sum() == image.valid.size - (not is_valid)


@pytest.mark.parametrize("role", ["dark", "reference"])
def test_a_missing_role_is_refused_by_its_name(role):
    frames = [frame(other, 50) for other in ("dark", "reference", "press") if other != role]
    with pytest.raises(InvalidQuantity, match=f"^{role} frames is 0, but must be at least one"):
        reference(frames)


def test_frames_of_two_shapes_are_refused_with_both():
    with pytest.raises(InvalidQuantity, match="32 x 24 and 16 x 24 px|16 x 24 and 32 x 24 px"):
        reference([frame("dark", 4), frame("reference", 100, shape=(24, 16))])


def test_a_press_frame_of_another_shape_is_refused_with_both():
    with pytest.raises(InvalidQuantity, match="frame shape is 16 x 24 px, but must be 32 x 24 px like the reference"):
        image_of(frame("press", 100, shape=(24, 16)), frame("reference", 100))


@pytest.mark.parametrize("force_n", [np.nan, np.inf, 1001.0, "0.5"])
def test_a_force_that_is_no_force_is_refused_by_its_name(force_n):
    with pytest.raises(InvalidQuantity, match="^force_n is"):
        frame("press", 100, force_n)


@pytest.mark.parametrize(
    "counts",
    [np.zeros(SHAPE, np.float32), np.zeros(SHAPE, np.int16), np.zeros((*SHAPE, 3), np.uint8), np.zeros(5, np.uint8)],
)
def test_what_is_no_mono_image_is_refused_with_its_type_and_shape(counts):
    with pytest.raises(InvalidQuantity, match=rf"^frame is {counts.dtype} of shape \({counts.shape[0]}"):
        Frame(counts, "press", 0.0, 0.5, LIGHT)


def test_an_unknown_role_is_refused():
    with pytest.raises(InvalidQuantity, match="^role is flat"):
        frame("flat", 100)


def test_a_time_that_is_not_finite_is_refused_by_its_name():
    with pytest.raises(InvalidQuantity, match="^t_s is nan"):
        Frame(np.zeros(SHAPE, np.uint8), "press", np.nan, 0.5, LIGHT)


@pytest.mark.parametrize("ratio", [-0.01, 1.01, np.nan])
def test_a_brightness_outside_its_scale_is_refused(ratio):
    with pytest.raises(InvalidQuantity, match="^led_ratio is"):
        Frame(np.zeros(SHAPE, np.uint8), "press", 0.0, 0.5, (0.5, 0.5, 0.5, ratio))


@pytest.mark.parametrize(("dtype", "full"), [(np.uint8, 255), (np.uint16, 1023 * 64)])
def test_saturation_is_counted_at_the_full_scale_of_eight_or_of_ten_bits_in_sixteen(dtype, full):
    counts = np.full((10, 10), full - 1, dtype)
    assert saturated_ratio(counts) == 0.0
    counts[0, :3] = full
    assert saturated_ratio(counts) == 0.03
