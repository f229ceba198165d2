"""The light of an untouched face near each side, and how far it is from a certificate's."""

import dataclasses

import numpy as np
import pytest

from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.tactile_image import Frame
from device.measurement.recording.untouched_face import Drift, UntouchedFace, side_levels

LIT, DARK = (0.6, 0.6, 0.6, 0.6), (0.0, 0.0, 0.0, 0.0)
SHINING = UntouchedFace(4.0, (20.0, 20.0, 20.0, 20.0), 0.01, 100.0, 0.6)
BLACK = UntouchedFace(4.0, (0.0, 0.0, 0.0, 0.0), 0.01, 50.0, 0.6)


def frame(counts, role="reference", ratio=LIT):
    return Frame(np.asarray(counts, dtype=np.uint8), role, 0.0, 0.0, ratio)


def unloaded(light, ratio=LIT):
    """Dark of 4 counts everywhere, and `light` above it: a number, or an image [32, 48]."""
    return [
        frame(np.full((32, 48), 4), "dark", DARK),
        frame(np.broadcast_to(np.add(light, 4), (32, 48)), ratio=ratio),
    ]


def brighter_at_plus_y(light, more):
    image = np.full((32, 48), light)
    image[16:, :][side_of_plus_y()[16:, :]] = more
    return image


def side_of_plus_y():
    y, x = np.mgrid[:32, :48]
    return (y - 15.5) / 32 > np.abs(x - 23.5) / 48


def test_each_side_has_the_quarter_of_the_image_next_to_it():
    """Bright where y is large: down, as in the image. Pixels on the diagonals are +y's or -y's."""
    image = np.where(side_of_plus_y(), 100, 0)
    np.testing.assert_allclose(side_levels([frame(image)])[0], [0, 100, 0, 0], atol=8)
    np.testing.assert_allclose(side_levels([frame(image.T)])[0], [100, 0, 0, 0], atol=8)


def test_counts_of_16_bit_are_put_on_the_scale_of_8():
    deep = Frame(np.full((32, 32), 7 * 256, np.uint16), "dark", 0.0, 0.0, DARK)
    np.testing.assert_allclose(side_levels([deep]), 7.0)


def test_a_face_as_at_the_calibration_has_not_drifted():
    assert SHINING.drift(unloaded(20)).change_ratio == 0.0


@pytest.mark.parametrize(("light", "change"), [(17, -0.15), (15, -0.25), (24, 0.2)])
def test_a_face_that_shone_is_compared_with_its_own_light(light, change):
    drift = SHINING.drift(unloaded(light))
    assert drift.change_ratio == pytest.approx(change)
    assert drift.is_of_its_own_light


def test_the_side_that_changed_most_is_named():
    assert SHINING.drift(unloaded(brighter_at_plus_y(20, 30))).side == "+y"


@pytest.mark.parametrize("ratio", [(0.9, 0.6, 0.6, 0.6), (0.3, 0.3, 0.3, 0.3)])
def test_a_face_that_is_lit_otherwise_than_at_the_calibration_is_not_judged(ratio):
    with pytest.raises(InvalidQuantity, match=r"led_ratio of unloaded frames is .* \(0\.6, 0\.6, 0\.6, 0\.6\)"):
        SHINING.drift(unloaded(20, ratio))


def test_sides_that_differed_at_the_calibration_keep_a_brightness_each():
    trimmed = (0.5, 0.6, 0.7, 0.6)
    face = dataclasses.replace(SHINING, led_ratio=trimmed)
    assert (face.lit_ratio, SHINING.lit_ratio) == (trimmed, (0.6, 0.6, 0.6, 0.6))
    assert face.drift(unloaded(20, trimmed)).change_ratio == 0.0


@pytest.mark.parametrize("ratio", [0.0, 1.1, (0.6, 0.6, 0.6), (0.6, 0.6, 0.6, 1.1), (0.0, 0.0, 0.0, 0.0)])
def test_a_brightness_that_no_side_can_have_is_refused(ratio):
    with pytest.raises(InvalidQuantity, match=r"untouched\.led_ratio"):
        dataclasses.replace(SHINING, led_ratio=ratio)


def test_of_a_dark_face_only_added_light_counts_in_parts_of_a_presss():
    assert BLACK.drift(unloaded(10)) == Drift("+x", pytest.approx(0.2), is_of_its_own_light=False)
    assert BLACK.drift(unloaded(0)).change_ratio == 0.0


@pytest.mark.parametrize(
    ("side_counts", "spread_counts", "is_resolved"),
    [
        ((20.0,) * 4, 0.4, True),
        ((20.0,) * 4, 0.41, False),
        ((20.0, 20.0, 20.0, 1.9), 0.0, False),
        ((2.0,) * 4, 0.0, True),
    ],
)
def test_a_tenth_is_told_above_two_counts_and_five_deviations(side_counts, spread_counts, is_resolved):
    assert UntouchedFace(4.0, side_counts, spread_counts, 50.0, 0.6).is_resolved is is_resolved


def test_the_loss_of_light_on_a_face_too_dim_to_tell_is_none():
    dim = UntouchedFace(4.0, (1.0, 1.0, 1.0, 1.0), 0.01, 50.0, 0.6)
    assert dim.drift(unloaded(0)).change_ratio == 0.0


@pytest.mark.parametrize(("left", "words"), [(slice(0, 1), "lit unloaded frames"), (slice(1, 2), "dark frames")])
def test_without_dark_or_lit_frames_nothing_is_said(left, words):
    with pytest.raises(InvalidQuantity, match=words):
        SHINING.drift(unloaded(20)[left])
