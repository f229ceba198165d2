"""Shapes whose width, moments, offset and ellipticity are known on paper.

`bell` is a profile exactly on the rings; `seen` is an image read on the rings, which blur along the radius: a Gaussian
of standard deviation s reads as one of sqrt(s^2 + h^2 / 6).
"""

import math

import numpy as np
import pytest

from device.measurement.paper_mode.feature_definitions import (
    HELD_FEATURES,
    INCLUSION_FIELD_FEATURES,
    PAPER_FEATURES,
    PRESS_FEATURES,
    PROFILE_FEATURES,
    RAMP_FEATURES,
    definition_of,
)
from device.measurement.paper_mode.features import FEATURE_NAMES
from device.measurement.radial_gaussian import SIGMAS_MM, fit_gaussian
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N, ROW_NAMES, PressProfile, harmonic_at_forces
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RingMeans, ring_weights
from device.measurement.shape_features import NOISE_MULTIPLE, shape_features

SCALE, SHAPE = PixelScale(0.08, 0.08), (264, 264)
X, Y = SCALE.coordinates_mm(SHAPE)
R = RING_RADII_MM
FORCES = len(PROFILE_FORCES_N)
FWHM = 2 * math.sqrt(2 * math.log(2))


def profile_of(contrast, offset=None, elongation=None, residual=0.0):
    zero = np.zeros(len(R) - 1)
    contrast = np.broadcast_to(contrast, (FORCES, len(R))).astype(float)
    at_force = [np.broadcast_to(zero if h is None else h, (FORCES, len(zero))) for h in (offset, elongation)]
    harmonics = [h.mean(axis=0) for h in at_force]
    growth, second = np.zeros((FORCES - 1, len(R))), np.zeros((2, FORCES, len(zero) - 1))
    return PressProfile(PROFILE_FORCES_N, contrast, growth, *harmonics, *at_force, second, residual)


def bell(sigma_mm, peak=0.3, constant=0.0):
    return profile_of(peak * np.exp(-(R**2) / (2 * sigma_mm**2)) + constant)


