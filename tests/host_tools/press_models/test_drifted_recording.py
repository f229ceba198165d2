"""Drift put into recordings of even light: of the stated size, in the stated frames, and nothing else."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.ramp_modes.radial_profile import PROFILE_FORCES_N
from device.measurement.recording.pixel_scale import PixelScale
from device.measurement.recording.recording import CameraSettings, Recording
from device.measurement.recording.tactile_image import Frame, Role
from host_tools.press_models.recorded_presses import drifted, smooth_field

SHAPE = (48, 64)
SEEDS = 400


def levels(**some: float) -> ErrorLevels:
    none = {"gain_ratio": 0.0, "zero_n": 0.0, "flat_field_ratio": 0.0, "model_ratio": 0.0}
    return ErrorLevels(**(none | some))


def flat_recording(
    pressed: Sequence[tuple[float, int]],
    *,
    role: Role = "press",
    dark: int = 10,
    bits: int = 8,
    shape: tuple[int, int] = SHAPE,
) -> Recording:
    """Two dark frames, one reference frame, and frames of a role of (force in N, counts), each of one brightness."""
    frames = [("dark", 0.0, dark)] * 2 + [("reference", 0.3, dark + 50)] + [(role, *one) for one in pressed]
    kind = np.uint8 if bits == 8 else np.uint16
    light = (0.6, 0.6, 0.6, 0.6)
    return Recording(
        id="flat",
        serial="SIM-0001",
        software="1",
        started_at="1970-01-01T00:00:00.000Z",
        camera=CameraSettings(shape[1], shape[0], bits, 0.5, 0.25, 4000.0, 1.0),
        frames=tuple(
            Frame(np.full(shape, counts, kind), role, 0.0, force_n, light) for role, force_n, counts in frames
        ),
    )


def added_ratio(recording: Recording, made: Recording, dark: int) -> np.ndarray:
    """Return what the last frames gained [n, height, width], all but the first three, over their light above dark."""
    before, after = (np.array([f.counts for f in one.frames[3:]], float) for one in (recording, made))
    return (after - before) / (before - dark)


def drift(recording: Recording, seed: int, **some: float) -> Recording:
    return drifted(recording, np.random.default_rng(seed), levels(**some))


def correlation(field: np.ndarray, rows: int, columns: int) -> float:
    """Return the mean product of a field [height, width] and itself so many pixels further."""
    height, width = field.shape
    return float(np.mean(field[rows:, columns:] * field[: height - rows, : width - columns], dtype=np.float64))


@pytest.mark.parametrize("length_mm", [2.0, 3.0])
def test_a_smooth_field_has_variance_1_and_the_correlation_of_a_gaussian(length_mm):
    """Over 240 x 240 mm some thousand patches are independent; pixels of 0.4 x 0.6 mm."""
    field = smooth_field((400, 600), PixelScale(0.4, 0.6), length_mm, np.random.default_rng(1))
    assert field.shape == (400, 600)
    assert field.mean() == pytest.approx(0, abs=0.1)
    assert correlation(field, 0, 0) == pytest.approx(1.0, abs=0.08)
    for rows, columns in ((0, 5), (5, 0), (3, 4), (0, 10), (8, 0)):
        distance_mm = np.hypot(0.4 * columns, 0.6 * rows)
        expected = np.exp(-(distance_mm**2) / (2 * length_mm**2))
        assert correlation(field, rows, columns) == pytest.approx(expected, abs=0.06)


def test_a_fields_variance_does_not_depend_on_the_place_in_the_image():
    """The edges too: of 400 draws a variance strays by 7 %."""
    rng = np.random.default_rng(2)
    fields = np.array([smooth_field(SHAPE, PixelScale(0.5, 0.25), 2.0, rng) for _ in range(SEEDS)])
    corner, edge, middle = fields[:, 0, 0], fields[:, -1, 32], fields[:, 24, 32]
    assert [np.mean(one**2) for one in (corner, edge, middle)] == pytest.approx([1.0] * 3, abs=0.3)


def test_gain_zero_and_flat_field_change_press_frames_only():
    recording = flat_recording([(0.2, 110), (0.4, 160)])
    made = drift(recording, 1, gain_ratio=0.1, zero_n=0.05, flat_field_ratio=0.01)
    assert all(found is frame for frame, found in zip(recording.with_role("dark"), made.with_role("dark"), strict=True))
    for frame, found in zip(recording.with_role("reference"), made.with_role("reference"), strict=True):
        np.testing.assert_array_equal(found.counts, frame.counts)
        assert found.force_n == frame.force_n
    for frame, found in zip(recording.with_role("press"), made.with_role("press"), strict=True):
        assert (found.counts != frame.counts).mean() > 0.5
        assert found.force_n != frame.force_n
    assert (made.id, made.camera, made.truth) == (recording.id, recording.camera, recording.truth)


def test_light_that_drifts_raises_light_above_dark_by_one_ratio_everywhere():
    recording = flat_recording([(0.2, 10_000), (0.4, 30_000), (0.4, 50_000)], dark=2000, bits=16)
    ratio = added_ratio(recording, drift(recording, 3, gain_ratio=0.1), 2000)
    assert abs(ratio.mean()) > 0.01
    assert np.ptp(ratio) < 2 / 8000
    np.testing.assert_allclose(ratio.mean(axis=(1, 2)), ratio.mean(), atol=1e-5)


def test_over_many_presses_the_light_drifts_by_the_stated_standard_deviation():
    """Of 400 draws a standard deviation strays by 3.5 %, a mean by a twentieth of it."""
    recording = flat_recording([(0.4, 50_000)], dark=2000, bits=16, shape=(16, 16))
    gain = [added_ratio(recording, drift(recording, seed, gain_ratio=0.02), 2000).mean() for seed in range(SEEDS)]
    assert np.std(gain) == pytest.approx(0.02, rel=0.12)
    assert np.mean(gain) == pytest.approx(0, abs=0.02 * 4 / np.sqrt(SEEDS))


def test_a_part_of_a_count_is_not_lost_but_kept_on_average():
    """The bright frame tells the ratio; of 4 counts it is less than half a count, which plain rounding would lose."""
    recording = flat_recording([(0.4, 210), (0.4, 14)])
    bright, dim = added_ratio(recording, drift(recording, 3, gain_ratio=0.04), 10)
    assert 0.01 < abs(bright.mean()) < 0.1
    assert 4 * dim.mean() == pytest.approx(4 * bright.mean(), abs=0.04)
    assert len(np.unique(dim)) == 2


def test_without_any_drift_nothing_changes():
    recording = flat_recording([(0.2, 110), (0.4, 255)])
    made = drift(recording, 1)
    for frame, found in zip(recording.frames, made.frames, strict=True):
        assert found.force_n == frame.force_n
        assert np.abs(found.counts.astype(float) - frame.counts).mean() < 1e-3


def test_a_zero_that_drifts_moves_the_reported_force_of_every_press_frame_alike_and_no_light():
    recording = flat_recording([(0.2, 110), (0.4, 160), (0.6, 180)])
    shifts = []
    for seed in range(SEEDS):
        made = drift(recording, seed, zero_n=0.01)
        moved = [b.force_n - a.force_n for a, b in zip(recording.frames, made.frames, strict=True)]
        assert moved[:3] == [0.0] * 3
        assert moved[3:] == pytest.approx([moved[3]] * 3)
        shifts.append(moved[3])
    assert np.abs(added_ratio(recording, made, 10)).mean() < 1e-4
    assert np.std(shifts) == pytest.approx(0.01, rel=0.12)


def test_a_flat_field_that_moved_is_the_same_in_every_press_frame():
    recording = flat_recording([(0.12, 20_000), (0.55, 50_000)], dark=2000, bits=16)
    weak, strong = added_ratio(recording, drift(recording, 4, flat_field_ratio=0.05), 2000)
    np.testing.assert_allclose(weak, strong, atol=2 / 18_000)
    assert 0.02 < strong.std() < 0.1


def test_a_models_error_is_of_the_reference_another_one_at_each_force_of_the_profile_and_cubic_between():
    """Beyond the profile's forces it stays what it is at the last."""
    between_n = (0.18, 0.3, 0.5)
    forces_n = (*PROFILE_FORCES_N, *between_n, 0.12, 0.62)
    recording = flat_recording([(force_n, 42_000) for force_n in forces_n], role="reference", dark=2000, bits=16)
    error = added_ratio(recording, drift(recording, 5, model_ratio=0.05), 2000).reshape(len(forces_n), -1)
    own, inside, first, beyond = np.split(error, (4, 7, 8))
    correlated = np.corrcoef(own)[np.triu_indices(4, 1)]
    assert np.abs(correlated).max() < 0.9
    assert 0.02 < own.std() < 0.1
    cubic = np.polynomial.polynomial.polyfit(PROFILE_FORCES_N, own, 3)
    np.testing.assert_allclose(inside, np.polynomial.polynomial.polyval(between_n, cubic).T, atol=4 / 40_000)
    np.testing.assert_allclose(first[0], own[0], atol=2 / 40_000)
    np.testing.assert_allclose(beyond[0], own[3], atol=2 / 40_000)


