"""Which frames count: a press is a list of forces here, one a frame, and time passes only from frame to frame."""

import types

import numpy as np
import pytest

from device.config import LightSection, PressSection
from device.instrument import capture as capture_module
from device.instrument.bench import DARK
from device.instrument.capture import UNLOADED_FRAMES, Capture, PressEnded
from device.instrument.guidance import Guidance
from device.instrument.status import StatusBoard
from device.measurement.tactile_image import Frame

PRESS = PressSection(target_n=0.5, band_ratio=0.05, contact_n=0.05, overload_n=1.0, frames=3, timeout_s=10.0)
LIGHT = LightSection(ratio=(0.1, 0.2, 0.3, 0.4))
FRAME_S = 0.5


class ScriptedBench:
    """Gives one frame for each force of a script; a force of 'shaking' frames is not steady."""

    def __init__(self, forces, shaking=()):
        self.forces, self.shaking = list(forces), set(shaking)
        self.taken, self.lights, self.now_s = 0, [], 0.0
        self.force = self

    def light(self, ratio):
        self.lights.append(ratio)

    def take(self, role):
        self.now_s += FRAME_S
        force_n = self.forces[min(self.taken, len(self.forces) - 1)]
        self.taken += 1
        return Frame(np.zeros((16, 16), np.uint8), role, float(self.taken), force_n, self.lights[-1])

    def is_steady(self, t_s, steady_n):
        return t_s not in self.shaking

    @property
    def latest_n(self):
        return self.forces.pop(0)

    def pass_time(self, seconds):
        self.now_s += seconds


@pytest.fixture
def capture_of(monkeypatch):
    def capture(*forces, shaking=()):
        bench = ScriptedBench(forces, shaking)
        clock = types.SimpleNamespace(monotonic=lambda: bench.now_s, sleep=bench.pass_time)
        monkeypatch.setattr(capture_module, "time", clock)
        return Capture(bench, PRESS, LIGHT, StatusBoard())

    return capture


def times_of(frames):
    return [frame.t_s for frame in frames]


def test_only_frames_in_the_force_band_count(capture_of):
    """0.474 and 0.526 N are just outside 0.5 N +- 5 %."""
    frames = capture_of(0.0, 0.3, 0.5, 0.474, 0.475, 0.526, 0.525).loaded("press", Guidance.PRESS_LESION)
    assert times_of(frames) == [3, 5, 7]
    assert {frame.role for frame in frames} == {"press"}


def test_a_force_that_only_passes_through_the_band_does_not_count(capture_of):
    frames = capture_of(0.5, 0.5, 0.5, 0.5, 0.5, shaking=(1, 3)).loaded("press", Guidance.PRESS_LESION)
    assert times_of(frames) == [2, 4, 5]


def test_a_hand_that_lifts_early_begins_again(capture_of):
    frames = capture_of(0.5, 0.5, 0.04, 0.5, 0.5, 0.5).loaded("press", Guidance.PRESS_LESION)
    assert times_of(frames) == [4, 5, 6]


def test_a_hand_that_leaves_the_band_but_not_the_skin_keeps_its_frames(capture_of):
    frames = capture_of(0.5, 0.5, 0.06, 0.5).loaded("press", Guidance.PRESS_LESION)
    assert times_of(frames) == [1, 2, 4]


def test_the_screen_is_told_at_every_frame(capture_of):
    capture, told = capture_of(0.0, 0.3, 0.6, 0.5), []
    capture.board.on_guidance(told.append)
    capture.loaded("reference", Guidance.PRESS_BESIDE)
    assert told == [Guidance.PRESS_BESIDE, Guidance.PRESS_HARDER, Guidance.PRESS_LIGHTER, Guidance.HOLD_STILL]
    assert capture.board.now.frames_taken == 3


def test_frames_are_taken_under_the_configured_light(capture_of):
    frames = capture_of(0.5).loaded("press", Guidance.PRESS_LESION)
    assert {frame.led_ratio for frame in frames} == {(0.1, 0.2, 0.3, 0.4)}


