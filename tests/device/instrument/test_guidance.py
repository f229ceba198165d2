"""What the operator is told at each force."""

import pytest

from device.instrument.guidance import Guidance, advise

BAND_N, CONTACT_N = (0.475, 0.525), 0.05


@pytest.mark.parametrize(
    ("force_n", "guidance"),
    [
        (-0.01, Guidance.PRESS_LESION),
        (0.0, Guidance.PRESS_LESION),
        (0.049, Guidance.PRESS_LESION),
        (0.05, Guidance.PRESS_HARDER),
        (0.474, Guidance.PRESS_HARDER),
        (0.475, Guidance.HOLD_STILL),
        (0.525, Guidance.HOLD_STILL),
        (0.526, Guidance.PRESS_LIGHTER),
        (5.0, Guidance.PRESS_LIGHTER),
    ],
)
def test_the_band_includes_both_its_ends_and_contact_begins_at_its_threshold(force_n, guidance):
    assert advise(force_n, BAND_N, CONTACT_N, before_contact=Guidance.PRESS_LESION) is guidance


def test_before_contact_the_operator_is_told_where_to_press():
    assert advise(0.0, BAND_N, CONTACT_N, before_contact=Guidance.PRESS_BESIDE) is Guidance.PRESS_BESIDE


def test_every_guidance_has_a_code_and_a_sentence_of_its_own():
    assert len({guidance.code for guidance in Guidance}) == len(Guidance)
    assert len({guidance.text for guidance in Guidance}) == len(Guidance)
