"""An exam is begun of a step that was shown lately, and that no newer answer ought to have and has not."""

from dataclasses import replace
from datetime import date

import pytest

from device.dicom.hospital import MOST_ANSWERS, SHOWN_FOR_MIN, ShownSteps
from device.dicom.subject import OrderedStudy
from device.dicom.worklist import ScheduledStep, WorklistQuery
from device.errors import UnknownResource

ALL, TODAY, TOMORROW = WorklistQuery(), WorklistQuery(date(2026, 11, 23)), WorklistQuery(date(2026, 11, 24))


class Clock:
    now_s = 5000.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def shown(clock):
    return ShownSteps(clock)


def step(patient_ref, day="20261123", order_number="1"):
    order = OrderedStudy(f"1.2.{patient_ref}", patient_ref, order_number)
    return ScheduledStep(f"step of {patient_ref}", order, f"{day}101500")


ANA, BO = step("A"), step("B")


def is_gone(shown, one):
    with pytest.raises(UnknownResource, match=r"not shown the step step of .* within 15 minutes.*Ask for the worklist"):
        shown.step(one.id)
    return True


def test_a_step_holds_for_fifteen_minutes_since_it_was_asked_for(clock, shown):
    asked_s = shown.now_s()
    clock.now_s += 30.0  # so long the worklist took to answer
    shown.keep(ALL, [ANA], asked_s)
    clock.now_s = asked_s + 60.0 * SHOWN_FOR_MIN
    assert shown.step(ANA.id) == ANA
    clock.now_s += 0.001
    assert is_gone(shown, ANA)
    assert is_gone(shown, BO)
    shown.keep(ALL, [ANA], shown.now_s())
    assert shown.step(ANA.id) == ANA


def test_what_a_newer_answer_to_the_same_query_has_not_is_gone(clock, shown):
    shown.keep(TODAY, [ANA, BO], shown.now_s())
    clock.now_s += 1.0
    shown.keep(TODAY, [BO], shown.now_s())
    assert is_gone(shown, ANA)
    assert shown.step(BO.id) == BO


@pytest.mark.parametrize(
    "newer",
    [ALL, TODAY, WorklistQuery(patient_ref="A"), WorklistQuery(order_number="1"), WorklistQuery(None, "A", "1")],
)
def test_a_newer_answer_to_another_query_that_ought_to_have_it_counts_too(clock, shown, newer):
    shown.keep(WorklistQuery(date(2026, 11, 23), "A", "1"), [ANA], shown.now_s())
    clock.now_s += 1.0
    shown.keep(newer, [], shown.now_s())
    assert is_gone(shown, ANA)
    clock.now_s += 1.0
    shown.keep(newer, [ANA], shown.now_s())  # it is ordered again
    assert shown.step(ANA.id) == ANA


@pytest.mark.parametrize("newer", [TOMORROW, WorklistQuery(patient_ref="B"), WorklistQuery(order_number="2")])
def test_an_answer_that_need_not_have_it_says_nothing_of_it(clock, shown, newer):
    shown.keep(TODAY, [ANA], shown.now_s())
    clock.now_s += 1.0
    shown.keep(newer, [], shown.now_s())
    assert shown.step(ANA.id) == ANA


def test_an_answer_that_comes_late_brings_nothing_back(clock, shown):
    early_s, late_s = shown.now_s(), shown.now_s() + 5.0
    clock.now_s = late_s
    shown.keep(TODAY, [], late_s)
    shown.keep(TODAY, [ANA], early_s)
    shown.keep(ALL, [ANA], early_s)
    assert is_gone(shown, ANA)


def test_only_so_many_answers_are_kept_and_the_newest_of_them(clock, shown):
    for number in range(MOST_ANSWERS + 1):
        clock.now_s += 1.0
        shown.keep(WorklistQuery(patient_ref=f"P-{number}"), [step(f"P-{number}")], shown.now_s())
    assert is_gone(shown, step("P-0"))
    assert shown.step(step("P-1").id).order.patient_ref == "P-1"


def is_withdrawn(shown, one, scheduled_at="20261123101500"):
    try:
        shown.require_still_there(one.order, scheduled_at)
    except UnknownResource as refusal:
        return "no longer" in str(refusal)
    return False


def test_an_exam_goes_on_with_its_order_until_an_answer_that_ought_to_have_it_has_not(clock, shown):
    assert not is_withdrawn(shown, ANA)  # nobody has asked since the daemon was started
    shown.keep(TODAY, [ANA], shown.now_s())
    clock.now_s += 3600.0 * 24 * 6
    assert not is_withdrawn(shown, ANA)
    shown.keep(TOMORROW, [], shown.now_s())
    assert not is_withdrawn(shown, ANA)
    shown.keep(TODAY, [BO], shown.now_s() + 1.0)
    assert is_withdrawn(shown, ANA)
    clock.now_s += 3600.0
    shown.keep(WorklistQuery(patient_ref="C"), [], shown.now_s())
    assert is_withdrawn(shown, ANA)  # also while that answer is too old to begin an exam of
    assert not is_withdrawn(shown, BO)
    clock.now_s += 1.0
    shown.keep(TOMORROW, [step("A", "20261124")], shown.now_s())  # it was put off
    assert not is_withdrawn(shown, ANA)


def test_of_an_exam_whose_day_is_not_known_a_list_of_a_day_says_nothing(shown):
    shown.keep(TODAY, [], shown.now_s())
    assert not is_withdrawn(shown, ANA, "")
    shown.keep(WorklistQuery(patient_ref="A"), [], shown.now_s())
    assert is_withdrawn(shown, ANA, "")


def test_an_answer_of_which_no_exam_is_begun_any_more_keeps_no_names(clock, shown):
    named = ScheduledStep("n", replace(ANA.order, patient={"name": "Ana"}), ANA.scheduled_at)
    shown.keep(TODAY, [named], shown.now_s())
    assert "Ana" in repr(shown._answers)
    clock.now_s += 60.0 * SHOWN_FOR_MIN + 1.0
    shown.keep(TOMORROW, [], shown.now_s())
    assert "Ana" not in repr(shown._answers)
    assert not is_withdrawn(shown, ANA)