def test_too_much_force_rejects_the_press_with_both_numbers(capture_of):
    with pytest.raises(PressEnded, match=r"rose to 1\.25 N, above 1\.00 N") as end:
        capture_of(0.5, 0.5, 1.25).loaded("press", Guidance.PRESS_LESION)
    assert end.value.state == "rejected"


def test_the_overload_itself_is_still_bearable(capture_of):
    assert len(capture_of(1.0, 0.5).loaded("press", Guidance.PRESS_LESION)) == 3


def test_a_press_that_never_comes_is_rejected_after_the_timeout(capture_of):
    """10 s are 20 frames; the 21st is too late."""
    capture = capture_of(0.0)
    with pytest.raises(PressEnded, match="No press came for 10 s") as end:
        capture.loaded("press", Guidance.PRESS_LESION)
    assert end.value.state == "rejected"
    assert capture.bench.taken == 21


def test_the_time_counts_from_the_last_contact(capture_of):
    """15 frames without contact, one with, and 15 more: neither pause is too long."""
    forces = [0.0] * 15 + [0.3] + [0.0] * 15 + [0.5]
    assert len(capture_of(*forces).loaded("press", Guidance.PRESS_LESION)) == 3


@pytest.mark.parametrize(("flag", "state"), [("cancelled", "cancelled"), ("stopping", "failed")])
def test_a_press_that_is_cancelled_or_stopped_ends_before_the_next_frame(capture_of, flag, state):
    capture = capture_of(0.5)
    getattr(capture, flag).set()
    with pytest.raises(PressEnded) as end:
        capture.loaded("press", Guidance.PRESS_LESION)
    assert end.value.state == state
    assert end.value.reason
    assert capture.bench.taken == 0


def test_unloaded_frames_are_dark_then_lit_and_the_light_goes_off(capture_of):
    capture = capture_of(0.0, 0.01)
    frames = capture.unloaded()
    assert [frame.role for frame in frames] == ["dark"] * UNLOADED_FRAMES + ["reference"] * UNLOADED_FRAMES
    assert {frame.led_ratio for frame in frames if frame.role == "dark"} == {DARK}
    assert {frame.led_ratio for frame in frames if frame.role == "reference"} == {(0.1, 0.2, 0.3, 0.4)}
    assert capture.bench.lights[-1] == DARK


def test_unloaded_frames_wait_in_the_dark_until_the_probe_is_lifted(capture_of):
    """0.049 N, just below the threshold of contact, is the first that counts as lifted."""
    capture = capture_of(0.5, 0.2, 0.05, 0.049, 0.0)
    frames = capture.unloaded()
    assert capture.bench.lights[0] == DARK
    assert {frame.force_n for frame in frames} == {0.0}


def test_a_probe_that_is_never_lifted_does_not_keep_the_daemon_from_stopping(capture_of):
    capture = capture_of(0.5)
    capture.stopping.set()
    assert len(capture.unloaded()) == 2 * UNLOADED_FRAMES
    assert len(capture.bench.forces) == 1


def test_between_two_presses_the_light_is_off_until_the_probe_is_lifted(capture_of):
    capture = capture_of(0.5, 0.2, 0.05, 0.049, 9.9)
    capture.lifted()
    assert capture.bench.lights == [DARK]
    assert capture.bench.forces == [9.9]


def test_a_probe_that_is_not_lifted_between_two_presses_is_rejected_after_the_timeout(capture_of):
    """20 ms a poll: the timeout of 10 s is over at the 501st."""
    capture = capture_of(*[0.5] * 1000)
    with pytest.raises(PressEnded, match="not lifted for 10 s") as end:
        capture.lifted()
    assert end.value.state == "rejected"
    assert 1000 - len(capture.bench.forces) == pytest.approx(501, abs=1)


@pytest.mark.parametrize(("flag", "state"), [("cancelled", "cancelled"), ("stopping", "failed")])
def test_a_press_can_be_cancelled_or_stopped_before_the_probe_is_lifted(capture_of, flag, state):
    capture = capture_of(*[0.5] * 5)
    getattr(capture, flag).set()
    with pytest.raises(PressEnded) as end:
        capture.lifted()
    assert end.value.state == state
