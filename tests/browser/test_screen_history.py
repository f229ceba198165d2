"""What was measured, in a real Chromium: of one lesion and no other, as it is now, whoever has changed it."""

from __future__ import annotations

import pytest
from kept_measurements import keep
from opened_screen import opened, shoot
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
EXAM = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "operator": "Ada"}


def exam_of(page: Page, probe: ServedProbe, **changes: object) -> str:
    """Make an exam; return its id."""
    answer = page.request.post(f"{probe.url}/api/v1/exams", data=EXAM | changes)
    assert answer.ok, answer.text()
    return str(answer.json()["id"])


def open_history(page: Page, words: str) -> None:
    """Go on with an exam, and open what was measured."""
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text=words).first.click()
    expect(page.locator("#exam-button")).to_contain_text(words)
    page.locator("#history-open").click()


def test_two_lesions_of_one_patient_have_a_trend_each(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    left, right = exam_of(page, probe), exam_of(page, probe, side="right", clock_position=2)
    again = exam_of(page, probe, nipple_distance_mm=35.0)
    for number, exam_id in ((41, left), (42, right), (43, right), (44, right), (45, again)):
        keep(probe.procedure.store, number, exam_id=exam_id)
    open_history(page, "Left 10 o'clock, 35 mm")
    page.locator("#history-patient").click()
    expect(page.locator(".kept")).to_have_count(5)
    expect(page.locator(".trend")).to_have_count(2)
    expect(page.locator(".trend").first).to_contain_text("Size in mm, Left 10 o'clock, with")
    expect(page.locator(".trend").first.locator(".trend-value")).to_have_count(2)
    shoot(page, "history-trend")
    assert wrong_in(page) == []
    page.context.close()


def test_the_reason_of_a_void_one_is_said_in_the_language_of_who_reads_it(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe, locale="de-DE")
    exam_id = exam_of(page, probe, patient_ref="B-22")
    keep(probe.procedure.store, 51, exam_id=exam_id)
    open_history(page, "B-22")
    page.locator(".kept-open").click()
    page.locator("#act-void").click()
    page.get_by_role("button", name="Sonde abgerutscht").click()
    expect(page.locator("#status-reason")).to_contain_text("Sonde abgerutscht")
    voided = probe.procedure.store.measurement("m-51")["voided"]
    assert (voided["by"], voided["reason"]) == ("Ada", "The probe slipped")
    page.context.close()
    page = opened(browser, probe)
    open_history(page, "B-22")
    page.locator(".kept-open").click()
    expect(page.locator("#status-reason")).to_contain_text("The probe slipped")
    page.context.close()


def test_what_another_screen_does_is_shown_in_an_open_history_and_result(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    exam_id = exam_of(page, probe, patient_ref="C-5")
    keep(probe.procedure.store, 55, exam_id=exam_id)
    probe.procedure.board.update(measurement_id="m-55")
    open_history(page, "C-5")
    page.locator(".marker input").check()
    page.locator(".marker input").focus()
    keep(probe.procedure.store, 56, exam_id=exam_id)
    expect(page.locator(".kept")).to_have_count(2)
    expect(page.locator('.kept[data-id="m-55"] input')).to_be_checked()
    expect(page.locator('.kept[data-id="m-55"] input')).to_be_focused()
    page.locator("#history-close").click()
    other = opened(browser, probe)
    open_history(other, "C-5")
    page.locator("#history-open").click()
    page.locator('.kept[data-id="m-55"] .kept-open').click()
    expect(page.locator("#instruction")).to_have_text("Measured in part")
    other.locator('.kept[data-id="m-55"] .kept-open').click()
    other.locator("#act-void").click()
    other.get_by_role("button", name="Wrong place").click()
    expect(page.locator("#instruction")).to_have_text("Void: does not count")
    expect(page.locator("#result")).to_have_attribute("data-voided", "true")
    probe.procedure.board.update(measurement_id=None)
    for one in (page, other):
        one.context.close()
