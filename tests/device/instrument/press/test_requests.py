"""At most one press waits or is under way; who asks for another finds out why not, and nothing else changes."""

import json
import threading
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from types import SimpleNamespace

import pytest
from probe_card import RECORDING

from device.errors import (
    BusyError,
    CameraError,
    ClockJumpError,
    ExamTooOld,
    LastGoodConfigError,
    ModeUnavailable,
    StaleVersion,
    UnknownResource,
)
from device.instrument.press.requests import PressRequests
from device.instrument.press.states import Guidance
from device.instrument.self_test.report import SelfTestJob
from device.instrument.status import PressJob, StatusBoard
from device.measurement.wanted_accuracy import WantedAccuracy
from device.records.asked_once import AskedOnce
from device.records.audit import recorded
from device.records.exams import AskedExam, ExamContent
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
def finished():
    return threading.Event()


@pytest.fixture
def clock():
    return SimpleNamespace(now="2026-01-02T03:04:05.678Z", is_steady=True)


@pytest.fixture
def requests(board, store, cancelled, finished, called_away, clock):
    return PressRequests(
        board,
        store,
        modes=("paper", "quick", "precise"),
        mode="paper",
        cancelled=cancelled,
        finished=finished,
        called_away=called_away,
        now=lambda: clock.now,
        is_clock_steady=lambda: clock.is_steady,
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


def test_who_is_refused_is_told_who_holds_the_probe_and_since_when(requests, board):
    job = requests.ask("quick")
    since = "2026-01-02T03:04:05.678Z"
    for state in ("waiting", "capturing"):
        with pytest.raises(BusyError, match=f"{job.id} in mode quick, {state}, asked for at {since}") as refusal:
            requests.ask(None)
        assert refusal.value.holder == {"kind": "press", "id": job.id, "mode": "quick", "since": since}
        board.update(press=replace(requests.begin(is_touched=False) or job, state="capturing"))
    board.update(press=replace(job, state="done"), self_test=SelfTestJob("s-1", "2026-01-01T00:00:00Z"))
    with pytest.raises(BusyError) as refusal:
        requests.ask(None)
    assert refusal.value.holder == {"kind": "self_test", "id": "s-1", "mode": None, "since": "2026-01-01T00:00:00Z"}


def test_the_status_has_the_press_from_when_it_is_acknowledged_and_nothing_of_the_one_before(requests, board):
    old = PressJob("p-0", "paper", "done", measurement_id="m-0")
    of_old = {"measurement_id": "m-0", "answer": {}, "scan": object(), "frames_taken": 10, "wanted_n": (0.5,)}
    board.update(press=old, step="result", guidance=Guidance.DONE, **of_old)
    job = requests.ask("quick")
    now = board.now
    assert now.press == job
    assert (now.measurement_id, now.answer, now.scan, now.frames_taken, now.wanted_n) == (None, None, None, 0, ())
    # The operator's line is the procedure's own: it may be asking just now to lift the probe.
    assert (now.step, now.guidance) == ("result", Guidance.DONE)


def test_what_the_last_press_was_told_is_not_told_to_the_one_that_was_asked_for(requests, board):
    once = ClockJumpError("The clock was set.", "Check it.")
    later = ClockJumpError("It was set again.", "Check it.")
    board.update(press=PressJob("p-0", "paper", "done", warnings=(once.as_record(),)), warnings=(once,))
    requests.ask(None)
    board.update(warnings=(once, later))
    requests.begin(is_touched=False)
    assert board.now.warnings == (later,)


def test_a_press_is_kept_together_with_the_request_that_it_answers(requests, store):
    once = AskedOnce("k-1", "POST presses")
    job = requests.ask("quick", once=once)
    assert store.answer_to(once) == json.loads(json.dumps(job.as_record()))
    with pytest.raises(BusyError):
        requests.ask("quick", once=AskedOnce("k-2", "POST presses"))
    assert store.answer_to(AskedOnce("k-2", "POST presses")) is None


def test_a_mode_that_the_probe_does_not_have_is_refused_with_those_it_has(requests):
    with pytest.raises(ModeUnavailable, match="paper, quick, precise"):
        requests.ask("standard")
    assert requests.begin(is_touched=False) is None


def test_a_probe_at_fault_answers_a_request_with_the_fault(requests, board):
    fault = CameraError("No frame came.", "Check the ribbon cable.")
    board.update(fault=fault)
    with pytest.raises(CameraError) as refusal:
        requests.ask(None)
    assert refusal.value is fault


def test_a_press_that_waits_can_be_cancelled_and_no_other(requests, board, store, cancelled):
    job = requests.ask(None)
    with pytest.raises(UnknownResource):
        requests.cancel("another")
    assert not cancelled.is_set()
    requests.cancel(job.id)
    requests.give_up_waiting(3600.0)
    assert cancelled.is_set()
    assert (board.now.press.state, store.press(job.id)["state"]) == ("cancelled", "cancelled")
    assert requests.begin(is_touched=False) is None
    with requests.idle():
        pass


def test_a_press_that_waits_for_too_long_ends_and_says_what_to_do(requests, board, store):
    job = requests.ask(None)
    requests.give_up_waiting(3600.0)
    assert board.now.press.state == "waiting"
    requests.give_up_waiting(0.0)
    assert store.press(job.id)["state"] == "rejected"
    assert "lift it, or tare it" in board.now.press.reason
    assert requests.begin(is_touched=False) is None
    requests.give_up_waiting(0.0)


def test_the_end_of_one_press_by_its_operator_does_not_end_the_next(requests, board, cancelled, finished):
    requests.ask(None)
    job = requests.begin(is_touched=False)
    requests.cancel(job.id)
    assert cancelled.is_set()
    finished.set()
    board.update(press=replace(job, state="cancelled"))
    requests.ask(None)
    assert [event.is_set() for event in (cancelled, finished)] == [False, False]


def test_a_scan_is_asked_to_be_as_sure_as_somebody_wants_it_and_any_other_press_is_not(requests, board):
    wanted = WantedAccuracy({"size_mm": 1.0}, 30.0)
    job = requests.ask("precise", wanted)
    assert (job.until, job.within_s, job.wanted) == ({"size_mm": 1.0}, 30.0, wanted)
    board.update(press=replace(requests.withdraw(), state="failed"))
    job = requests.ask("precise")
    assert (job.until, job.within_s, job.wanted.is_asked) == (None, None, False)


def test_a_scan_is_finished_once_its_first_press_is_complete_and_by_its_own_id_alone(requests, board, finished):
    job = requests.ask("precise")
    for _ in range(2):
        with pytest.raises(BusyError, match="first press on the lesion is not complete"):
            requests.finish(job.id)
        requests.begin(is_touched=False)
    board.update(press=replace(job, state="capturing", ramps=1))
    with pytest.raises(UnknownResource):
        requests.finish("another")
    assert not finished.is_set()
    requests.finish(job.id)
    assert finished.is_set()
    board.update(press=replace(job, state="done", ramps=1))
    with pytest.raises(UnknownResource, match="not under way"):
        requests.finish(job.id)


def test_a_press_that_is_no_scan_ends_by_itself_and_not_by_enough(requests, finished):
    job = requests.ask("quick")
    with pytest.raises(BusyError, match="mode quick ends by itself"):
        requests.finish(job.id)
    assert not finished.is_set()


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


@pytest.fixture
def exam(store):
    return store.exams.make(ExamContent(kind="patient", patient_ref="A-17", operator="Ada"))


def after(exam, **time):
    return recorded(datetime.fromisoformat(exam["made_at"]).astimezone(UTC) + timedelta(**time))


def test_a_press_into_an_exam_of_before_its_longest_time_is_refused_and_nothing_is_kept(
    requests, board, store, clock, exam
):
    audit = store._db.execute("SELECT count(*) FROM audit").fetchall()
    clock.now, before = after(exam, days=7, seconds=1), board.now
    once = AskedOnce("k-1", "POST presses")
    with pytest.raises(ExamTooOld, match="more than 7 days ago.*Begin a new exam") as refused:
        requests.ask(None, once=once, exam=AskedExam(exam["id"]))
    assert (refused.value.code, refused.value.status) == ("E815", 409)
    assert (board.now, store.last_press(), store.answer_to(once)) == (before, None, None)
    assert store._db.execute("SELECT count(*) FROM audit").fetchall() == audit
    assert requests.begin(is_touched=False) is None
    assert requests.ask(None).exam_id is None  # free, and not held up by what was refused


def test_a_press_that_was_begun_in_time_is_kept_in_its_exam(requests, store, clock, exam):
    clock.now = after(exam, days=7)
    once = AskedOnce("k-1", "POST presses")
    job = requests.ask(None, once=once, exam=AskedExam(exam["id"]))
    clock.now = after(exam, days=7, minutes=1)
    requests.begin(is_touched=False)
    store.save_press(replace(job, state="computing").as_record())
    done = replace(job, state="done", measurement_id="m-1").as_record()
    store.add_measurement({"id": "m-1"}, RECORDING, exam_id=job.exam_id, ended=done)
    assert store.measurement("m-1")["exam_id"] == exam["id"]
    assert store.answer_to(once)["id"] == job.id  # sent again it is answered as then


def test_no_age_is_judged_by_a_clock_that_somebody_has_just_set(requests, clock, exam):
    clock.now, clock.is_steady = after(exam, days=20_000), False
    assert requests.ask(None, exam=AskedExam(exam["id"])).exam_id == exam["id"]


def test_an_exam_that_was_begun_after_now_takes_presses(requests, clock, exam):
    clock.now = after(exam, days=-8)
    assert requests.ask(None, exam=AskedExam(exam["id"])).exam_id == exam["id"]


def test_who_has_seen_an_old_version_of_an_old_exam_is_told_that_first(requests, clock, exam):
    clock.now = after(exam, days=8)
    with pytest.raises(StaleVersion):
        requests.ask(None, exam=AskedExam(exam["id"], exam["version"] + 1))
