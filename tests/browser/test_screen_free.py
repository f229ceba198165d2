"""A press of nobody, in a real Chromium: never under a patient's name, and added to an exam only after it was asked."""

from __future__ import annotations

import pytest
from kept_measurements import keep
from opened_screen import SIZES, opened, shoot
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe

from device.instrument.press.states import Guidance
from device.instrument.status import PressJob

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
EXAM = {"kind": "patient", "patient_ref": "B-22", "side": "left", "clock_position": 10, "operator": "Ada"}


def end_free_press(probe: ServedProbe, number: int) -> None:
    """Let a press end that no screen has begun for an exam."""
    keep(probe.procedure.store, number)
    press = PressJob("p", "standard", "done", measurement_id=f"m-{number}")
    told = {"step": "result", "guidance": Guidance.DONE, "press": press, "measurement_id": f"m-{number}"}
    probe.procedure.board.update(**told)


def open_exam(page: Page, probe: ServedProbe) -> str:
    """Begin an exam, and go on with it; return its id."""
    exam = page.request.post(f"{probe.url}/api/v1/exams", data=EXAM).json()
    page.locator("#exam-button").click()
    page.locator(".recent").first.click()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    return str(exam["id"])


@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
@pytest.mark.parametrize("size", SIZES[:2], ids=lambda size: str(size[0]))
def test_a_free_press_of_another_client_is_not_shown_under_a_patients_name(
    browser: Browser, probe: ServedProbe, size: tuple[int, int], language: str
):
    number = 5 + 2 * SIZES.index(size) + (language == "de-DE")
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe, size, locale=language)
    exam_id = open_exam(page, probe)
    end_free_press(probe, number)
    said = "It is in the history" if language == "en-GB" else "Sie steht im Verlauf"
    expect(page.locator("#status-line")).to_contain_text(said)
    expect(page.locator("#result")).to_be_hidden()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    name = f"free/{language[:2]}-{size[0]}"
    shoot(page, f"{name}-kept")
    assert wrong_in(page) == []
    page.evaluate("document.querySelector('#menu-history').click()")
    page.locator("#history-all").click()
    page.locator(f'.kept[data-id="m-{number}"] .kept-open').click()
    expect(page.locator("#exam-button")).to_have_attribute("data-who", "other")
    page.locator("#act-file").click()
    expect(page.locator("#move-sure")).to_contain_text("B-22")
    expect(page.locator("#move-no")).to_be_focused()
    shoot(page, f"{name}-asked")
    assert wrong_in(page) == []
    page.locator("#move-no").click()
    assert probe.procedure.store.measurement(f"m-{number}")["exam_id"] is None
    page.locator("#act-file").click()
    page.locator("#move-yes").click()
    expect(page.locator("#act-file")).to_be_hidden()
    assert probe.procedure.store.measurement(f"m-{number}")["exam_id"] == exam_id
    page.goto("about:blank")
    page.context.close()


def test_where_no_exam_is_open_it_is_headed_in_amber(browser: Browser, probe: ServedProbe):
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe)
    end_free_press(probe, 9)
    expect(page.locator("#result")).to_be_visible()
    expect(page.locator("#exam-who")).to_have_text("Free press: no patient")
    expect(page.locator("#exam-button")).to_have_attribute("data-who", "free")
    shoot(page, "free/nobody")
    assert wrong_in(page) == []
    page.goto("about:blank")
    page.context.close()
