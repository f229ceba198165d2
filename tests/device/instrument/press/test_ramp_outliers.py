"""Which frame of a ramp is unlike the course of the others: none of an honest press, and any that flashes."""

from dataclasses import replace

import numpy as np
import pytest

from device.instrument.press.frame_outliers import DEVIATION_RATIO, FEWEST_RAMP_FRAMES, ramp_outlier
from device.measurement.ramp_modes.noise import ErrorLevels
from device.measurement.recording.reference_light import EXPONENT
from device.measurement.recording.tactile_image import Frame
from host_tools.press_models.press_samples import draw_parameters
from host_tools.press_models.recorded_presses import recorded_press

DARK_COUNTS = 4.0
FORCES_N = np.linspace(0.08, 0.6, 10)


def flashed(frame, ratio):
    light = DARK_COUNTS + ratio * (frame.counts - DARK_COUNTS)
    return replace(frame, counts=np.clip(np.round(light), 0, 255).astype(np.uint8))


def ramp(forces_n=FORCES_N, seed=1):
    """Return frames whose light grows as 10 + 200 F - 80 F^2, with a camera's noise."""
    rng = np.random.default_rng(seed)
    light = [10 + 200 * force_n - 80 * force_n**2 + rng.normal(0, 1.5, (48, 64)) for force_n in forces_n]
    return [
        Frame(np.clip(np.round(DARK_COUNTS + one), 0, 255).astype(np.uint8), "press", 0.0, force_n, (0.6,) * 4)
        for one, force_n in zip(light, forces_n, strict=True)
    ]


@pytest.fixture(scope="module")
def honest_ramps(tables):
    """Frames of the press and of the one beside it, of random inclusions with every drift."""
    parameters = draw_parameters(8, np.random.default_rng(5))
    recordings = [recorded_press(tables, one, "standard", 1000 + i, levels=ErrorLevels()) for i, one in
                  enumerate(parameters)]  # fmt: skip
    return [
        [frame for frame in recording.frames if frame.role == role and frame.force_n > 0.02]
        for recording in recordings
        for role in ("reference", "press")
    ]


def test_an_honest_press_on_any_inclusion_has_no_outlier(honest_ramps):
    assert [ramp_outlier(frames, DARK_COUNTS) for frames in honest_ramps] == [None] * len(honest_ramps)


@pytest.mark.parametrize("ratio", [0.85, 1.15])
def test_a_flash_of_a_seventh_is_found_in_any_frame_of_an_honest_press(honest_ramps, ratio):
    for frames in honest_ramps:
        for number, frame in enumerate(frames):
            changed = [*frames[:number], flashed(frame, ratio), *frames[number + 1 :]]
            assert ramp_outlier(changed, DARK_COUNTS).frame is changed[number], number


@pytest.mark.parametrize("number", [0, 1, 5, 9])
def test_the_deviation_is_that_from_what_the_others_say_of_the_force(number):
    """A fifth less of one frame is a fifth of that force's light, of the mean light, as well as courses tell it."""
    frames = ramp()
    at_one_force = [(one.counts.mean() - DARK_COUNTS) / one.force_n**EXPONENT for one in frames]
    frames[number] = flashed(frames[number], 0.8)
    found = ramp_outlier(frames, DARK_COUNTS)
    assert found.frame is frames[number]
    assert found.deviation_ratio == pytest.approx(0.2 * at_one_force[number] / np.mean(at_one_force), abs=0.02)


def test_a_deviation_below_the_bound_is_none_however_smooth_the_others_are():
    frames = ramp()
    frames[4] = flashed(frames[4], 1 - 0.7 * DEVIATION_RATIO)
    assert ramp_outlier(frames, DARK_COUNTS) is None


def test_of_a_few_frames_nobody_can_say_which_is_unlike_the_others():
    frames = ramp(np.linspace(0.08, 0.6, FEWEST_RAMP_FRAMES - 1))
    frames[3] = flashed(frames[3], 1.5)
    assert ramp_outlier(frames, DARK_COUNTS) is None


@pytest.mark.parametrize("exponent", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("forces_n", [FORCES_N, np.linspace(0.06, 0.62, 40)])
def test_light_that_follows_any_power_of_the_force_that_contact_knows_has_no_outlier(exponent, forces_n):
    frames = [
        replace(frame, counts=np.full((48, 64), round(DARK_COUNTS + 200 * frame.force_n**exponent), np.uint8))
        for frame in ramp(forces_n)
    ]
    assert ramp_outlier(frames, DARK_COUNTS) is None


def test_light_that_no_force_changes_is_none():
    """Gel on the face: a fault of its own, that needs all frames."""
    wet = [replace(frame, counts=np.full((48, 64), 120, np.uint8)) for frame in ramp()]
    assert ramp_outlier(wet, DARK_COUNTS) is None


def test_dark_frames_are_not_judged():
    dark = [replace(frame, counts=np.full((48, 64), DARK_COUNTS, np.uint8)) for frame in ramp()]
    assert ramp_outlier(dark, DARK_COUNTS) is None
