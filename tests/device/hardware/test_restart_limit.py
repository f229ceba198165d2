"""So many restarts in any window, and again when the oldest has left it."""

from device.hardware.restart_limit import RestartLimit


def test_restarts_are_allowed_until_there_are_too_many_in_the_window_and_again_when_the_oldest_has_left_it():
    """Two in 60 s: at 0 s and 50 s, not at 59 s, at 60 s, then not before 110 s."""
    now_s = [0.0]
    limit = RestartLimit(2, 60.0, clock=lambda: now_s[0])
    answers = []
    for now_s[0] in (0.0, 50.0, 59.0, 60.0, 109.0, 110.0):
        answers.append(limit.allows_one())
    assert answers == [True, True, False, True, False, True]


def test_without_restarts_none_is_allowed():
    assert not RestartLimit(0, 60.0).allows_one()
