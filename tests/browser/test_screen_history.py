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
