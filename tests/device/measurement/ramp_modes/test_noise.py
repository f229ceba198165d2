"""The noise model against direct averages over the angle, and what each kind of drift does to a row."""

from dataclasses import replace

import numpy as np
import pytest
from small_surrogate import COLUMNS, EXACT, white_noise

from device.measurement.ramp_modes.noise import (
    ErrorLevels,
    PressNoise,
    circle_correlation,
    drift_directions,
    harmonics_by_force,
    light_ratio,
    ring_correlation,
    smooth_errors,
)
from device.measurement.ramp_modes.radial_profile import CONTRAST, FIRST, PROFILE_FORCES_N, RESPONSE, SECOND
from device.measurement.ramp_modes.surrogate import CONTRAST_COLUMNS
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.ring_means import RING_MM, RING_RADII_MM, RINGS, ring_weights

POWER = 0.8


@pytest.fixture
def row() -> np.ndarray:
    """A random contrast on light that grows as the force to the power of 0.8."""
    row = np.random.default_rng(1).uniform(0.0, 0.5, COLUMNS)
    row[RESPONSE] = np.repeat(POWER * np.log(PROFILE_FORCES_N[:-1] / PROFILE_FORCES_N[-1]), RINGS)
    return row


def test_the_covariance_is_symmetric_and_positive_definite(row):
    covariance = white_noise(1e-4, ErrorLevels()).covariance(row)
    np.testing.assert_allclose(covariance, covariance.T, rtol=1e-12)
    assert np.linalg.eigvalsh(covariance).min() > 0.9e-8


def test_without_drift_and_smooth_errors_only_the_camera_is_left(row):
    """As large as the light is: white noise of 1e-3 where there is no contrast."""
    noise, light = white_noise(1e-3), light_ratio(row)
    np.testing.assert_allclose(noise.covariance(row), np.outer(light, light) * noise.camera, rtol=1e-14, atol=1e-30)


@pytest.mark.parametrize("length_mm", [1.0, 2.5, 6.0])
@pytest.mark.parametrize("harmonic", [0, 1, 2])
def test_the_correlation_of_circles_is_the_fields_averaged_over_both_angles(length_mm, harmonic):
    """They are a(r) = mean of 2 f(r, angle) cos(k angle), or without the 2 cos; trapezia are exact on a circle."""
    angle = 2 * np.pi * np.arange(256) / 256
    basis = np.ones_like(angle) if harmonic == 0 else 2 * np.cos(harmonic * angle)
    x, y = np.multiply.outer(RING_RADII_MM, (np.cos(angle), np.sin(angle))).transpose(1, 0, 2)
    expected = np.empty((RINGS, RINGS))
    for i in range(RINGS):
        for j in range(RINGS):
            distance2 = np.subtract.outer(x[i], x[j]) ** 2 + np.subtract.outer(y[i], y[j]) ** 2
            expected[i, j] = basis @ np.exp(-distance2 / (2 * length_mm**2)) @ basis / len(angle) ** 2
    found = circle_correlation(RING_RADII_MM, length_mm, harmonic=harmonic)
    np.testing.assert_allclose(found, expected, atol=1e-10)


@pytest.mark.parametrize("length_mm", [2.0, 3.0])
@pytest.mark.parametrize("harmonic", [0, 1, 2])
def test_the_correlation_of_rings_is_that_of_what_the_profile_reads_of_a_smooth_field(length_mm, harmonic):
    """The profile's own rings of every pixel's picture, times the field's correlation between any two pixels."""
    scale = PixelScale(0.3, 0.3)
    shape = 68, 68
    x, y = (part.ravel() for part in np.broadcast_arrays(*scale.coordinates_mm(shape)))
    rings, everywhere = ring_weights(shape, scale), np.ones(shape, bool)
    pixels = [rings.means(one.reshape(shape), everywhere) for one in np.eye(x.size, dtype=np.float32)]
    read = np.array([one.mean if harmonic == 0 else one.cosine[harmonic - 1] for one in pixels]).T
    seen = np.hypot(x, y) < RINGS * RING_MM
    distance2 = np.subtract.outer(x[seen], x[seen]) ** 2 + np.subtract.outer(y[seen], y[seen]) ** 2
    expected = read[:, seen] @ np.exp(-distance2 / (2 * length_mm**2)) @ read[:, seen].T
    np.testing.assert_allclose(ring_correlation(length_mm, harmonic=harmonic), expected, atol=0.01)


def test_a_field_that_is_the_same_everywhere_moves_all_rings_and_no_harmonic():
    np.testing.assert_allclose(ring_correlation(1e5, harmonic=0), 1.0, atol=1e-7)
    for harmonic in (1, 2):
        np.testing.assert_allclose(ring_correlation(1e5, harmonic=harmonic), 0.0, atol=1e-7)


def test_a_short_field_averages_out_along_a_circle_but_not_in_the_middle():
    """Far above its length a circle of radius r holds some sqrt(2 pi) r / length patches of their own."""
    length_mm = 0.05
    variance = np.diag(circle_correlation(RING_RADII_MM, length_mm, harmonic=0))
    assert variance[0] == pytest.approx(1.0, abs=1e-12)
    np.testing.assert_allclose(variance[1:], length_mm / (np.sqrt(2 * np.pi) * RING_RADII_MM[1:]), rtol=1e-3)


