"""What the operator is told in each state of a press."""

import pytest

from device.instrument.press.states import HELD_GUIDANCE, TOUCHING, Guidance, PressState, before_contact, spoken


def test_every_state_of_a_touching_probe_has_its_guidance_in_a_hold():
    assert set(HELD_GUIDANCE) == set(TOUCHING)
    assert {state for state, guidance in HELD_GUIDANCE.items() if guidance is not Guidance.HOLD_STILL} == {
        PressState.TOO_LIGHT,
        PressState.TOO_HARD,
    }


@pytest.mark.parametrize("mode", ["quick", "paper"])
def test_before_contact_the_operator_is_told_where_to_press(mode):
    assert before_contact("reference", mode) is Guidance.PRESS_BESIDE
    assert before_contact("press", mode) is Guidance.PRESS_LESION


@pytest.mark.parametrize("mode", ["standard", "precise"])
def test_a_ramp_begins_with_a_touch(mode):
    assert before_contact("reference", mode) is Guidance.TOUCH_BESIDE
    assert before_contact("press", mode) is Guidance.TOUCH_LESION


@pytest.mark.parametrize("ramp", [1, 4])
def test_a_further_press_of_a_scan_begins_with_a_move_whose_way_is_told_where_it_is_known(ramp):
    assert before_contact("press", "precise", ramp) is Guidance.MOVE_ASIDE
    assert spoken(Guidance.MOVE_ASIDE, 4.4) == "Move the probe about 4 mm to the side, touch again"
    assert spoken(Guidance.MOVE_ASIDE, None) == Guidance.MOVE_ASIDE.text
    assert spoken(Guidance.LIFT, 4.4) == Guidance.LIFT.text


def test_every_guidance_has_a_code_and_a_sentence_of_its_own():
    assert len({guidance.code for guidance in Guidance}) == len(Guidance)
    assert len({guidance.text for guidance in Guidance}) == len(Guidance)
