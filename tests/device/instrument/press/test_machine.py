"""The press as a state machine: a press is a list of observations here, and nothing but the machine runs."""

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from device.config import PressSection
from device.instrument.press.machine import (
    MAX_LIFTS,
    MAX_REPLACED,
    MAX_SATURATED,
    SETTLE_S,
    FrameSeen,
    PressRules,
    PressUnderWay,
)
from device.instrument.press.states import ACTIVE, SEEING, TOUCHING, TRANSITIONS, IllegalTransition, PressState

SECTION = PressSection(
    target_n=0.5, band_ratio=0.05, contact_n=0.05, overload_n=1.0, timeout_s=10.0, steady_n=0.02, max_offset_mm=2.5
)
RULES = PressRules.of(SECTION, SECTION.band_n, is_ramp=False)
RAMP = PressRules.of(SECTION, (0.05, 0.63), is_ramp=True)
FRAME_S = 1 / 30
BEGUN = PressUnderWay().begin("reference", 0.0)


def observed(force_n, t_s=0.1, **others):
    return FrameSeen(
        **{"t_s": t_s, "force_n": force_n, "peak_n": force_n, "range_n": 0.0, "rate_n_per_s": 0.0} | others
    )


def after(*forces_n, press=BEGUN, rules=RULES, frame_s=FRAME_S, **others):
    """Return the press after frames at these forces, the first of them one frame time after its begin."""
    for number, force_n in enumerate(forces_n, 1):
        press = press.see(observed(force_n, number * frame_s, **others), rules)
    return press


def press_in(state):
    """Return a press under way that came to a state as presses do."""
    way = {
        PressState.APPROACH: lambda: BEGUN,
        PressState.TOO_LIGHT: lambda: after(0.3),
        PressState.TOO_HARD: lambda: after(0.7),
        PressState.HOLDING: lambda: after(0.5, range_n=0.1),
        PressState.UNSTEADY: lambda: after(*[0.5] * 20, range_n=0.1),
        PressState.CAPTURING: lambda: after(0.5),
        PressState.RELEASING: lambda: after(0.5).hold(None, RULES).release(1.0),
    }
    press = way[state]()
    assert press.state is state
    return press


def test_a_whole_measurement_runs_through_both_presses_to_its_end():
    told = []
    press = PressUnderWay()
    for role in ("reference", "press"):
        press = press.begin(role, 0.0)
        told.append(press.state)
        for force_n in (0.0, 0.3, 0.6, 0.5):
            press = press.see(observed(force_n), RULES)
            told.append(press.state)
        press = press.hold(None, RULES).check(observed(0.5), SECTION).release(1.0)
        told.append(press.state)
    told.append(press.done().state)
    once = ["approach", "approach", "too_light", "too_hard", "capturing", "releasing"]
    assert [state.code for state in told] == [*once, *once, "done"]


@pytest.mark.parametrize(
    ("force_n", "state"),
    [
        (0.0499, PressState.APPROACH),
        (0.05, PressState.TOO_LIGHT),
        (0.4749, PressState.TOO_LIGHT),
        (0.475, PressState.CAPTURING),
        (0.525, PressState.CAPTURING),
        (0.5251, PressState.TOO_HARD),
        (1.0, PressState.TOO_HARD),
        (1.0001, PressState.REJECTED),
    ],
)
def test_the_force_decides_where_a_steady_press_is(force_n, state):
    assert after(force_n).state is state


@pytest.mark.parametrize(("range_n", "state"), [(0.02, PressState.CAPTURING), (0.0201, PressState.HOLDING)])
def test_a_force_that_varied_more_than_allowed_does_not_count(range_n, state):
    assert after(0.5, range_n=range_n).state is state


def test_a_force_that_does_not_settle_is_unsteady_and_may_become_steady_again():
    states = [press.state for press in itertools.accumulate(
        range(1, 20), lambda press, k: press.see(observed(0.5, k * 0.1, range_n=0.05), RULES), initial=BEGUN
    )][1:]  # fmt: skip
    settling = round(SETTLE_S / 0.1)
    assert states == [PressState.HOLDING] * settling + [PressState.UNSTEADY] * (19 - settling)
    assert press_in(PressState.UNSTEADY).see(observed(0.5, 0.7), RULES).state is PressState.CAPTURING


def test_a_single_unsteady_moment_of_a_steady_hold_is_no_unsteady_hold():
    held = after(*[0.5] * 60)
    assert held.see(observed(0.5, 2.1, range_n=0.1), RULES).state is PressState.HOLDING


