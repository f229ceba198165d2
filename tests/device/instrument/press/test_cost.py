"""What each mode costs on a probe with the default settings."""

from dataclasses import replace

import pytest

from device.config import CameraSection, Config
from device.instrument.press.cost import PressCost, press_cost
from device.measurement.mode import FRAMES, MODES


@pytest.mark.parametrize("mode", MODES)
def test_a_mode_costs_the_frames_it_needs(mode):
    assert press_cost(mode, Config()).frames == FRAMES[mode].count


def test_a_hold_takes_its_frames_after_a_steady_moment():
    """0.15 s of steady force, and 10 frames at 30 Hz."""
    assert press_cost("paper", Config()) == PressCost("paper", 10, "hold", 0.5, 0.5, 0.5)


def test_a_ramp_takes_as_long_as_a_hand_at_half_of_the_largest_rate():
    """0.52 N at 0.175 N/s."""
    assert press_cost("standard", Config()) == PressCost("standard", 10, "ramp", 0.08, 0.60, 3.0)


def test_a_slow_camera_makes_a_ramp_longer():
    """40 frames at 5 Hz."""
    config = replace(Config(), camera=CameraSection(frame_rate_hz=5.0))
    assert press_cost("precise", config).seconds == 8.0
