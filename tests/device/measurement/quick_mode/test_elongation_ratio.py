"""How far from round a bright spot is."""

import numpy as np
import pytest

from device.measurement.quick_mode.profile import NOISE_CONTRAST, OFFSETS_SHARE, elongation_ratio


def test_a_spot_in_the_middle_is_compared_with_noise():
    assert elongation_ratio(np.full(10, 2 * NOISE_CONTRAST), np.zeros(10)) == pytest.approx(2.0)


def test_a_spot_aside_may_have_a_share_of_its_first_harmonic():
    """Where the first harmonic is 1 and noise forgotten, the share itself is the ratio 1."""
    assert elongation_ratio(np.full(10, OFFSETS_SHARE), -np.ones(10)) == pytest.approx(1.0, rel=0.02)


def test_the_root_mean_square_counts_whatever_the_sign():
    waves = np.array([3.0, -4.0]) * NOISE_CONTRAST
    assert elongation_ratio(waves, np.zeros(2)) == pytest.approx(np.sqrt(12.5))
