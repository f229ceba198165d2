"""Which frame of a hold is unlike the others, and that a hand's own tremor makes none."""

import numpy as np
import pytest

from device.instrument.press.frame_outliers import DEVIATION_RATIO, FEWEST_FRAMES, worst_outlier
from device.measurement.recording.tactile_image import Frame

DARK_COUNTS = 4.0
ROWS, COLUMNS = np.mgrid[0:48, 0:64]
FACE = 1 - ((ROWS - 24) ** 2 + (COLUMNS - 32) ** 2) / 4000


def hold(count=10, spread_ratio=0.04, noise_counts=1.5, seed=1):
    """Return frames whose force wanders evenly over a band of forces, with light in proportion to force ** 0.8."""
    rng = np.random.default_rng(seed)
    forces_n = 0.5 * (1 + spread_ratio * np.linspace(-1, 1, count))
    frames = []
    for force_n in rng.permutation(forces_n):
        light = 120 * FACE * (force_n / 0.5) ** 0.8 + rng.normal(0, noise_counts, FACE.shape)
        frames.append(framed(light, float(force_n)))
    return frames


def framed(light, force_n):
    return Frame(np.clip(np.round(DARK_COUNTS + light), 0, 255).astype(np.uint8), "press", 0.0, force_n, (0.6,) * 4)


def brighter(frame, ratio, where=slice(None)):
    light = frame.counts - DARK_COUNTS
    light[:, where] *= ratio
    return framed(light, frame.force_n)


@pytest.mark.parametrize("seed", range(20))
def test_a_hand_that_wanders_over_the_whole_band_makes_no_outlier(seed):
    assert worst_outlier(hold(spread_ratio=0.05, seed=seed), DARK_COUNTS) is None


@pytest.mark.parametrize("ratio", [0.9, 1.1, 1.5])
@pytest.mark.parametrize("number", [0, 4, 9])
def test_a_frame_of_another_level_is_found_with_its_deviation(number, ratio):
    frames = hold()
    frames[number] = brighter(frames[number], ratio)
    outlier = worst_outlier(frames, DARK_COUNTS)
    assert outlier.frame is frames[number]
    assert outlier.deviation_ratio == pytest.approx(abs(ratio - 1), abs=0.05)


def test_a_frame_of_another_profile_is_found_although_its_level_is_that_of_the_others():
    """A fifth of the light of one half has gone to the other."""
    frames = hold()
    level = frames[3].counts.mean()
    frames[3] = brighter(brighter(frames[3], 0.8, slice(0, 32)), 1.2, slice(32, 64))
    assert frames[3].counts.mean() == pytest.approx(level, rel=0.005)
    assert worst_outlier(frames, DARK_COUNTS).frame is frames[3]


def test_of_two_the_worse_goes_first():
    frames = hold()
    frames[2], frames[7] = brighter(frames[2], 1.2), brighter(frames[7], 0.6)
    assert worst_outlier(frames, DARK_COUNTS).frame is frames[7]
    del frames[7]
    assert worst_outlier(frames, DARK_COUNTS).frame is frames[2]


def test_frames_that_are_all_alike_may_differ_by_the_bound():
    """Ten frames of one force without noise: the median deviation is nothing, and yet 4 % is not an outlier."""
    frames = hold(spread_ratio=0.0, noise_counts=0.0)
    frames[0] = brighter(frames[0], 1 + 0.8 * DEVIATION_RATIO)
    assert worst_outlier(frames, DARK_COUNTS) is None
    frames[0] = brighter(frames[1], 1 + 1.3 * DEVIATION_RATIO)
    assert worst_outlier(frames, DARK_COUNTS).frame is frames[0]


def test_of_a_few_frames_nobody_can_say_which_is_unlike_the_others():
    frames = hold(FEWEST_FRAMES - 1)
    frames[0] = brighter(frames[0], 2.0)
    assert worst_outlier(frames, DARK_COUNTS) is None


def test_dark_frames_are_not_judged():
    frames = [framed(np.zeros(FACE.shape), 0.5)] * 10
    assert worst_outlier(frames, DARK_COUNTS) is None