def test_more_light_moves_a_contrast_by_the_light_that_is_there(row):
    """(1 + g) (1 + c) - 1 = c + g (1 + c); it leaves the reference response; harmonics are part of a contrast."""
    gain, _ = drift_directions(row)
    np.testing.assert_allclose(gain[:CONTRAST_COLUMNS], 1 + row[:CONTRAST_COLUMNS], rtol=1e-14)
    np.testing.assert_array_equal(gain[RESPONSE], 0.0)
    np.testing.assert_array_equal(gain[RESPONSE.stop :], row[RESPONSE.stop :])


def test_a_harmonics_light_is_that_of_its_ring_and_force(row):
    """First harmonics have no ring in the middle, second ones neither that nor the outermost one."""
    light, contrast = light_ratio(row), row[:CONTRAST_COLUMNS].reshape(-1, RINGS)
    np.testing.assert_allclose(light[FIRST], 1 + contrast[:, 1:].ravel(), rtol=1e-14)
    np.testing.assert_allclose(light[SECOND], 1 + contrast[:, 1:-1].ravel(), rtol=1e-14)
    np.testing.assert_array_equal(light[RESPONSE], 1.0)


def test_a_drift_of_the_cells_zero_moves_harmonics_as_the_contrast_of_their_ring_and_force(row):
    """Light that is the same power of the force everywhere moves all of a ring by one ratio: -0.8 / F a newton."""
    _, zero = drift_directions(row)
    for columns in (FIRST, SECOND):
        per_n = np.repeat(-POWER / PROFILE_FORCES_N, (columns.stop - columns.start) // len(PROFILE_FORCES_N))
        np.testing.assert_allclose(zero[columns], row[columns] * per_n, rtol=1e-9)


def test_a_drift_of_the_cells_zero_looks_up_the_reference_at_another_force(row):
    """The reference's light is F^0.8: the contrast seen is (1 + c) (F / (F + dz))^0.8 - 1, to first order."""
    zero, step_n = drift_directions(row)[1][:CONTRAST_COLUMNS], 1e-6
    force_n = np.repeat(PROFILE_FORCES_N, RINGS)
    moved = (1 + row[:CONTRAST_COLUMNS]) * ((force_n / (force_n + step_n)) ** POWER - 1) / step_n
    np.testing.assert_allclose(zero, moved, rtol=1e-4)


def test_a_drift_of_the_cells_zero_matters_most_at_the_smallest_load(row):
    row[:CONTRAST_COLUMNS] = 0.0
    baseline = np.abs(drift_directions(row)[1][:CONTRAST_COLUMNS]).reshape(-1, RINGS)
    assert (np.diff(baseline, axis=0) < 0).all()


def test_drifts_of_many_rows_are_those_of_each(row):
    rows = np.stack([row, 0.5 * row])
    for together, alone in zip(drift_directions(rows), zip(*map(drift_directions, rows), strict=True), strict=True):
        np.testing.assert_allclose(together, np.stack(alone), rtol=1e-12)


def test_drifts_enter_the_covariance_with_their_levels(row):
    levels = replace(EXACT, gain_ratio=0.02)
    light = 1 + row[:CONTRAST_COLUMNS]
    covariance = white_noise(1e-3, levels).covariance(row)[:CONTRAST_COLUMNS, :CONTRAST_COLUMNS]
    expected = np.outer(light, light) * (4e-4 + 1e-6 * np.eye(CONTRAST_COLUMNS))
    np.testing.assert_allclose(covariance, expected, atol=1e-15)


def test_the_flat_field_is_common_to_all_loads_and_the_models_error_is_each_ones_own():
    first, second = slice(0, RINGS), slice(RINGS, 2 * RINGS)
    flat = smooth_errors(ErrorLevels(flat_field_ratio=0.01, model_ratio=0.0))
    model = smooth_errors(ErrorLevels(flat_field_ratio=0.0, model_ratio=0.01))
    np.testing.assert_array_equal(flat[first, second], flat[first, first])
    assert flat[0, 0] == pytest.approx(1e-4 * ring_correlation(ErrorLevels().flat_field_mm, harmonic=0)[0, 0])
    np.testing.assert_array_equal(model[first, second], 0.0)
    assert model[0, 0] == pytest.approx(1e-4 * ring_correlation(ErrorLevels().model_mm, harmonic=0)[0, 0])


@pytest.mark.parametrize(("columns", "harmonic", "rings"), [(FIRST, 1, np.s_[1:]), (SECOND, 2, np.s_[1:-1])])
def test_in_harmonics_too_the_flat_field_is_common_and_the_models_error_each_loads_own(columns, harmonic, rings):
    flat = smooth_errors(ErrorLevels(flat_field_ratio=0.01, model_ratio=0.0))[columns, columns]
    model = smooth_errors(ErrorLevels(flat_field_ratio=0.0, model_ratio=0.02))[columns, columns]
    of_flat, of_model = (
        ratio**2 * ring_correlation(length_mm, harmonic=harmonic)[rings, rings]
        for ratio, length_mm in ((0.01, ErrorLevels().flat_field_mm), (0.02, ErrorLevels().model_mm))
    )
    size = len(of_flat)
    assert flat.shape == model.shape == (4 * size, 4 * size)
    for load in range(4):
        for other in range(4):
            block = np.s_[size * load : size * (load + 1), size * other : size * (other + 1)]
            np.testing.assert_allclose(flat[block], of_flat, rtol=1e-14)
            np.testing.assert_allclose(model[block], of_model if other == load else 0.0, rtol=1e-14)
    both = smooth_errors(ErrorLevels(flat_field_ratio=0.01, model_ratio=0.02))[columns, columns]
    np.testing.assert_allclose(both, flat + model, rtol=1e-14)


def test_coarser_skin_has_more_of_its_own_and_the_face_its_flat_field():
    """A face of 0.3 and skin of 0.4 %, half of whose variance presses share: twice as coarse it is of 0.8 %."""
    levels = ErrorLevels(flat_field_ratio=0.005, flat_field_shared_ratio=(0.3**2 + 0.4**2 / 2) / 0.5**2)
    coarser = levels.on_coarser_skin(2.0)
    assert coarser.flat_field_ratio == pytest.approx(np.hypot(0.003, 0.008))
    assert coarser.flat_field_shared_ratio == pytest.approx((0.3**2 + 0.8**2 / 2) / (0.3**2 + 0.8**2))
    assert levels.on_coarser_skin(1.0) == levels
    assert ErrorLevels().on_coarser_skin(3.0) == ErrorLevels()  # the design's is the face's alone


def test_contrast_and_the_harmonics_share_no_smooth_error():
    """Means and waves of an isotropic field around a circle are uncorrelated."""
    kinds = slice(0, CONTRAST_COLUMNS), RESPONSE, FIRST, SECOND
    covariance = smooth_errors(ErrorLevels())
    for one in kinds:
        assert covariance[one, one].any()
        for other in kinds:
            assert one == other or not covariance[one, other].any()


def test_reference_response_is_a_ratio_to_the_largest_load_so_its_error_is_twice_and_shared():
    model = smooth_errors(ErrorLevels(flat_field_ratio=0.0, model_ratio=0.01))
    middle = model[RESPONSE, RESPONSE][::RINGS, ::RINGS]
    in_the_middle = ring_correlation(ErrorLevels().model_mm, harmonic=0)[0, 0]
    np.testing.assert_allclose(middle, 1e-4 * in_the_middle * (np.eye(3) + 1), rtol=1e-12)


def test_smooth_errors_grow_with_the_light_they_are_a_ratio_of():
    levels = replace(ErrorLevels(), gain_ratio=0.0, zero_n=0.0, force_n=0.0)
    camera = np.zeros((COLUMNS, COLUMNS))
    dark, bright = (PressNoise(camera, levels).covariance(np.full(COLUMNS, c)) for c in (0.0, 0.5))
    np.testing.assert_allclose(np.diag(bright)[:CONTRAST_COLUMNS], 2.25 * np.diag(dark)[:CONTRAST_COLUMNS], rtol=1e-12)
    np.testing.assert_allclose(np.diag(bright)[RESPONSE], np.diag(dark)[RESPONSE], rtol=1e-12)
    np.testing.assert_allclose(np.diag(bright)[RESPONSE.stop :], 2.25 * np.diag(dark)[RESPONSE.stop :], rtol=1e-12)
    assert np.diag(PressNoise(camera, EXACT).covariance(np.ones(COLUMNS))).max() == 0


def test_a_force_that_is_read_wrong_by_itself_moves_its_own_harmonics_in_proportion(row):
    _, zero = drift_directions(row)
    apart = harmonics_by_force(zero)
    np.testing.assert_array_equal(apart[CONTRAST], 0.0)
    for columns in (FIRST, SECOND):
        np.testing.assert_array_equal(apart[columns].sum(axis=-1), zero[columns])
        blocks = apart[columns].reshape(len(PROFILE_FORCES_N), -1, len(PROFILE_FORCES_N))
        for force, block in enumerate(blocks):
            np.testing.assert_array_equal(np.delete(block, force, axis=-1), 0.0)


def test_what_the_polynomials_miss_grows_with_the_contrast():
    """A row whose contrast is 0.04 everywhere: its error's variance is that of a contrast of 1, times 0.04."""
    row = np.zeros(COLUMNS)
    row[CONTRAST] = 0.04
    forward = np.diag(np.arange(1.0, COLUMNS + 1))
    missed = PressNoise(np.eye(COLUMNS), EXACT, forward).covariance(row) - PressNoise(
        np.eye(COLUMNS), EXACT
    ).covariance(row)
    np.testing.assert_allclose(np.diag(missed), 0.04 * light_ratio(row) ** 2 * np.diag(forward))
    assert not (missed - np.diag(np.diag(missed))).any()
