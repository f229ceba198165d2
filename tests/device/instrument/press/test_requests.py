"""At most one press waits or is under way; who asks for another finds out why not, and nothing else changes."""

import threading
from dataclasses import replace

import pytest

from device.errors import BusyError, CameraError, ClockJumpError, LastGoodConfigError, ModeUnavailable, UnknownResource
from device.instrument.press.requests import PressRequests
from device.instrument.press.states import Guidance
from device.instrument.self_test.report import SelfTestJob
from device.instrument.status import StatusBoard
from device.records.store import Store


@pytest.fixture
def board():
    return StatusBoard()


@pytest.fixture
def cancelled():
    return threading.Event()


@pytest.fixture
def store(tmp_path):
    opened = Store(tmp_path)
    yield opened
    opened.close()


@pytest.fixture
def called_away():
    return threading.Event()


@pytest.fixture
def requests(board, store, cancelled, called_away):
    return PressRequests(
        board, store, modes=("paper", "quick"), mode="paper", cancelled=cancelled, called_away=called_away
    )


def test_a_press_that_was_asked_for_waits_in_the_store_and_begins_untouched(requests, board, store):
    job = requests.ask("quick")
    assert store.press(job.id)["state"] == "waiting"
    assert requests.begin(is_touched=False) == job == board.now.press
    assert requests.begin(is_touched=False) is None


def test_a_press_that_nobody_asked_for_begins_at_a_touch_in_the_mode_of_the_settings(requests):
    assert requests.begin(is_touched=False) is None
    assert requests.begin(is_touched=True).mode == "paper"


def test_a_press_is_on_the_board_together_with_how_it_begins(requests, board):
    board.update(guidance=Guidance.DONE)  # of the press before
    shown = []
    board.on_guidance(lambda guidance: shown.append((guidance, board.now.press)))
    job = requests.ask("quick")
    requests.begin(is_touched=False)
    assert shown == [(Guidance.PRESS_BESIDE, job)]


def test_a_second_press_is_refused_while_one_waits_and_while_one_is_under_way(requests):
    requests.ask(None)
    for _ in range(2):
        with pytest.raises(BusyError):
            requests.ask(None)
        requests.begin(is_touched=False)


def test_a_mode_that_the_probe_does_not_have_is_refused_with_those_it_has(requests):
    with pytest.raises(ModeUnavailable, match="paper, quick"):
        requests.ask("precise")
    assert requests.begin(is_touched=False) is None


def test_a_probe_at_fault_answers_a_request_with_the_fault(requests, board):
    fault = CameraError("No frame came.", "Check the ribbon cable.")
    board.update(fault=fault)
    with pytest.raises(CameraError) as refusal:
        requests.ask(None)
    assert refusal.value is fault


def test_a_press_that_waits_can_be_cancelled_and_no_other(requests, cancelled):
    job = requests.ask(None)
    with pytest.raises(UnknownResource):
        requests.cancel("another")
    assert not cancelled.is_set()
    requests.cancel(job.id)
    assert cancelled.is_set()


def test_the_end_of_one_press_by_its_operator_does_not_end_the_next(requests, cancelled):
    requests.cancel(requests.ask(None).id)
    requests.withdraw()
    requests.ask(None)
    assert not cancelled.is_set()


def test_a_press_that_is_withdrawn_does_not_begin(requests):
    job = requests.ask(None)
    assert requests.withdraw() == job
    assert requests.withdraw() is None
    assert requests.begin(is_touched=False) is None


def test_what_the_last_press_was_told_is_not_told_to_the_next_unless_it_lasts(requests, board):
    once, lasting = ClockJumpError("The clock was set.", "Check it."), LastGoodConfigError("Bad.", "Correct them.")
    board.update(warnings=(once, lasting))
    told = requests.begin(is_touched=True)
    assert board.now.warnings == (once, lasting)
    board.update(press=replace(told, state="done", warnings=(once.as_record(), lasting.as_record())))
    requests.begin(is_touched=True)
    assert board.now.warnings == (lasting,)


def test_a_press_is_refused_while_a_self_test_waits_or_runs_and_taken_after_it(requests, board):
    for state in ("waiting", "running"):
        board.update(self_test=SelfTestJob("s", "2026-01-01T00:00:00Z", state=state))
        with pytest.raises(BusyError, match="self-test"):
            requests.ask(None)
    board.update(self_test=SelfTestJob("s", "2026-01-01T00:00:00Z", state="done"))
    assert requests.ask(None).state == "waiting"


def test_no_press_begins_while_something_else_is_to_be_done_first(requests, called_away):
    job = requests.ask(None)
    called_away.set()
    assert requests.begin(is_touched=True) is None
    called_away.clear()
    assert requests.begin(is_touched=False) == job


def test_what_needs_an_idle_probe_is_refused_while_a_press_waits_or_is_under_way(requests):
    with requests.idle():
        pass
    requests.ask(None)
    for _ in range(2):
        with pytest.raises(BusyError, match="A press is under way"), requests.idle():
            pass
        requests.begin(is_touched=False)