@pytest.mark.parametrize(("bits", "top"), [(8, 255), (16, 65535)])
def test_counts_stay_within_what_the_camera_can_say(bits, top):
    recording = flat_recording([(0.4, top - 1), (0.4, 0)], bits=bits)
    for seed in range(10):
        full, none = (frame.counts for frame in drift(recording, seed, gain_ratio=0.5).with_role("press"))
        assert full.dtype == recording.frames[0].counts.dtype
        assert full.min() > 0.1 * top
        assert none.max() < 0.1 * top


def test_the_same_seed_drifts_the_same_and_another_one_otherwise():
    recording = flat_recording([(0.4, 160)])
    first, again, other = (
        drifted(recording, np.random.default_rng(seed), ErrorLevels(gain_ratio=0.1)).with_role("press")[0].counts
        for seed in (6, 6, 7)
    )
    np.testing.assert_array_equal(first, again)
    assert (first != other).any()


RAMPS = 3


def flat_scan(forces_n: Sequence[float] = (0.2, 0.4), counts: int = 42_000) -> Recording:
    """Return a scan of three ramps, each of a frame at every force, of one brightness; dark is 2000 of 16 bits."""
    one = flat_recording([(force_n, counts) for force_n in forces_n] * RAMPS, dark=2000, bits=16)
    frames = [
        replace(frame, ramp=(number - 3) // len(forces_n)) if frame.role == "press" else frame
        for number, frame in enumerate(one.frames)
    ]
    return replace(one, frames=tuple(frames))


def by_ramp(recording: Recording, made: Recording) -> np.ndarray:
    """Return what the ramps' frames gained [3, n, height, width] over their light above dark."""
    ratio = added_ratio(recording, made, 2000)
    return ratio.reshape(RAMPS, -1, *ratio.shape[1:])


def test_every_ramp_of_a_scan_has_a_drift_of_light_and_of_the_cells_zero_of_its_own():
    recording = flat_scan()
    made = drift(recording, 3, gain_ratio=0.1, zero_n=0.01)
    gain = by_ramp(recording, made).mean(axis=(2, 3))
    np.testing.assert_allclose(gain[:, 0], gain[:, 1], atol=1e-5)
    moved = [b.force_n - a.force_n for a, b in zip(recording.frames, made.frames, strict=True)]
    zero = np.reshape(moved[3:], (RAMPS, 2))
    np.testing.assert_allclose(zero[:, 0], zero[:, 1], atol=1e-12)
    assert moved[:3] == [0.0] * 3
    for own in (gain[:, 0], zero[:, 0]):
        assert len(np.unique(np.round(own, 6))) == RAMPS
    assert [f.ramp for f in made.frames] == [f.ramp for f in recording.frames]


def test_over_many_scans_the_ramps_drifts_are_as_large_as_stated_and_have_nothing_in_common():
    """Of 400 draws a standard deviation strays by 3.5 %, a correlation by 0.05."""
    recording = flat_scan(forces_n=(0.4,))
    small = replace(recording, frames=tuple(replace(f, counts=f.counts[:16, :16]) for f in recording.frames),
                    camera=replace(recording.camera, width_px=16, height_px=16))  # fmt: skip
    gain = np.array([
        by_ramp(small, drift(small, seed, gain_ratio=0.02)).mean(axis=(1, 2, 3)) for seed in range(SEEDS)
    ])  # fmt: skip
    np.testing.assert_allclose(gain.std(axis=0), 0.02, rtol=0.12)
    assert np.abs(np.corrcoef(gain.T)[np.triu_indices(RAMPS, 1)]).max() < 0.2


def test_all_ramps_of_a_scan_share_the_flat_field():
    recording = flat_scan()
    error = by_ramp(recording, drift(recording, 4, flat_field_ratio=0.05))
    np.testing.assert_allclose(error, np.broadcast_to(error[0, 0], error.shape), atol=2 / 40_000)
    assert 0.02 < error[0, 0].std() < 0.1


def test_a_flat_field_of_which_ramps_have_a_part_of_their_own_is_refused(recording):
    with pytest.raises(ValueError, match=r"share 0\.60"):
        drifted(recording, np.random.default_rng(1), ErrorLevels(flat_field_shared_ratio=0.6))


@pytest.mark.parametrize("shared", [0.0, 0.25, 1.0])
def test_of_the_models_error_ramps_have_their_own_part_and_the_reference_the_rest(shared):
    """Over many scans: variance 1 - shared of the level's square in each ramp, shared in the reference."""
    recording = flat_scan(forces_n=(PROFILE_FORCES_N[1],))
    reference = next(f for f in recording.frames if f.role == "reference")
    frames = (*recording.frames[:2], replace(reference, force_n=float(PROFILE_FORCES_N[1])), *recording.frames[3:])
    recording = replace(recording, frames=frames)
    own, common = [], []
    for seed in range(60):
        made = drift(recording, seed, model_ratio=0.05, model_shared_ratio=shared)
        own.append(by_ramp(recording, made)[:, 0, ::8, ::8].reshape(RAMPS, -1))
        common.append((made.frames[2].counts[::8, ::8] - 2050.0) / 50.0)
    assert np.mean(np.square(own)) == pytest.approx((1 - shared) * 0.05**2, rel=0.15, abs=1e-9)
    between = np.mean([first * second for first, second, _ in own])
    assert between == pytest.approx(0.0, abs=0.15 * 0.05**2)
    assert np.mean(np.square(common)) == pytest.approx(shared * 0.05**2, rel=0.2, abs=0.012**2)


def test_a_single_press_keeps_its_models_error_in_the_reference_wholly():
    recording = flat_recording([(0.25, 42_000)], dark=2000, bits=16)
    made = drift(recording, 5, model_ratio=0.05, model_shared_ratio=0.25)
    assert np.abs(added_ratio(recording, made, 2000)).max() < 2 / 40_000