def test_a_force_that_comes_back_into_the_band_may_settle_anew():
    press = press_in(PressState.UNSTEADY)
    outside = press.see(observed(0.6, 0.7), RULES)
    assert outside.see(observed(0.5, 0.8, range_n=0.1), RULES).state is PressState.HOLDING


def test_a_ramp_that_trembles_settles_and_one_that_is_too_fast_is_unsteady_at_once():
    """It may tremble by 0.02 N, and by a quarter of 0.35 N/s over 0.15 s on top."""
    assert after(0.3, rules=RAMP, range_n=0.033, rate_n_per_s=0.35).state is PressState.CAPTURING
    assert after(0.3, rules=RAMP, range_n=0.034, rate_n_per_s=0.1).state is PressState.HOLDING
    assert after(0.3, rules=RAMP, rate_n_per_s=-0.351).state is PressState.UNSTEADY


def test_a_spike_between_two_frames_is_too_hard_although_both_are_not():
    press = after(0.5).see(observed(0.5, 0.2, peak_n=1.04), RULES)
    assert (press.state, press.ending) == (PressState.REJECTED, "rejected")
    assert press.reason == "The force rose to 1.04 N, above 1.00 N: lift and press more gently."


def test_a_lift_in_the_middle_begins_again_but_not_for_ever():
    one = [0.3, 0.5, 0.0]
    press = after(*one * MAX_LIFTS)
    assert (press.state, press.lifts) == (PressState.APPROACH, MAX_LIFTS)
    rejected = press.see(observed(0.5, 1.0), RULES).see(observed(0.0, 1.1), RULES)
    assert rejected.state is PressState.REJECTED
    assert "lifted 4 times" in rejected.reason


def test_a_touch_that_chatters_is_no_lift():
    """0.09 N is contact, but less than twice as much as contact needs."""
    assert after(*[0.06, 0.0, 0.09, 0.04] * 20).lifts == 0


@pytest.mark.parametrize(
    ("force_n", "others", "reason"),
    [
        (0.4, {}, "stayed below 0.47 N for 10 s: press harder"),
        (0.6, {}, "stayed above 0.53 N for 10 s: press lighter"),
        (0.5, {"range_n": 0.1}, "was not steady to 0.02 N for 10 s: rest the arm"),
        (
            0.5,
            {},
            "Not all frames could be taken for 10 s: press slowly up to 0.53 N; the force came to 0.50 N.",
        ),
        (0.6, {"range_n": 0.1}, "was not steady to 0.02 N for 10 s: rest the arm"),
    ],
)
def test_a_press_that_takes_too_long_says_what_it_was_doing(force_n, others, reason):
    press = after(*[force_n] * 11, frame_s=1.0, **others)
    assert press.state is not PressState.REJECTED
    press = press.see(observed(force_n, 11.1, **others), RULES)
    assert press.state is PressState.REJECTED
    assert reason in press.reason


def test_lifting_now_and_then_does_not_make_a_press_longer():
    """The light would else be on for longer than its budget."""
    press = after(*[0.06, 0.0] * 6, frame_s=0.9)
    assert press.see(observed(0.0, 11.0), RULES).state is PressState.REJECTED


def test_a_press_that_never_comes_is_given_up():
    assert after(*[0.0] * 10, frame_s=1.0).state is PressState.APPROACH
    press = after(*[0.0] * 11, frame_s=1.0)
    assert press.reason == "No press came for 10 s: begin again."


def test_a_saturated_frame_does_not_count_and_a_few_of_them_end_the_press():
    bright = observed(0.5, saturated_ratio=0.002)
    press = BEGUN
    for _ in range(MAX_SATURATED):
        press = press.see(bright, RULES)
        assert press.state is PressState.HOLDING
    assert press.see(observed(0.5, saturated_ratio=0.001), RULES).state is PressState.CAPTURING
    rejected = press.see(bright, RULES)
    assert rejected.reason.startswith("The image is too bright: 0.2% of its pixels are saturated, above 0.1%: shade")


def test_frames_that_are_unlike_the_others_are_taken_again_a_few_times():
    press = after(0.5)
    for _ in range(MAX_REPLACED):
        press = press.replace_frame(0.3)
        assert press.state is PressState.HOLDING
    rejected = press.replace_frame(0.3)
    assert rejected.state is PressState.REJECTED
    assert "More than 5 frames were unlike the others, the last by 30%: shade" in rejected.reason


@pytest.mark.parametrize(
    ("spot_mm", "towards"),
    [((3.0, 0.5), "+x."), ((-3.0, 1.0), "-x."), ((0.0, 2.6), "+y."), ((1.0, -4.0), "-y."), ((2.0, -2.0), "+x and -y.")],
)
def test_an_inclusion_off_the_middle_ends_the_press_and_says_where_to_go(spot_mm, towards):
    rejected = after(0.5).hold(spot_mm, RULES)
    assert rejected.state is PressState.REJECTED
    assert f"above 2.5 mm: move the probe towards {towards}" in rejected.reason


