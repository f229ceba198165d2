"""What a frame is said to be: bright, saturated and sharp, whatever its light and noise."""

import cv2
import numpy as np
import pytest

from device.instrument.acquisition.frame_quality import QualityWatch

SHAPE = (120, 160)
DARK = np.full(SHAPE, 16.0)
Y, X = np.mgrid[: SHAPE[0], : SHAPE[1]]
PRINT = 40.0 + 30.0 * ((X // 8 + Y // 8) % 2)
"""A chequered print: counts above dark."""


def taken(light, noise_counts=0.0, seed=1):
    noise = np.random.default_rng(seed).normal(0.0, noise_counts, SHAPE) if noise_counts else 0.0
    return np.clip(np.rint(DARK + light + noise), 0, 255).astype(np.uint8)


def quality(light, noise_counts=0.0):
    watch = QualityWatch([taken(np.zeros(SHAPE), noise_counts, seed) for seed in (11, 12, 13, 14)])
    watch.saw(taken(light, noise_counts, 1))
    return watch.saw(taken(light, noise_counts, 2))


def blurred(light, px):
    return cv2.GaussianBlur(light, (0, 0), px)


def test_the_sharpest_image_is_the_one_in_focus():
    found = [quality(blurred(PRINT, px)).sharpness for px in (4.0, 2.0, 1.0, 0.5, 1.0, 2.0, 4.0)]
    assert found[:4] == sorted(found[:4])
    assert found == pytest.approx(found[::-1])
    assert found[3] > 3 * found[2]


def of_one(light):
    """The variance of the Laplacian over the squared mean, without rounding and noise."""
    return np.var(cv2.Laplacian(light, cv2.CV_64F)) / light.mean() ** 2


def test_it_is_the_variance_of_the_laplacian_over_the_squared_mean():
    assert quality(PRINT).sharpness == pytest.approx(of_one(PRINT), rel=1e-4)


def test_more_light_makes_nothing_sharper():
    assert quality(2 * PRINT).sharpness == pytest.approx(quality(PRINT).sharpness, rel=1e-3)


def test_noise_does_not_count_although_it_would_alone():
    """The variance of one frame of this noise is 20 times its square, here several times that of the print."""
    smooth = blurred(PRINT, 2.0)
    alone = 20 * 2.0**2 / smooth.mean() ** 2
    assert alone > 3 * of_one(smooth)
    assert quality(smooth, noise_counts=2.0).sharpness == pytest.approx(of_one(smooth), abs=0.05 * alone)


def test_without_light_and_without_a_frame_before_nothing_is_sharp():
    assert quality(np.zeros(SHAPE)).sharpness is None
    assert QualityWatch([taken(np.zeros(SHAPE))] * 2).saw(taken(PRINT)).sharpness is None


def test_counts_are_those_of_the_frame_and_of_the_dark_ones():
    light = np.full(SHAPE, 50.0)
    light[:2, :] = 300.0
    found = quality(light)
    assert (found.dark_counts, found.brightest_counts) == (16.0, 255.0)
    assert found.saturated_ratio == pytest.approx(2 / 120)
    assert found.mean_counts == pytest.approx((66.0 * 118 + 255.0 * 2) / 120)
    assert found.light_counts == pytest.approx(found.mean_counts - 16.0)
