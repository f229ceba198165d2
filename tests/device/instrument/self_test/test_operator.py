"""The operator is told once and waited for, not longer than given, and not when the daemon stops."""

import itertools
import threading
import types

import pytest

from device.errors import CameraError
from device.instrument.press.states import Guidance
from device.instrument.self_test import run as operator_module
from device.instrument.self_test.run import Operator
from device.instrument.status import StatusBoard
from device.instrument.watch.progress import ProgressBoard


class Force:
    """A force (N) and its range over time."""

    def __init__(self, now_s):
        self.now_s, self.latest, self.range = now_s, lambda t_s: 0.0, lambda t_s: 0.0

    @property
    def latest_n(self):
        return self.latest(self.now_s[0])

    def range_n(self, t_s, *, window_s):
        return self.range(t_s)


@pytest.fixture
def now_s(monkeypatch):
    now_s = [100.0]
    clock = types.SimpleNamespace(monotonic=lambda: now_s[0], sleep=lambda s: now_s.__setitem__(0, now_s[0] + s))
    monkeypatch.setattr(operator_module, "time", clock)
    return now_s


@pytest.fixture
def force(now_s):
    return Force(now_s)


@pytest.fixture
def board():
    return StatusBoard()


@pytest.fixture
def stopping():
    return threading.Event()


@pytest.fixture
def progress(now_s):
    return ProgressBoard(lambda: now_s[0])


@pytest.fixture
def operator(board, force, progress, stopping):
    return Operator(board, force, progress, stopping)


def test_who_does_as_told_is_waited_for(operator, force, board, now_s):
    force.latest = lambda t_s: 0.5 if t_s > 103.0 else 0.0
    assert operator.until(Guidance.HOLD_BLOCK, lambda force_n: force_n > 0.4, 30.0)
    assert board.now.guidance is Guidance.HOLD_BLOCK
    assert now_s[0] == pytest.approx(103.0, abs=0.05)


def test_who_does_not_is_waited_for_no_longer_than_given(operator, now_s):
    assert not operator.until(Guidance.HOLD_BLOCK, lambda force_n: force_n > 0.4, 30.0)
    assert now_s[0] == pytest.approx(130.0, abs=0.05)


def test_a_daemon_that_stops_waits_for_nobody(operator, stopping, now_s):
    stopping.set()
    assert not operator.until(Guidance.HOLD_BLOCK, lambda force_n: True, 30.0)
    operator.settle(0.02, 30.0)
    assert now_s == [100.0]


def test_a_force_that_settles_is_waited_for_and_one_that_never_does_is_not(operator, force, now_s):
    force.range = lambda t_s: 0.1 if t_s < 102.0 else 0.01
    operator.settle(0.02, 30.0)
    assert now_s[0] == pytest.approx(102.0)
    force.range = lambda t_s: 0.1
    operator.settle(0.02, 30.0)
    assert now_s[0] == pytest.approx(132.0)


def test_while_the_operator_is_waited_for_idle_parts_go_on_and_their_faults_are_left_to_their_checks(
    operator, force, progress, now_s
):
    """The watchdog would end a self-test in which nothing is seen of camera and light for half of its 15 s."""
    used_s = []

    def look():
        used_s.append(now_s[0])
        with progress.inside("camera"):
            raise CameraError("No frame.", "Check it.")

    progress.exercise("camera", look)
    operator.until(Guidance.HOLD_BLOCK, lambda force_n: False, 10.0)
    force.range = lambda t_s: 0.1
    operator.settle(0.02, 10.0)
    assert len(used_s) >= 18
    assert max(later - sooner for sooner, later in itertools.pairwise(used_s)) < 1.6