def seen(*images):
    """Return the profile of images at the forces, or of one image, the same at all of them."""
    weights, valid = ring_weights(SHAPE, SCALE), np.ones(SHAPE, bool)
    means = [weights.means(np.broadcast_to(image, SHAPE).astype(np.float32), valid) for image in images]
    rings = RingMeans(*(np.array(part) for part in zip(*means * (FORCES // len(images)), strict=True)))
    return profile_of(rings.mean, harmonic_at_forces(rings, 1), harmonic_at_forces(rings, 2))


def spot(sigma_mm, x=X, y=Y):
    return 0.3 * np.exp(-(x**2 + y**2) / (2 * sigma_mm**2))


@pytest.mark.parametrize("sigma_mm", [1.5, 2.0, 3.0])
def test_a_gaussian_has_its_own_peak_width_and_standard_deviation_and_leaves_nothing(sigma_mm):
    """Full width at half maximum 2.3548 sigma."""
    found = shape_features(bell(sigma_mm))
    np.testing.assert_allclose(found.peak_contrast, 0.3, rtol=1e-6)
    np.testing.assert_allclose(found.full_width_half_maximum_mm, FWHM * sigma_mm, rtol=3e-3)
    np.testing.assert_allclose(found.gaussian_peak, 0.3, rtol=1e-3)
    np.testing.assert_allclose(found.gaussian_sigma_mm, sigma_mm, rtol=1e-3)
    np.testing.assert_allclose(found.gaussian_residual_ratio, 0.0, atol=1e-3)


@pytest.mark.parametrize("sigma_mm", [1.5, 2.0, 2.5])
def test_integral_and_moments_of_a_gaussian(sigma_mm):
    """2 pi A s^2; mean radius s sqrt(pi / 2), root mean square s sqrt(2)."""
    found = shape_features(bell(sigma_mm))
    np.testing.assert_allclose(found.total_contrast_mm2, 0.6 * np.pi * sigma_mm**2, rtol=0.03)
    np.testing.assert_allclose(found.mean_radius_mm, sigma_mm * math.sqrt(math.pi / 2), rtol=0.03)
    np.testing.assert_allclose(found.rms_radius_mm, sigma_mm * math.sqrt(2), rtol=0.02)


@pytest.mark.parametrize("sigma_mm", [2.0, 2.5])
def test_rings_widen_a_gaussian_by_their_own_width_and_keep_integral_and_mean_radius(sigma_mm):
    found, wider = shape_features(seen(spot(sigma_mm))), math.sqrt(sigma_mm**2 + RING_MM**2 / 6)
    np.testing.assert_allclose(found.total_contrast_mm2, 0.6 * np.pi * sigma_mm**2, rtol=5e-3)
    np.testing.assert_allclose(found.mean_radius_mm, sigma_mm * math.sqrt(math.pi / 2), rtol=5e-3)
    np.testing.assert_allclose(found.rms_radius_mm, math.sqrt(2 * sigma_mm**2 + RING_MM**2 / 6), rtol=5e-3)
    np.testing.assert_allclose(found.gaussian_sigma_mm, wider, rtol=0.01)
    np.testing.assert_allclose(found.full_width_half_maximum_mm, FWHM * wider, rtol=0.02)


@pytest.mark.parametrize("constant", [-0.05, 0.05])
def test_a_constant_below_a_gaussian_is_no_part_of_it(constant):
    gaussian = fit_gaussian(bell(2.5, constant=constant).contrast[0])
    assert gaussian == pytest.approx((0.3, 2.5, constant, 0.0), rel=1e-3, abs=1e-3)


def test_a_disc_has_its_diameter_as_width_and_two_thirds_of_its_radius_as_mean():
    """Root mean square a / sqrt 2, and it is no Gaussian: more of it is left than of any that fits."""
    radius_mm = 5.0
    found = shape_features(seen(np.where(np.hypot(X, Y) < radius_mm, 0.2, 0.0)))
    np.testing.assert_allclose(found.full_width_half_maximum_mm, 2 * radius_mm, atol=0.2)
    np.testing.assert_allclose(found.total_contrast_mm2, 0.2 * np.pi * radius_mm**2, rtol=0.01)
    np.testing.assert_allclose(found.mean_radius_mm, radius_mm * 2 / 3, rtol=0.01)
    np.testing.assert_allclose(found.rms_radius_mm, math.sqrt(radius_mm**2 / 2 + RING_MM**2 / 6), rtol=0.01)
    assert (found.gaussian_residual_ratio > 0.03).all()


@pytest.mark.parametrize("towards", [0.0, 1.0, -2.3])
def test_a_shifted_gaussian_is_off_by_its_shift(towards):
    """What a first harmonic leaves out is of third order in the shift: it costs shift^2 / s^2 of it at most."""
    for shift_mm, bound_mm in ((0.25, 0.01), (0.5, 0.025), (1.0, 0.12)):
        x, y = X - shift_mm * math.cos(towards), Y - shift_mm * math.sin(towards)
        found = shape_features(seen(spot(3.0, x, y)))
        np.testing.assert_allclose(found.centroid_offset_mm, shift_mm, atol=bound_mm)
        assert found.mean_centroid_offset_mm == pytest.approx(shift_mm, abs=bound_mm)
        assert (np.abs(found.ellipticity) < shift_mm**2 / 9).all()


def test_the_offsets_error_falls_with_the_square_of_the_shift():
    """Halving the shift quarters the error relative to what an infinitely small shift gives."""
    ratio = [shape_features(seen(spot(3.0, x=X - s))).mean_centroid_offset_mm / s for s in (0.05, 0.5, 1.0)]
    assert (ratio[0] - ratio[2]) / (ratio[0] - ratio[1]) == pytest.approx(4.0, rel=0.1)


def test_a_spot_that_moves_during_the_ramp_has_its_offset_at_each_force():
    """Along one direction for the whole ramp: a spot on the other side of the axis has a negative offset."""
    shifts_mm = np.array([-0.1, 0.1, 0.3, 0.5])
    found = shape_features(seen(*(spot(3.0, x=X - s) for s in shifts_mm)))
    np.testing.assert_allclose(found.centroid_offset_mm, shifts_mm, atol=0.025)
    assert found.mean_centroid_offset_mm == pytest.approx(shifts_mm.mean(), abs=0.01)


def test_a_spot_that_gets_oblong_has_its_ellipticity_at_each_force():
    growing = np.array([0.0, 0.02, 0.05, 0.1])
    found = shape_features(seen(*(spot(3.0, X / (1 + e), Y / (1 - e)) for e in growing)))
    np.testing.assert_allclose(found.ellipticity, growing, rtol=0.04, atol=1e-3)
    assert found.mean_ellipticity == pytest.approx(growing.mean(), rel=0.04)


@pytest.mark.parametrize("turned", [0.0, 0.6, -1.2])
@pytest.mark.parametrize("ellipticity", [0.02, 0.05, 0.1])
def test_an_elliptical_gaussian_has_its_ellipticity_however_it_is_turned(turned, ellipticity):
    """Half axes s (1 + e) and s (1 - e): (a - b) / (a + b) = e."""
    u, v = X * math.cos(turned) + Y * math.sin(turned), Y * math.cos(turned) - X * math.sin(turned)
    found = shape_features(seen(spot(3.0, u / (1 + ellipticity), v / (1 - ellipticity))))
    np.testing.assert_allclose(found.ellipticity, ellipticity, rtol=0.04)
    assert found.mean_ellipticity == pytest.approx(ellipticity, rel=0.04)
    assert (np.abs(found.centroid_offset_mm) < 1e-3).all()


def test_slopes_over_the_force_are_those_of_the_ramp():
    """A peak that falls by 1 a newton of itself at no force: -1 / (1 - mean force) of its mean."""
    scale = 1 - PROFILE_FORCES_N[:, None]
    found = shape_features(profile_of(scale * bell(2.0).contrast))
    expected = -1 / (1 - PROFILE_FORCES_N.mean())
    assert found.peak_change_per_n == pytest.approx(expected)
    assert found.total_change_per_n == pytest.approx(expected)
    assert found.width_change_mm_per_n == pytest.approx(0.0, abs=1e-9)


def test_the_width_grows_by_what_it_grows_with_the_force():
    sigma_mm = 2 + PROFILE_FORCES_N[:, None]
    found = shape_features(profile_of(np.exp(-(R**2) / (2 * sigma_mm**2))))
    assert found.width_change_mm_per_n == pytest.approx(FWHM, rel=0.02)


@pytest.mark.parametrize("factor", [0.1, 2.0])
def test_the_light_of_the_inclusion_changes_no_length(factor):
    """Peak, integral and Gaussian peak are in proportion; the other numbers stay."""
    once, more = (shape_features(profile_of(c)).as_dict() for c in (bell(2.0).contrast, factor * bell(2.0).contrast))
    for name, value in more.items():
        is_light = name.startswith(("peak_contrast", "total_contrast", "gaussian_peak"))
        assert value == pytest.approx(once[name] * (factor if is_light else 1.0), rel=1e-6, abs=1e-9), name


@pytest.mark.parametrize("contrast", [0.0, -0.1])
def test_without_an_inclusion_only_peak_and_integral_are_numbers(contrast):
    found = shape_features(profile_of(contrast)).as_dict()
    for name, value in found.items():
        assert math.isfinite(value) == name.startswith(("peak_contrast_", "total_contrast_")), name


@pytest.mark.parametrize(("share", "is_inclusion"), [(0.99, False), (1.01, True)])
def test_a_peak_within_the_noise_is_no_inclusion(share, is_inclusion):
    noise = 0.001
    found = shape_features(profile_of(share * NOISE_MULTIPLE * np.exp(-(R**2) / 8) * noise, residual=noise))
    assert np.isfinite(found.gaussian_sigma_mm).all() == is_inclusion
    assert np.isfinite(found.centroid_offset_mm).all() == is_inclusion
    assert math.isfinite(found.mean_centroid_offset_mm) == is_inclusion


def test_a_spot_wider_than_the_window_has_no_width_but_moments():
    found = shape_features(profile_of(1 - 0.01 * R))
    assert np.isnan(found.full_width_half_maximum_mm).all()
    assert np.isfinite(found.mean_radius_mm).all()


@pytest.mark.parametrize("contrast", [R / 9, np.exp(-(R**2) / (2 * (0.5 * SIGMAS_MM[0]) ** 2)), 1 - (R / 9) ** 2])
def test_what_is_no_gaussian_of_the_searched_widths_has_none(contrast):
    assert all(math.isnan(value) for value in fit_gaussian(contrast))


def test_every_number_has_a_unit_and_a_sentence():
    names = list(shape_features(bell(2.0)).as_dict())
    expected = [f"{name}_{force:.2f}_n" for name in RAMP_FEATURES for force in PROFILE_FORCES_N]
    assert names == [*expected, *PRESS_FEATURES]
    assert tuple(PAPER_FEATURES) == FEATURE_NAMES
    assert {name.split("_")[0] for name in ROW_NAMES} == set(PROFILE_FEATURES)
    groups = (INCLUSION_FIELD_FEATURES, PAPER_FEATURES, PROFILE_FEATURES, HELD_FEATURES, RAMP_FEATURES, PRESS_FEATURES)
    for name, definition in (item for group in groups for item in group.items()):
        assert definition.sentence.endswith("."), name
        assert definition.unit in {"1", "N", "mm", "mm2", "mm3", "1/N", "mm/N"}, name


def test_a_name_without_a_definition_is_refused():
    assert definition_of("contrast_0.40_n_0.9_mm", PROFILE_FEATURES).unit == "1"
    with pytest.raises(KeyError, match="contrasts"):
        definition_of("contrasts_0.40_n", PROFILE_FEATURES)
