"""How long a face is lit: by a hand that presses, and while nobody touches it. In simulated time."""

from __future__ import annotations

import re

import pytest
from daemon_process import ROOT
from simulated_time_bench import CAMERA, SimulatedTimePress

from device.config import Config, LightSection
from device.instrument.press.capture import WOKEN_S
from device.simulation.hand import HandSettings

CONFIG = Config(camera=CAMERA)
FRAME_S = 1 / CAMERA.frame_rate_hz
NOBODY = HandSettings(aim_n=0.0, tremor_n=0.0, drift_n=0.0)


@pytest.fixture
def pressing(monkeypatch):
    return SimulatedTimePress(monkeypatch, CONFIG)


@pytest.mark.parametrize("mode", ["quick", "paper", "standard", "precise"])
def test_the_light_that_a_press_takes_is_that_of_the_page(pressing, mode):
    pressed = pressing.press(HandSettings(), mode)
    page = (ROOT / "docs" / "press.md").read_text(encoding="utf-8")
    [stated_s] = re.findall(rf"^\| {mode} \| ([0-9.]+) s \|", page, re.MULTILINE)
    assert pressed.is_accepted
    assert pressed.light_on_s == pytest.approx(float(stated_s), abs=0.1)


def test_a_press_that_nobody_touches_waits_in_the_dark(pressing):
    pressed = pressing.press(NOBODY, "paper")
    assert pressed.reason == "No press came for 60 s: begin again."
    assert pressed.seconds > CONFIG.press.timeout_s
    assert pressed.light_on_s == pytest.approx(CONFIG.light.untouched_s, abs=2 * FRAME_S)


def test_a_touch_after_a_wait_in_the_dark_is_measured_as_any_other(pressing):
    late = HandSettings(reaction_s=5.0)
    assert late.reaction_s == CONFIG.light.untouched_s
    pressed, soon = pressing.press(late, "standard"), pressing.press(HandSettings(), "standard")
    assert pressed.is_accepted, pressed.reason
    assert pressed.seconds - soon.seconds > 2 * (late.reaction_s - HandSettings().reaction_s)
    # In each of the two it is lit for as long as nobody may touch, for a moment of what wakes it, and while a hand
    # that touches takes its time to go on.
    assert pressed.light_on_s - soon.light_on_s < 2 * (CONFIG.light.untouched_s + WOKEN_S + late.reaction_s)


@pytest.mark.parametrize("resting_n", [0.03, 0.045])
def test_what_rests_on_the_face_with_less_than_a_contact_does_not_keep_it_lit(pressing, resting_n):
    resting = HandSettings(held_n=resting_n, aim_n=resting_n, tremor_n=0.0, drift_n=0.0)
    pressed = pressing.press(resting, "paper")
    assert "No press came" in pressed.reason
    assert pressed.light_on_s < CONFIG.light.untouched_s + WOKEN_S + 2 * FRAME_S


def test_a_zero_just_above_a_contact_does_not_keep_it_lit(pressing):
    resting = HandSettings(held_n=0.06, aim_n=0.06, tremor_n=0.0, drift_n=0.0)
    pressed = pressing.press(resting, "paper")
    assert "stayed below" in pressed.reason
    assert pressed.seconds > CONFIG.press.timeout_s
    assert pressed.light_on_s < CONFIG.light.untouched_s + WOKEN_S + 2 * FRAME_S


@pytest.mark.parametrize("reaction_s", [0.05, 0.3, 1.0])
@pytest.mark.parametrize("ramp_rate_n_per_s", [0.01, 0.0105, 0.012])
def test_a_hand_so_slow_that_the_light_goes_out_at_its_first_touch_is_led_on(pressing, ramp_rate_n_per_s, reaction_s):
    """It touches with 0.06 N after 5 to 7 s, when it is dark, and waits to be told to press on."""
    slow = HandSettings(reaction_s=reaction_s, ramp_rate_n_per_s=ramp_rate_n_per_s, tremor_n=0.0, drift_n=0.0)
    pressed = pressing.press(slow, "standard")
    assert pressed.is_accepted, pressed.reason


def test_presses_that_nobody_touches_light_the_face_once_for_all_of_them(pressing):
    """As an endless loop of requests does: the next one finds the light of those before spent, until a touch."""
    capture, first_s = None, 0.0
    for number in range(5):
        pressed, capture = pressing.press_again(NOBODY, "paper", capture)
        first_s = first_s or pressed.light_on_s
        assert "No press came" in pressed.reason
        if number:
            assert pressed.light_on_s < 2 * FRAME_S
    assert first_s == pytest.approx(LightSection().untouched_s, abs=2 * FRAME_S)
