"""Noise and hot pixels of made-up dark frames, whose noise is known."""

import numpy as np
import pytest

from device.instrument.self_test.checks import LEAST_NOISE_COUNTS, camera_results

SHAPE = 100, 100


@pytest.fixture
def judge():
    """Return the results of eight dark frames by check: level 8 counts, a noise, hot pixels."""

    def judging(noise_counts=0.0, hot=0, level=8.0):
        rng = np.random.default_rng(3)
        frames = level + noise_counts * rng.standard_normal((8, *SHAPE))
        frames[:, 0, :hot] = 200.0
        counts = np.clip(np.rint(frames), 0, 255).astype(np.uint8)
        return {result.check: result for result in camera_results(counts, 12.0)}

    return judging


@pytest.mark.parametrize(("noise_counts", "verdict"), [(1.0, "passed"), (2.0, "failed")])
def test_the_noise_is_that_of_the_frames_rounding_included(judge, noise_counts, verdict):
    """Rounding adds 1/12 count^2."""
    noise = judge(noise_counts)["noise"]
    assert noise.value == pytest.approx(np.hypot(noise_counts, 12**-0.5), rel=0.02)
    assert noise.verdict == verdict


def test_a_noise_that_rounding_hides_is_not_said_to_be_none(judge):
    assert judge(0.05)["noise"].value == LEAST_NOISE_COUNTS == pytest.approx(0.49, abs=0.001)


@pytest.mark.parametrize(("hot", "verdict"), [(0, "passed"), (2, "passed"), (3, "failed")])
def test_hot_pixels_are_counted(judge, hot, verdict):
    """Of 10 000 pixels two may be hot."""
    result = judge(1.0, hot)["hot pixels"]
    assert result.value == pytest.approx(hot / 1e4)
    assert result.verdict == verdict


def test_hot_pixels_are_no_noise(judge):
    frames = judge(1.0, 2)["noise"].value
    assert frames == pytest.approx(judge(1.0)["noise"].value, rel=0.01)


@pytest.mark.parametrize(("level", "verdict"), [(8.0, "passed"), (14.0, "failed")])
def test_frames_that_are_not_dark_fail(judge, level, verdict):
    assert judge(level=level)["dark level"].verdict == verdict
