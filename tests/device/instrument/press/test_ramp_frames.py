"""Which frames of a slow press count: one for each of five forces, 0.1 to 0.5 N, told as a list of forces."""

from dataclasses import replace

import numpy as np
import pytest

from device.errors import TornFrameError
from device.instrument.acquisition.frame_check import TORN_PAIRS, TearWatch
from device.instrument.press.frame_choice import RampFrames, ramp_targets_n
from device.instrument.press.states import TOUCHING, Guidance, PressState
from device.measurement.mode import FRAMES, RAMP_FROM_N, RAMP_TO_N
from device.measurement.recording.tactile_image import Frame

TARGETS_N = (0.1, 0.2, 0.3, 0.4, 0.5)
CAPTURING = PressState.CAPTURING
UP, DOWN, HOLD = Guidance.PRESS_SLOWLY, Guidance.PRESS_LIGHTER, Guidance.HOLD_STILL


@pytest.fixture
def ramp():
    return RampFrames(TARGETS_N, TearWatch(10.0))


def frame(force_n, torn=False):
    counts = np.full((32, 32), round(200 * force_n), np.uint8)
    if torn:
        counts[16:] = 0
    return Frame(counts, "press", 0.0, force_n, (0.6,) * 4)


def see(ramp, *forces_n):
    return [ramp.see(frame(force_n), CAPTURING) for force_n in forces_n]


def forces_of(ramp):
    return [kept.force_n for kept in ramp.frames]


@pytest.mark.parametrize("mode", ["standard", "precise"])
def test_the_targets_are_evenly_spaced_from_end_to_end_and_the_references_reach_further(mode):
    press, reference = (ramp_targets_n(FRAMES[mode].count, role) for role in ("press", "reference"))
    assert len(press) == len(reference) == FRAMES[mode].count
    assert (press[0], press[-1]) == pytest.approx((RAMP_FROM_N, RAMP_TO_N))
    assert (reference[0], reference[-1]) == pytest.approx((0.06, 0.62))
    assert np.ptp(np.diff(press)) < 1e-12


def test_a_frame_counts_within_half_a_spacing_of_an_open_target(ramp):
    see(ramp, 0.049, 0.051)
    assert forces_of(ramp) == [0.051]
    see(ramp, 0.551)
    assert forces_of(ramp) == [0.051]
    see(ramp, 0.549)
    assert forces_of(ramp) == [0.051, 0.549]


def test_the_frame_nearest_to_its_target_stays(ramp):
    see(ramp, 0.17, 0.19, 0.205, 0.23)
    assert forces_of(ramp) == [0.205]


def test_frames_are_given_in_order_of_their_force_in_whatever_order_they_came(ramp):
    see(ramp, 0.3, 0.5, 0.2)
    assert forces_of(ramp) == [0.2, 0.3, 0.5]
    assert ramp.wanted_n == (0.1, 0.4)


@pytest.mark.parametrize("state", [state for state in TOUCHING if state is not CAPTURING])
def test_a_frame_does_not_count_unless_the_machine_says_so_and_an_unsteady_hand_is_slowed(ramp, state):
    guidance = ramp.see(frame(0.2), state)
    assert ramp.frames == []
    assert (guidance is Guidance.SLOWER) is (state is PressState.UNSTEADY)


def test_the_hand_is_led_up_past_every_target_and_holds_at_the_top(ramp):
    assert see(ramp, 0.1, 0.2, 0.3, 0.4, 0.48, 0.49) == [UP] * 6
    assert not ramp.is_complete  # every target has its frame, but the top is not reached
    assert see(ramp, 0.5) == [HOLD]
    assert ramp.is_complete
    assert forces_of(ramp) == list(TARGETS_N)


def test_what_was_missed_is_fetched_from_above_after_the_rest(ramp):
    """0.2 and 0.3 N are missed: up to the top first, then down past both, and up again."""
    assert see(ramp, 0.1, 0.4, 0.5) == [UP, UP, DOWN]
    assert see(ramp, 0.42, 0.3, 0.27) == [DOWN] * 3
    assert see(ramp, 0.21, 0.3) == [UP] * 2
    assert see(ramp, 0.5) == [HOLD]


def test_what_was_missed_below_is_not_asked_for_while_there_is_something_above(ramp):
    assert see(ramp, 0.3, 0.4) == [UP, UP]


def test_a_hand_that_lifts_begins_again(ramp):
    see(ramp, 0.1, 0.2, 0.3, 0.4, 0.5)
    ramp.begin_again()
    assert ramp.frames == []
    assert ramp.wanted_n == TARGETS_N
    assert not ramp.is_complete
    assert see(ramp, 0.1) == [UP]


def test_a_torn_frame_and_the_one_before_it_are_taken_again(ramp):
    see(ramp, 0.1, 0.3)
    ramp.see(frame(0.4, torn=True), CAPTURING)
    assert forces_of(ramp) == [0.1]
    see(ramp, 0.3, 0.4, 0.2, 0.5)
    assert forces_of(ramp) == list(TARGETS_N)


def test_a_ramp_is_not_complete_on_a_torn_frame(ramp):
    see(ramp, 0.1, 0.2, 0.3, 0.4, 0.46)
    ramp.see(frame(0.5, torn=True), CAPTURING)
    assert not ramp.is_complete
    see(ramp, 0.5)
    assert ramp.is_complete


def test_a_camera_whose_frames_are_torn_again_and_again_is_at_fault(ramp):
    frames = [frame(0.3, torn=number % 2 == 1) for number in range(2 * TORN_PAIRS)]
    for one in frames[:-1]:
        ramp.see(one, CAPTURING)
    with pytest.raises(TornFrameError):
        ramp.see(frames[-1], CAPTURING)


def test_neighbours_in_time_are_compared_however_far_apart_the_kept_frames_are(ramp):
    """The kept frames differ by 20 counts each, above the 10 of a tear; but no row of them is a step."""
    see(ramp, *np.linspace(0.1, 0.5, 41))
    assert ramp.is_complete


def test_a_frame_that_leaves_the_course_of_the_others_is_taken_again_from_above():
    """The eighth of ten forces, 0.8 N, has a fifth more light than the others let expect."""
    ramp = RampFrames(tuple(np.linspace(0.1, 1.0, 10)), TearWatch(100.0))
    see(ramp, *np.linspace(0.1, 1.0, 10))
    assert ramp.drop_outlier(0.0) is None
    ramp.begin_again()
    for number, force_n in enumerate(np.linspace(0.1, 1.0, 10)):
        flash = frame(force_n) if number != 7 else frame(1.2 * force_n)
        ramp.see(replace(flash, force_n=force_n), CAPTURING)
    assert ramp.is_complete
    assert ramp.drop_outlier(0.0).frame.force_n == pytest.approx(0.8)
    assert ramp.wanted_n == pytest.approx((0.8,))
    assert see(ramp, 0.95) == [DOWN]
    see(ramp, 0.8, 0.9, 1.0)
    assert ramp.is_complete
    assert ramp.drop_outlier(0.0) is None


def test_the_smallest_force_is_told_from_the_largest(ramp):
    see(ramp, 0.1, 0.2, 0.3, 0.4, 0.5)
    light, hard = ramp.light_and_hard()
    assert light.force_n == 0.1
    assert [one.force_n for one in hard] == [0.5]
