"""What each mode costs on a probe with the default settings."""

from dataclasses import replace

import pytest

from device.config import CameraSection, Config
from device.instrument.press.cost import KEPT_TIMES, AnswerTimes, ModeOffer, PressCost, press_cost
from device.measurement.mode import FRAMES, MODES, ModeWorth


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
    """10 frames at 2 Hz."""
    config = replace(Config(), camera=CameraSection(frame_rate_hz=2.0))
    assert press_cost("standard", config).seconds == 5.0


def test_a_scan_costs_two_to_five_presses_on_the_lesion_each_as_one_of_mode_standard():
    standard, precise = press_cost("standard", Config()), press_cost("precise", Config())
    assert precise == replace(standard, mode="precise", fewest_ramps=2, most_ramps=5)


def test_an_offer_says_what_cannot_be_surpassed_where_the_card_does(path):
    times, reachable = AnswerTimes(path), {"size_mm": 0.8}
    assert offer(times, WORTH).as_record()["reachable_half_width"] is None
    told = offer(times, replace(WORTH, reachable_half_width=reachable)).as_record()
    assert told["reachable_half_width"] == reachable


def test_an_offer_says_how_sure_scans_become_where_the_card_does(path):
    times, widths = AnswerTimes(path), {2: {"size_mm": (0.8, 1.6)}}
    assert offer(times, WORTH).as_record()["half_width_by_ramps"] == {}
    assert offer(times, None).as_record()["half_width_by_ramps"] == {}
    told = offer(times, replace(WORTH, half_width_by_ramps=widths)).as_record()
    assert told["half_width_by_ramps"] == {"2": {"size_mm": (0.8, 1.6)}}


WORTH = ModeWorth(0.1033, 0.9, {"size_mm": 3.3}, {"size_mm": 1.0})
COST = press_cost("standard", Config())


def offer(times, worth):
    return times.offers([COST], {"standard": worth})[0]


@pytest.fixture
def path(tmp_path):
    return tmp_path / "answer_times.json"


def test_before_the_first_press_the_time_to_the_answer_is_the_model_cards(path):
    assert offer(AnswerTimes(path), WORTH) == ModeOffer(COST, 0.103, 0, WORTH)
    assert offer(AnswerTimes(path), None) == ModeOffer(COST, None, 0, None)


def test_the_time_to_the_answer_is_the_median_of_the_last_presses_also_after_a_start(path):
    times = AnswerTimes(path)
    for seconds in [9.0] * KEPT_TIMES + [0.5, 0.4, 0.6] + [0.7] * (KEPT_TIMES - 4) + [20.0]:
        times.note("standard", seconds)
    times.note("quick", 0.02)
    for known in (times, AnswerTimes(path)):
        assert offer(known, WORTH) == ModeOffer(COST, 0.7, KEPT_TIMES, WORTH)
        assert known.offers([press_cost("quick", Config())], {})[0].answer_s == 0.02


@pytest.mark.parametrize(
    "kept", ["", "[1, 2]", "null", '{"standard": 3}', '{"standard": ["a", null, NaN, -1.0, 1e9, true]}']
)
def test_a_damaged_note_of_times_begins_anew(path, kept):
    path.write_text(kept)
    times = AnswerTimes(path)
    assert offer(times, WORTH).answer_presses == 0
    times.note("standard", 0.25)
    assert offer(AnswerTimes(path), WORTH).answer_s == 0.25


def test_a_disk_that_takes_nothing_keeps_no_press_from_its_answer(tmp_path):
    times = AnswerTimes(tmp_path / "no_such_folder" / "answer_times.json")
    times.note("standard", 0.25)
    assert offer(times, WORTH).answer_s == 0.25


def test_a_mode_that_was_not_pressed_here_is_expected_to_be_slower_than_its_card_by_the_longest_that_was(path):
    """Four times as slow here in mode standard, twenty times in quick, where the disk is most of it."""
    times = AnswerTimes(path)
    times.note("standard", 0.4)
    times.note("quick", 0.1)
    stated_s = {"quick": 0.005, "standard": 0.1, "precise": 0.9}
    worth = {mode: replace(WORTH, compute_s=seconds) for mode, seconds in stated_s.items()}
    offers = times.offers([press_cost(mode, Config()) for mode in MODES], worth)
    assert [(one.answer_s, one.answer_presses) for one in offers] == [(0.1, 1), (0.4, 1), (3.6, 0), (None, 0)]


def test_a_card_that_rounds_a_time_to_nothing_stops_no_answer(path):
    """Of a bundle whose answer takes less than half of a tenth of a millisecond where it was made."""
    times = AnswerTimes(path)
    times.note("quick", 0.04)
    offers = times.offers([press_cost("quick", Config())], {"quick": replace(WORTH, compute_s=0.0)})
    assert offers[0].answer_s == 0.04
