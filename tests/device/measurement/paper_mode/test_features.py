"""The paper's three numbers of images whose answers are known on paper, on pixels twice as high as wide.

A Gaussian spot of peak A and standard deviation s has the integral 2 pi A s^2. The blur of standard deviation t makes
it a Gaussian of peak A s^2 / S^2 with S^2 = s^2 + t^2, which is above half its peak on an area of 2 pi ln 2 S^2.
"""

import math

import numpy as np
import pytest

from device.measurement.paper_mode.features import FEATURE_NAMES, FeatureSettings, extract_features
from device.measurement.quantities import InvalidQuantity
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.tactile_image import TactileImage

SCALE = PixelScale(0.03, 0.06)
SHAPE = (400, 800)
SETTINGS = FeatureSettings(window_radius_mm=9.9, smoothing_mm=0.5)
PEAK, SIGMA_MM = 0.08, 0.9


def spot(peak=PEAK, sigma_mm=SIGMA_MM, at_mm=(0.0, 0.0), valid=None):
    x, y = SCALE.coordinates_mm(SHAPE)
    contrast = peak * np.exp(-((x - at_mm[0]) ** 2 + (y - at_mm[1]) ** 2) / (2 * sigma_mm**2))
    return TactileImage(contrast, np.ones(SHAPE, bool) if valid is None else valid, SCALE, 0.5)


@pytest.mark.parametrize("sigma_mm", [0.6, 0.9, 2.0])
@pytest.mark.parametrize("smoothing_mm", [0.25, 0.5, 1.0])
def test_peak_integral_and_half_maximum_area_of_a_gaussian_spot(sigma_mm, smoothing_mm):
    found = extract_features(spot(sigma_mm=sigma_mm), FeatureSettings(smoothing_mm=smoothing_mm))
    blurred = sigma_mm**2 + smoothing_mm**2
    assert found.centroid_intensity == pytest.approx(PEAK * sigma_mm**2 / blurred, rel=0.01)
    assert found.total_intensity == pytest.approx(2 * math.pi * PEAK * sigma_mm**2, rel=1e-3)
    assert found.bright_area_mm2 == pytest.approx(2 * math.pi * math.log(2) * blurred, rel=0.02)


@pytest.mark.parametrize("ratio", [0.25, 0.5, 0.75])
def test_the_bright_area_follows_the_threshold(ratio):
    """Above a part q of its peak a Gaussian covers 2 pi S^2 ln(1 / q)."""
    found = extract_features(spot(), FeatureSettings(threshold_ratio=ratio))
    assert found.bright_area_mm2 == pytest.approx(2 * math.pi * (SIGMA_MM**2 + 0.25) * math.log(1 / ratio), rel=0.02)


@pytest.mark.parametrize("at_mm", [(0.0, 0.0), (3.0, 0.0), (0.0, -3.0), (-2.0, 4.0)])
def test_the_centroid_is_where_the_spot_is_in_mm(at_mm):
    found = extract_features(spot(at_mm=at_mm), SETTINGS)
    assert (found.centroid_x_mm, found.centroid_y_mm) == pytest.approx(at_mm, abs=0.005)


def test_where_the_spot_lies_changes_none_of_the_three_numbers():
    middle, beside = (extract_features(spot(at_mm=at), SETTINGS).as_row() for at in ((0.0, 0.0), (3.03, -2.01)))
    np.testing.assert_allclose(beside, middle, rtol=0.01)


def test_turning_the_image_by_half_turns_only_the_centroid():
    image = spot(at_mm=(3.0, -2.0))
    turned = TactileImage(image.contrast[::-1, ::-1].copy(), image.valid, SCALE, 0.5)
    before, after = extract_features(image, SETTINGS), extract_features(turned, SETTINGS)
    np.testing.assert_allclose(after.as_row(), before.as_row(), rtol=1e-5)
    assert after.centroid_x_mm == pytest.approx(-before.centroid_x_mm, abs=1e-4)
    assert after.centroid_y_mm == pytest.approx(-before.centroid_y_mm, abs=1e-4)


def test_twice_the_contrast_is_twice_the_peak_and_sum_on_the_same_area():
    once, twice = (extract_features(spot(peak=peak), SETTINGS).as_row() for peak in (0.08, 0.16))
    np.testing.assert_allclose(twice, once * (2, 2, 1), rtol=1e-4)


