"""What is kept of a press: the store first, then the board; and a press that fails ends also without a store."""

import pytest

from device.errors import CameraError, ClockJumpError, StorageError
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press.record import PressBook
from device.instrument.status import PressJob, StatusBoard

FAULT = CameraError("No frame came.", "Check the cable.")


class ScriptedStore:
    """Keeps records, or refuses them."""

    def __init__(self):
        self.kept, self.light_on_s, self.is_broken = [], [], False

    def save_press(self, record):
        if self.is_broken:
            raise StorageError("The disk is gone.", "Check the disk.")
        self.kept.append(record)

    def add_light_on_s(self, seconds):
        self.light_on_s.append(seconds)


@pytest.fixture
def now_s():
    return [0.0]


@pytest.fixture
def budget(now_s):
    return LightBudget(clock=lambda: now_s[0])


@pytest.fixture
def store():
    return ScriptedStore()


@pytest.fixture
def board():
    return StatusBoard()


@pytest.fixture
def book(board, store, budget):
    return PressBook(board, store, budget)


def test_a_change_is_kept_with_warnings_and_light_before_it_is_shown(book, board, store, budget, now_s):
    job = PressJob(id="one", mode="paper")
    budget.begin_press()
    budget.note_lit()
    now_s[0] = 2.5
    book.warn(ClockJumpError("The clock was set.", "Check it."))
    book.note(job, state="capturing")
    assert store.kept[0]["state"] == "capturing"
    assert store.kept[0]["light_on_s"] == 2.5
    assert [warning["code"] for warning in store.kept[0]["warnings"]] == ["E701"]
    store.is_broken = True
    with pytest.raises(StorageError):
        book.note(job, state="done")
    assert board.now.press.state == "capturing"


def test_a_later_warning_of_the_same_code_takes_the_place_of_the_first(book, board):
    for cause in ("The clock was set by 3 s.", "The clock was set by 5 s."):
        book.warn(ClockJumpError(cause, "Check it."))
    assert [warning.cause for warning in board.now.warnings] == ["The clock was set by 5 s."]


def test_a_press_fails_on_the_screen_also_when_the_store_is_at_fault(book, board, store):
    store.is_broken = True
    book.fail(PressJob(id="one", mode="paper"), FAULT)
    assert (board.now.press.state, board.now.press.code) == ("failed", "E101")


def test_a_press_that_has_ended_does_not_fail_any_more(book, board):
    book.note(PressJob(id="one", mode="paper"), state="done")
    book.fail(None, FAULT)
    assert board.now.press.state == "done"


def test_the_hours_counter_is_told_in_portions_and_of_nothing_twice(book, store, budget, now_s):
    budget.note_lit()
    now_s[0] = 8.0
    book.save_light_hours(at_least_s=10.0)
    now_s[0] = 12.0
    book.save_light_hours(at_least_s=10.0)
    book.save_light_hours()
    assert store.light_on_s == [12.0, 0.0]
