"""Means and harmonics on soft rings of images whose answers are known on paper.

A ring's weight is a hat of half-width h over the radius, so with the area's r the ring at r sees a mean radius of
r + h^2 / 6r, and the middle one h / 2.
"""

import numpy as np
import pytest

from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, ring_weights

SCALE = PixelScale(0.05, 0.0625)
SHAPE = (336, 416)
X, Y = SCALE.coordinates_mm(SHAPE)
R, ANGLE = np.hypot(X, Y), np.arctan2(Y, X)
EVERYWHERE = np.ones(SHAPE, bool)


def means(image, valid=EVERYWHERE, scale=SCALE):
    image = np.broadcast_to(image, valid.shape).astype(np.float32)
    return ring_weights(valid.shape, scale).means(image, valid)


def test_a_constant_image_has_its_mean_on_every_ring_and_no_harmonic():
    found = means(0.3)
    np.testing.assert_allclose(found.mean, 0.3, rtol=1e-5)
    assert max(np.abs(found.cosine).max(), np.abs(found.sine).max()) < 1e-5


@pytest.mark.parametrize(("order", "phase"), [(1, 0.0), (1, 0.7), (2, 0.0), (2, 2.0)])
def test_a_wave_around_the_axis_is_that_harmonic_with_its_phase_and_no_other(order, phase):
    found = means(1 + 0.2 * np.cos(order * ANGLE - phase))
    rings = slice(1, None)
    np.testing.assert_allclose(found.mean[rings], 1.0, atol=1e-3)
    np.testing.assert_allclose(found.cosine[order - 1, rings], 0.2 * np.cos(phase), atol=2e-3)
    np.testing.assert_allclose(found.sine[order - 1, rings], 0.2 * np.sin(phase), atol=2e-3)
    other = 2 - order
    assert max(np.abs(found.cosine[other, rings]).max(), np.abs(found.sine[other, rings]).max()) < 2e-3


def test_the_radius_itself_has_the_rings_mean_radius():
    expected = np.append(RING_MM / 2, RING_RADII_MM[1:] + RING_MM**2 / (6 * RING_RADII_MM[1:]))
    np.testing.assert_allclose(means(R).mean, expected, rtol=2e-3)


def test_pixels_of_another_size_and_shape_give_the_same_means():
    """Ratios of one pixel size to the other: 2.5 and 2."""
    scale, shape = PixelScale(0.125, 0.125), (168, 168)
    x, y = scale.coordinates_mm(shape)
    coarse = means(np.exp(-(x**2 + y**2) / 18) + 0.05 * x, np.ones(shape, bool), scale)
    fine = means(np.exp(-(R**2) / 18) + 0.05 * X)
    for one, other in zip(coarse, fine, strict=True):
        np.testing.assert_allclose(one, other, atol=1e-3)


def test_means_times_areas_add_up_to_the_integral():
    """A Gaussian of standard deviation s and height 1 has the integral 2 pi s^2; a ring's area is its weight's."""
    areas_mm2 = np.pi * RING_MM * np.append(RING_MM / 3, 2 * RING_RADII_MM[1:])
    found = means(np.exp(-(R**2) / (2 * 2.0**2))).mean @ areas_mm2
    assert found == pytest.approx(8 * np.pi, rel=1e-3)


def test_an_invalid_pixel_counts_nothing_whatever_it_holds():
    valid = EVERYWHERE.copy()
    valid[:, 300:330] = False
    image = np.where(valid, 0.3, np.nan)
    found = means(image, valid)
    np.testing.assert_allclose(found.mean, 0.3, rtol=1e-5)


def test_a_ring_seen_in_part_has_no_harmonic_of_its_own():
    valid = EVERYWHERE.copy()
    valid[:, 260:] = False
    valid[:70] = False
    found = means(0.3, valid)
    assert max(np.abs(found.cosine).max(), np.abs(found.sine).max()) < 1e-5


def test_a_ring_without_a_valid_pixel_is_zero():
    found = means(0.3, R < 4.0)
    np.testing.assert_allclose(found.mean[:5], 0.3, rtol=1e-5)
    assert not found.mean[6:].any()
    assert not found.cosine[:, 6:].any()