def test_half_the_pixels_in_each_direction_give_the_same_numbers():
    coarse_scale = PixelScale(0.06, 0.12)
    x, y = coarse_scale.coordinates_mm((200, 400))
    contrast = PEAK * np.exp(-(x**2 + y**2) / (2 * SIGMA_MM**2))
    coarse = TactileImage(contrast, np.ones((200, 400), bool), coarse_scale, 0.5)
    fine_row, coarse_row = (extract_features(image, SETTINGS).as_row() for image in (spot(), coarse))
    np.testing.assert_allclose(coarse_row, fine_row, rtol=0.02)


def test_a_constant_contrast_sums_to_itself_times_the_window():
    image = TactileImage(np.full(SHAPE, 0.1, np.float32), np.ones(SHAPE, bool), SCALE, 0.5)
    found = extract_features(image, SETTINGS)
    window_mm2 = math.pi * SETTINGS.window_radius_mm**2
    assert found.centroid_intensity == pytest.approx(0.1)
    assert found.total_intensity == pytest.approx(0.1 * window_mm2, rel=1e-3)
    assert found.bright_area_mm2 == pytest.approx(window_mm2, rel=1e-3)


def test_what_lies_outside_the_window_counts_nothing():
    inside = extract_features(spot(), FeatureSettings(window_radius_mm=5.0))
    image = spot()
    image.contrast[:, :50] = 5.0  # more than 9 mm to the side
    assert extract_features(image, FeatureSettings(window_radius_mm=5.0)) == inside


@pytest.mark.parametrize("contrast", [0.0, -0.05])
def test_an_image_without_a_bright_spot_has_no_area_and_no_peak(contrast):
    image = TactileImage(np.full(SHAPE, contrast, np.float32), np.ones(SHAPE, bool), SCALE, 0.5)
    found = extract_features(image, SETTINGS)
    assert (found.centroid_intensity, found.bright_area_mm2) == (0.0, 0.0)
    assert (found.centroid_x_mm, found.centroid_y_mm) == (0.0, 0.0)
    assert found.total_intensity == pytest.approx(contrast * math.pi * 9.9**2, rel=1e-3)


def test_an_image_without_a_valid_pixel_has_no_features():
    assert not extract_features(spot(valid=np.zeros(SHAPE, bool)), SETTINGS).as_row().any()


def test_an_invalid_pixel_counts_nothing_whatever_it_holds():
    valid = np.ones(SHAPE, bool)
    valid[101:104, 203:208] = False  # begins inside a bin of 2 x 2 pixels
    image = spot(valid=valid)
    image.contrast[~valid] = 1e6
    whole, holed = extract_features(spot(), SETTINGS), extract_features(image, SETTINGS)
    np.testing.assert_allclose(holed.as_row(), whole.as_row(), rtol=1e-3)


def test_a_valid_half_has_half_of_the_sum_and_area_but_the_whole_brightness():
    """Blurred over valid pixels only: a dark half does not pull the bright one down, not even at its edge."""
    valid = np.ones(SHAPE, bool)
    valid[:, : SHAPE[1] // 2] = False
    constant = TactileImage(np.where(valid, 0.1, 0.0).astype(np.float32), valid, SCALE, 0.5)
    found = extract_features(constant, FeatureSettings(threshold_ratio=0.95))
    assert found.bright_area_mm2 == pytest.approx(math.pi * 9.9**2 / 2, rel=1e-3)
    assert found.centroid_intensity == pytest.approx(0.1, rel=1e-4)


def test_a_row_has_the_features_in_the_order_of_their_names():
    found = extract_features(spot(), SETTINGS)
    assert found.as_row().tolist() == [getattr(found, name) for name in FEATURE_NAMES]


@pytest.mark.parametrize(
    ("name", "low", "high"), [("window_radius_mm", 1, 100), ("smoothing_mm", 0.05, 5), ("threshold_ratio", 0.05, 0.95)]
)
def test_settings_are_taken_at_both_ends_of_their_bound_and_refused_beyond(name, low, high):
    for value in (low, high):
        assert getattr(FeatureSettings(**{name: value}), name) == value
    for value in (0.99 * low, 1.01 * high, math.nan):
        with pytest.raises(InvalidQuantity, match=f"^{name} is"):
            FeatureSettings(**{name: value})