def test_an_inclusion_near_enough_to_the_middle_and_one_that_is_not_seen_are_measured():
    for spot_mm in (None, (0.0, 0.0), (1.5, 2.0)):
        assert after(0.5).hold(spot_mm, RULES).state is PressState.HOLDING


def test_while_each_side_is_looked_at_the_hand_has_to_hold():
    holding = after(0.5).hold(None, RULES)
    assert holding.check(observed(0.35), SECTION) is holding
    assert "lifted too early" in holding.check(observed(0.349), SECTION).reason
    assert "above 1.00 N" in holding.check(observed(1.01), SECTION).reason


def test_a_probe_that_is_not_lifted_is_given_up_and_one_that_is_waits_for_nobody():
    press = press_in(PressState.RELEASING)
    assert press.wait(11.0, 0.5, SECTION) is press
    assert press.wait(11.1, 0.049, SECTION) is press
    assert press.wait(11.1, 0.05, SECTION).reason == "The probe was not lifted for 10 s: begin again."


@pytest.mark.parametrize("ending", ["rejected", "cancelled", "failed"])
@pytest.mark.parametrize("state", ACTIVE, ids=lambda state: state.code)
def test_a_press_can_be_ended_in_every_state(state, ending):
    press = press_in(state).reject("Enough.", ending)
    assert (press.state, press.ending, press.reason) == (PressState.REJECTED, ending, "Enough.")


def test_an_end_is_an_end():
    for end in (press_in(PressState.RELEASING).done(), BEGUN.reject("Enough.")):
        steps = (
            lambda end=end: end.begin("press", 0.0),
            lambda end=end: end.see(observed(0.5), RULES),
            lambda end=end: end.reject("Again."),
            lambda end=end: end.done(),
        )
        for step in steps:
            with pytest.raises(IllegalTransition, match=f"A press that is {end.state.code} cannot "):
                step()


@pytest.mark.parametrize(
    "step",
    [
        lambda: BEGUN.done(),
        lambda: BEGUN.release(1.0),
        lambda: BEGUN.hold(None, RULES),
        lambda: BEGUN.replace_frame(0.1),
        lambda: BEGUN.begin("press", 1.0),
        lambda: PressUnderWay().reject("Nobody presses."),
        lambda: PressUnderWay().see(observed(0.5), RULES),
        lambda: press_in(PressState.CAPTURING).release(1.0),
        lambda: press_in(PressState.CAPTURING).begin("press", 1.0),
        lambda: press_in(PressState.CAPTURING).check(observed(0.5), SECTION),
        lambda: press_in(PressState.HOLDING).wait(1.0, 0.0, SECTION),
        lambda: press_in(PressState.RELEASING).see(observed(0.5), RULES),
    ],
)
def test_a_step_out_of_turn_is_refused(step):
    with pytest.raises(IllegalTransition):
        step()


OBSERVATIONS = st.builds(
    FrameSeen,
    t_s=st.floats(0.0, 12.0),
    force_n=st.floats(-0.1, 1.2),
    peak_n=st.floats(-0.1, 1.2),
    range_n=st.floats(0.0, 0.1),
    rate_n_per_s=st.floats(-1.0, 1.0),
    saturated_ratio=st.floats(0.0, 0.01),
)


@given(st.lists(OBSERVATIONS, max_size=60), st.sampled_from([RULES, RAMP]))
def test_whatever_a_hand_does_the_machine_stays_in_its_table(observations, rules):
    press, t_s = BEGUN, 0.0
    for seen in observations:
        before, t_s = press, t_s + seen.t_s / 12
        press = press.see(replace(seen, t_s=t_s), rules)
        assert press.state in TRANSITIONS[before.state]
        if press.ending:
            assert press.reason
            return
        assert press.state in SEEING
        assert press.is_touching is (seen.force_n >= rules.contact_n)
        if press.state is PressState.CAPTURING:
            assert rules.low_n <= seen.force_n <= rules.high_n
            assert rules.is_steady(seen)
            assert seen.peak_n <= rules.overload_n


def test_every_state_can_be_reached_and_every_press_can_end():
    reached, front = {PressState.IDLE}, {PressState.IDLE}
    while front:
        front = {after for before in front for after in TRANSITIONS[before]} - reached
        reached |= front
    assert reached == set(PressState)
    assert all(PressState.REJECTED in TRANSITIONS[state] for state in ACTIVE)
    assert set(TOUCHING) < set(SEEING) < set(ACTIVE)
