"""What the operator is told at each force."""

import pytest

from device.instrument.guidance import Guidance, advise, before_contact

BAND_N = (0.475, 0.525)


@pytest.mark.parametrize(
    ("force_n", "guidance"),
    [
        (0.05, Guidance.PRESS_HARDER),
        (0.474, Guidance.PRESS_HARDER),
        (0.475, Guidance.HOLD_STILL),
        (0.525, Guidance.HOLD_STILL),
        (0.526, Guidance.PRESS_LIGHTER),
        (5.0, Guidance.PRESS_LIGHTER),
    ],
)
def test_the_band_includes_both_its_ends(force_n, guidance):
    assert advise(force_n, BAND_N) is guidance


@pytest.mark.parametrize("mode", ["quick", "paper"])
def test_before_contact_the_operator_is_told_where_to_press(mode):
    assert before_contact("reference", mode) is Guidance.PRESS_BESIDE
    assert before_contact("press", mode) is Guidance.PRESS_LESION


@pytest.mark.parametrize("mode", ["standard", "precise"])
def test_a_ramp_begins_with_a_touch(mode):
    assert before_contact("reference", mode) is Guidance.TOUCH_BESIDE
    assert before_contact("press", mode) is Guidance.TOUCH_LESION


def test_every_guidance_has_a_code_and_a_sentence_of_its_own():
    assert len({guidance.code for guidance in Guidance}) == len(Guidance)
    assert len({guidance.text for guidance in Guidance}) == len(Guidance)
