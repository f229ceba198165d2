"""The virtual hand follows the screen as a person does: late, at a limited rate, and never quite still."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from device.measurement.mode import RAMP_TO_N
from device.measurement.quantities import InvalidQuantity
from device.simulation.hand import BESIDE_MM, RAMP_AIM_N, TOUCH_N, USUAL_ASIDE_MM, HandSettings, VirtualHand
from device.simulation.physics.pressed_face import ProbePlacement

STEADY = HandSettings(rate_n_per_s=0.5, reaction_s=0.2, aim_n=0.4, tremor_n=0.0, drift_n=0.0)


def hand_at(settings=STEADY, *guidance):
    """Return a hand that has taken up the probe and read (guidance, time) pairs."""
    hand = VirtualHand(settings)
    hand.begin()
    for code, t_s in guidance:
        hand.follow(code, t_s)
    return hand


def test_a_hand_that_has_not_taken_up_the_probe_does_nothing():
    hand = VirtualHand(STEADY)
    hand.follow("press_beside", 0.0)
    assert hand.force_n(10.0) == 0.0


def test_a_hand_that_holds_the_probe_at_the_start_lifts_it_when_the_screen_shows_the_fault():
    hand = VirtualHand(replace(STEADY, held_n=0.5))
    hand.follow("wait", 1.0)
    assert hand.force_n(2.0) == 0.5
    hand.follow("fault", 3.0)
    assert [hand.force_n(t_s) for t_s in (3.2, 3.7, 4.3)] == pytest.approx([0.5, 0.25, 0.0])
    hand.follow("press_beside", 5.0)
    assert hand.force_n(9.0) == 0.0


def test_it_acts_only_after_its_reaction_time():
    """Read at 1 s, acted upon at 1.2 s, then 0.5 N/s."""
    hand = hand_at(STEADY, ("press_beside", 1.0))
    assert [hand.force_n(t_s) for t_s in (0.9, 1.0, 1.2)] == [0.0, 0.0, 0.0]
    assert hand.force_n(1.3) == pytest.approx(0.05)
    assert hand.force_n(1.6) == pytest.approx(0.2)


def test_it_reaches_its_aim_and_holds_it():
    hand = hand_at(STEADY, ("press_beside", 1.0))
    assert hand.force_n(2.0) == pytest.approx(0.4)
    assert hand.force_n(100.0) == pytest.approx(0.4)


def test_it_knows_how_long_the_probe_is_pressed_through_all_that_it_is_told():
    """From where the force begins; a press that begins anew counts anew."""
    told = [("touch_lesion", 1.0), *(("press_slowly", 2.0 + 0.5 * i) for i in range(12)), ("hold_still", 9.0)]
    hand = hand_at(STEADY, *told)
    assert hand.pressed_s(11.2) == pytest.approx(10.0)
    hand.follow("lift", 12.0)
    hand.follow("touch_beside", 15.0)
    assert hand.pressed_s(16.2) == pytest.approx(1.0)


def test_it_lifts_to_exactly_nothing():
    hand = hand_at(HandSettings(), ("press_beside", 0.0), ("lift", 5.0))
    assert hand.force_n(5.2) > 0.4
    assert hand.force_n(7.0) == 0.0


@pytest.mark.parametrize("next_guidance", ["lift", "rejected", "press_lesion"])
@pytest.mark.parametrize("read_s", [1.1, 1.5, 1.9, 3.0])
def test_its_force_never_moves_faster_than_its_rate(next_guidance, read_s):
    """Also when it is told something else on the way: it goes on until the reaction time is over."""
    hand = hand_at(STEADY, ("press_beside", 1.0), (next_guidance, read_s))
    times = np.linspace(0.9, 5.0, 2000)
    force = np.array([hand.force_n(t_s) for t_s in times])
    assert np.abs(np.diff(force)).max() <= 0.5 * (times[1] - times[0]) * (1 + 1e-9)


def test_it_goes_on_as_it_was_until_the_reaction_time_is_over():
    hand = hand_at(STEADY, ("press_beside", 1.0), ("lift", 1.4))
    assert hand.force_n(1.4) == pytest.approx(0.1)
    assert hand.force_n(1.6) == pytest.approx(0.2)
    assert hand.force_n(1.7) == pytest.approx(0.15)


def test_tremor_and_drift_stay_within_their_sums():
    """Two sines each: at most 1.5 times the tremor and 1.4 times the drift."""
    settings = HandSettings(tremor_n=0.002, drift_n=0.006)
    hand = hand_at(settings, ("press_beside", 0.0))
    off_n = np.array([hand.force_n(t_s) for t_s in np.linspace(5, 15, 4000)]) - settings.aim_n
    assert np.abs(off_n).max() <= 1.5 * 0.002 + 1.4 * 0.006
    assert off_n.std() > 0.004


def test_tremor_is_of_eight_to_twelve_hertz():
    hand = hand_at(HandSettings(tremor_n=0.01, drift_n=0.0), ("press_beside", 0.0))
    force = np.array([hand.force_n(5 + k / 100) for k in range(1000)])
    spectrum = np.abs(np.fft.rfft(force - force.mean())) ** 2
    frequency = np.fft.rfftfreq(1000, 0.01)
    inside = (frequency >= 8) & (frequency <= 12)
    assert spectrum[inside].sum() > 0.95 * spectrum.sum()


def test_it_presses_beside_first_and_then_on_the_lesion():
    hand = hand_at(STEADY, ("press_beside", 0.0))
    assert hand.place(5.0) == ProbePlacement(*BESIDE_MM)
    hand.follow("lift", 5.0)
    assert hand.place(8.0) == ProbePlacement(*BESIDE_MM)
    hand.follow("press_lesion", 8.0)
    assert hand.place(8.1) == ProbePlacement(*BESIDE_MM)
    assert hand.place(8.3) == ProbePlacement()


@pytest.mark.parametrize("end", ["done", "rejected", "fault"])
def test_it_lifts_at_the_end_and_follows_no_longer(end):
    hand = hand_at(STEADY, ("press_lesion", 0.0), (end, 5.0))
    hand.follow("press_beside", 6.0)
    assert hand.force_n(20.0) == 0.0
    hand.begin()
    hand.follow("press_beside", 20.0)
    assert hand.force_n(30.0) == pytest.approx(0.4)


def test_it_overshoots_comes_back_and_then_holds():
    """Half of 0.4 N beyond, 0.15 s after it has arrived at 2 s."""
    hand = hand_at(replace(STEADY, overshoot_ratio=0.5), ("press_beside", 1.0))
    assert hand.force_n(2.0) == pytest.approx(0.4)
    assert hand.force_n(2.15) == pytest.approx(0.6)
    assert max(hand.force_n(t_s) for t_s in np.linspace(0, 9, 2000)) <= 0.6 + 1e-9
    assert hand.force_n(9.0) == pytest.approx(0.4, abs=1e-6)


def test_it_fades_from_when_it_has_arrived():
    hand = hand_at(replace(STEADY, fade_n_per_s=-0.05), ("press_beside", 1.0), ("lift", 9.0))
    assert [hand.force_n(t_s) for t_s in (2.0, 4.0)] == pytest.approx([0.4, 0.3])
    assert hand.force_n(11.0) == 0.0


def test_it_corrects_a_held_force_when_it_is_told_to_and_only_if_it_is_of_that_kind():
    for guidance in ("press_harder", "press_lighter"):
        hand = hand_at(replace(STEADY, corrects_to_n=0.5), ("press_beside", 1.0), (guidance, 4.0))
        assert hand.force_n(4.2) == pytest.approx(0.4)
        assert hand.force_n(9.0) == pytest.approx(0.5)


def test_it_lifts_early_as_often_as_it_does_and_again_at_the_next_press():
    hand = hand_at(replace(STEADY, early_lifts=1, lifts_after_s=1.5), ("press_beside", 0.0))
    assert hand.force_n(1.6) == pytest.approx(0.4)
    assert hand.force_n(3.0) == 0.0
    hand.follow("press_beside", 3.0)
    assert hand.force_n(20.0) == pytest.approx(0.4)
    for guidance, t_s in (("lift", 20.0), ("press_lesion", 30.0)):
        hand.follow(guidance, t_s)
    assert hand.force_n(31.6) == pytest.approx(0.4)
    assert hand.force_n(40.0) == 0.0


SLOW = HandSettings(ramp_rate_n_per_s=0.1, reaction_s=0.2, tremor_n=0.0, drift_n=0.0)


def test_it_touches_and_waits_for_what_is_next():
    hand = hand_at(SLOW, ("touch_beside", 0.0))
    assert hand.force_n(0.7) == pytest.approx(0.05)
    assert hand.force_n(9.0) == pytest.approx(TOUCH_N)
    assert hand.place(9.0) == ProbePlacement(*BESIDE_MM)


def test_it_presses_slowly_to_a_little_above_the_ramp():
    hand = hand_at(SLOW, ("touch_lesion", 0.0), ("press_slowly", 1.0))
    assert hand.place(9.0) == ProbePlacement()
    assert hand.force_n(2.2) == pytest.approx(TOUCH_N + 0.1)
    assert hand.force_n(20.0) == pytest.approx(RAMP_AIM_N)
    assert 0 < RAMP_AIM_N - RAMP_TO_N < 0.1


def test_it_eases_slowly_without_lifting():
    hand = hand_at(SLOW, ("touch_beside", 0.0), ("press_slowly", 1.0), ("press_lighter", 4.0))
    assert hand.force_n(4.2) == pytest.approx(TOUCH_N + 0.3)
    assert hand.force_n(5.2) == pytest.approx(TOUCH_N + 0.2)
    assert hand.force_n(20.0) == pytest.approx(TOUCH_N)


def test_it_holds_a_ramp_where_it_is():
    hand = hand_at(SLOW, ("touch_beside", 0.0), ("press_slowly", 1.0), ("hold_still", 4.0))
    assert [hand.force_n(t_s) for t_s in (4.2, 9.0)] == pytest.approx([TOUCH_N + 0.3] * 2)


def test_a_hand_that_was_too_fast_once_stays_slower_until_it_takes_up_the_probe_again():
    hand = hand_at(SLOW, ("touch_beside", 0.0), ("press_slowly", 1.0), ("slower", 2.0), ("press_slowly", 4.0))
    assert hand.force_n(2.2) == pytest.approx(TOUCH_N + 0.1)
    assert hand.force_n(4.2) == pytest.approx(TOUCH_N + 0.2)
    assert hand.force_n(5.2) == pytest.approx(TOUCH_N + 0.25)
    hand.follow("done", 6.0)
    hand.begin()
    hand.follow("touch_beside", 20.0)
    hand.follow("press_slowly", 21.0)
    assert hand.force_n(22.2) == pytest.approx(TOUCH_N + 0.1)


EXACT = replace(SLOW, aside_error_mm=0.0, miss_x_mm=1.0)


def test_it_moves_aside_of_where_it_takes_the_middle_to_be_each_time_to_another_side():
    """A hand that misses the middle by 1 mm, told 5, 3, 3 mm and nothing."""
    hand, places = hand_at(EXACT, ("touch_lesion", 0.0)), []
    for number, aside_mm in enumerate((5.0, 3.0, 3.0, None)):
        t_s = 10.0 * (number + 1)
        hand.follow("lift", t_s)
        hand.follow("move_aside", t_s + 4.0, aside_mm)
        assert hand.force_n(t_s + 4.0) == 0.0
        assert hand.force_n(t_s + 9.0) == pytest.approx(TOUCH_N)
        places.append((hand.place(t_s + 9.0).x_mm, hand.place(t_s + 9.0).y_mm))
    assert np.array(places) == pytest.approx(
        np.array([(6.0, 0.0), (1.0, 3.0), (-2.0, 0.0), (1.0, -USUAL_ASIDE_MM)]), abs=1e-9
    )
    hand.follow("touch_lesion", 60.0)
    assert hand.place(61.0) == ProbePlacement(1.0, 0.0)


def test_it_places_the_probe_aside_with_an_error_that_is_the_same_in_every_run():
    def places(seed):
        hand = hand_at(HandSettings(seed=seed))
        for number in range(400):
            hand.follow("touch_lesion", 10.0 * number)
            hand.follow("move_aside", 10.0 * number + 5.0, 4.0)
            yield hand.place(10.0 * number + 9.0)

    found = [(place.x_mm, place.y_mm) for place in places(1)]
    assert found == [(place.x_mm, place.y_mm) for place in places(1)]
    assert found != [(place.x_mm, place.y_mm) for place in places(2)]
    off_mm = np.array(found) - (4.0, 0.0)
    assert off_mm.std(axis=0) == pytest.approx([1.0, 1.0], abs=0.12)
    assert off_mm.mean(axis=0) == pytest.approx([0.0, 0.0], abs=0.16)


@pytest.mark.parametrize("code", ["wait", "press_harder", "press_lighter", "hold_still", "press_slowly", "slower"])
def test_other_guidance_does_not_change_what_it_aims_at(code):
    hand = hand_at(STEADY, ("press_beside", 0.0), (code, 1.0))
    assert hand.force_n(9.0) == pytest.approx(0.4)


def test_a_long_session_of_presses_is_followed_to_the_end():
    hand = hand_at(STEADY)
    for k, code in zip(range(60), itertools.cycle(["press_beside", "lift", "press_lesion", "lift"]), strict=False):
        hand.follow(code, 5.0 * k)
        assert hand.force_n(5.0 * k + 4.0) == pytest.approx(0.0 if code == "lift" else 0.4)


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("rate_n_per_s", 0.01, 10),
        ("ramp_rate_n_per_s", 0.01, 10),
        ("reaction_s", 0, 5),
        ("aim_n", 0, 5),
        ("held_n", 0, 5),
        ("ramp_aim_n", 0, 5),
        ("corrects_to_n", 0, 5),
        ("overshoot_ratio", 0, 5),
        ("fade_n_per_s", -5, 5),
        ("early_lifts", 0, 1000),
        ("lifts_after_s", 0.01, 60),
        ("tremor_hz", 1, 30),
        ("tremor_n", 0, 1),
        ("drift_n", 0, 1),
        ("aside_error_mm", 0, 10),
    ],
)
def test_a_setting_is_taken_at_both_ends_of_its_bound_and_refused_beyond(name, low, high):
    for value in (low, high):
        assert getattr(HandSettings(**{name: value}), name) == value
    for value in (low - 0.001, high + 0.001, float("nan")):
        with pytest.raises(InvalidQuantity, match=rf"^hand\.{name} is"):
            HandSettings(**{name: value})


def test_a_hand_that_misses_and_leans_presses_beside_the_middle_at_an_angle():
    hand = VirtualHand(HandSettings(miss_x_mm=3.0, miss_y_mm=-1.0, tilt_y_deg=2.0))
    hand.begin()
    hand.follow("press_lesion", 0.0)
    assert hand.place(1.0) == ProbePlacement(3.0, -1.0, 0.0, 2.0)


@pytest.mark.parametrize(("taken_up", "put_down"), [("hold_block", "lift"), ("put_weight", "take_weight_off")])
def test_in_a_self_test_it_takes_up_the_probe_by_itself(taken_up, put_down):
    hand = VirtualHand(STEADY)
    hand.follow(taken_up, 0.0)
    assert hand.force_n(5.0) == pytest.approx(0.4)
    hand.follow(put_down, 5.0)
    assert hand.force_n(9.0) == 0.0
