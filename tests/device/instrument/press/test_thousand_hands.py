"""People press in simulated time: the good presses are measured, the bad ones are not, and light is short.

A hundred of them each time, and a thousand in `make test-all`. What a good and a bad hand is, and what lies between,
is said in tests/people.py before anyone presses.
"""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from people import KINDS, verdict
from simulated_time_bench import CAMERA, SimulatedTimePress

from device.config import Config, PressSection
from device.measurement.mode import FRAMES
from device.simulation.hand import HandSettings

HANDS = {"ordinary": 590, "borderline": 60}
BAD_HANDS = 50
"""Of each other kind: 1000 in all, of which a hundred are every tenth."""
RAMP_SHARE = 0.15
CONFIG = Config(camera=CAMERA, press=PressSection(timeout_s=6.0))
"""As by default but for the time limit: who waits for a minute is rejected by the same rule."""


@pytest.fixture(scope="module", params=[10, pytest.param(1, marks=pytest.mark.long)], ids=["hundred", "thousand"])
def every(request):
    """Of how many hands one presses."""
    return request.param


@pytest.fixture(scope="module")
def presses(every):
    """Return (kind, what ought to be, mode, hand, what became of it) of every hand."""
    patch, found = pytest.MonkeyPatch(), []
    pressing = SimulatedTimePress(patch, CONFIG)
    rng = np.random.default_rng(20)
    for kind, draw in KINDS.items():
        for number in range(HANDS.get(kind, BAD_HANDS)):
            mode = "standard" if kind != "drift" and rng.random() < RAMP_SHARE else "paper"
            hand = draw(rng, mode)
            ought = verdict(hand, mode, CONFIG)
            if number % every == 0:
                found.append((kind, ought, mode, hand, pressing.press(hand, mode)))
    patch.undo()
    _print_table(found)
    return found


def _print_table(presses):
    counts = Counter((kind, ought, pressed.is_accepted) for kind, ought, _, _, pressed in presses)
    print(f"\n{'kind':16}{'ought':8}{'accepted':>9}{'rejected':>9}{'longest light (s)':>19}")
    for kind, ought in dict.fromkeys((kind, ought) for kind, ought, *_ in presses):
        light_s = max(one[-1].light_on_s for one in presses if one[:2] == (kind, ought))
        print(f"{kind:16}{ought:8}{counts[kind, ought, True]:9}{counts[kind, ought, False]:9}{light_s:19.1f}")


def test_there_are_so_many_and_hardly_any_of_them_is_neither_good_nor_bad(presses, every):
    ought = Counter(ought for _, ought, *_ in presses)
    assert ought.total() == 1000 // every
    assert ought["good"] >= 550 // every
    assert ought["bad"] >= 330 // every
    assert {kind for kind, ought, *_ in presses if ought == "bad"} >= set(KINDS) - {"ordinary", "borderline"}


def test_at_least_99_of_100_good_presses_are_accepted(presses):
    good = [pressed for _, ought, _, _, pressed in presses if ought == "good"]
    refused = [pressed.reason for pressed in good if not pressed.is_accepted]
    assert len(refused) <= 0.01 * len(good), refused


def test_no_bad_press_is_accepted_and_each_says_why(presses):
    bad = [(kind, hand, pressed) for kind, ought, _, hand, pressed in presses if ought == "bad"]
    assert [(kind, hand) for kind, hand, pressed in bad if pressed.is_accepted] == []
    assert all(pressed.reason.endswith(".") for _, _, pressed in bad)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("too hard", "above 1.00 N: lift and press more gently"),
        ("never reaching", "stayed below 0.47 N|force came to 0"),
        ("off-centre", "off the middle"),
        ("lifts early", "lifted|force came to 0|stayed below|not steady"),
        ("double", "lifted|force came to 0|stayed below|not steady"),
    ],
)
def test_a_bad_press_is_rejected_for_what_is_bad_about_it(presses, kind, words):
    reasons = [pressed.reason for one, ought, _, _, pressed in presses if (one, ought) == (kind, "bad")]
    assert [reason for reason in reasons if not any(word in reason for word in words.split("|"))] == []


def test_the_light_of_no_press_is_longer_than_its_budget(presses):
    assert max(pressed.light_on_s for *_, pressed in presses) <= 4 * CONFIG.press.timeout_s + 1.0
    assert 4 * PressSection().timeout_s + 1.0 <= Config().light.max_on_s


def test_what_is_accepted_was_pressed_in_one_go_within_the_forces_that_are_wanted(presses):
    """Also of those of whom nothing was asked: no frame comes from before the hand lifted.

    A hand that jerks at 2.5 N/s between two samples of the cell, 12.5 ms apart, is misread by 7.8 mN at most.
    """
    for _, _, mode, _, pressed in presses:
        for role in ("reference", "press"):
            frames = [frame for frame in pressed.frames if frame.role == role]
            if not frames:
                continue
            assert len(frames) == FRAMES[mode].count
            times = sorted(frame.t_s for frame in frames)
            held_n = pressed.probe.sampled_n(times[0], times[-1])
            assert min(held_n, default=1.0) >= 0.9 * CONFIG.press.contact_n
            if mode == "paper":
                low_n, high_n = CONFIG.press.band_n
                assert all(low_n <= frame.force_n <= high_n for frame in frames)
                true_n = [pressed.probe.exposed_n[frame.t_s] for frame in frames]
                assert np.subtract(true_n, [frame.force_n for frame in frames]) == pytest.approx(0.0, abs=0.0095)


def test_the_longest_press_there_can_be_keeps_the_budget_of_light(monkeypatch):
    """By the settings as they are: a minute before the first touch and a minute of it, beside the lesion and on it."""
    config = Config(camera=CAMERA, press=PressSection(timeout_s=PressSection().timeout_s))
    slow = HandSettings(reaction_s=5.0, rate_n_per_s=0.01, aim_n=0.5, tremor_n=0.0005, drift_n=0.0)
    pressed = SimulatedTimePress(monkeypatch, config).press(slow, "paper")
    assert pressed.is_accepted, pressed.reason
    assert pressed.light_on_s > 90.0
    assert pressed.light_on_s <= config.light.max_on_s
