"""The screen of a PC in a real Chromium: the exams stand beside the press, as they are, and out of reach during one."""

from __future__ import annotations

from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from daemon_process import QUICK_HAND, Daemon
from opened_screen import shoot
from playwright.sync_api import Browser, Request, expect
from screen_layout import wrong_in

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
EXAM = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "operator": "Ada"}
ELSEWHERE = {"kind": "patient", "patient_ref": "B-22", "side": "right", "clock_position": 2, "operator": "Bo"}


@pytest.mark.long
@pytest.mark.parametrize("width", [1280, 1920])
def test_the_exams_stand_beside_the_press(browser: Browser, tmp_path: Path, width: int):
    daemon = Daemon(tmp_path, QUICK_HAND)
    page = browser.new_context(locale="en-GB", viewport={"width": width, "height": width * 5 // 8}).new_page()
    page.goto(daemon.url)
    expect(page.locator("#beside-list")).to_have_text("There are none yet.")
    daemon.ask("/api/v1/exams", "POST", EXAM)
    rows = page.locator("#beside .recent")
    expect(rows).to_have_count(1)  # another screen has made it
    rows.first.click()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    expect(rows.first).to_have_attribute("aria-current", "true")
    page.locator("#modes label").filter(has_text="Quick").click()
    page.locator("#press-button").click()
    expect(page.locator("#beside")).to_have_js_property("inert", value=True)
    kept = page.locator("#beside .kept-open")
    expect(kept).to_have_count(1)
    expect(page.locator("#image-title")).to_have_text("Measurement 1, Quick")
    expect(page.locator("#beside")).to_have_js_property("inert", value=False)
    page.wait_for_function("() => [...document.images].every(one => !one.src || one.complete)")
    shoot(page, f"wide-{width}")
    assert wrong_in(page) == []
    assert Axe().run(page).response["violations"] == []
    daemon.ask("/api/v1/exams", "POST", ELSEWHERE)
    rows.filter(has_text="B-22").click()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    expect(page.locator("#result")).to_be_hidden()  # nobody's result under another's name
    expect(kept).to_have_count(0)
    rows.filter(has_text="A-17").click()
    kept.click()
    expect(page.locator("#status-word")).to_have_text("Measurement of before.")
    page.locator("#beside-new").click()
    expect(page.locator("#chooser")).to_be_visible()
    page.context.close()
    daemon.stop()


def test_a_screen_without_room_for_it_asks_for_no_list(browser: Browser, tmp_path: Path):
    daemon, asked = Daemon(tmp_path, QUICK_HAND), list[str]()
    page = browser.new_context(viewport={"width": 1024, "height": 768}).new_page()

    def note(request: Request) -> None:
        asked.append(request.url)

    page.on("request", note)
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    expect(page.locator("#beside")).to_be_hidden()
    assert [url for url in asked if "/exams" in url] == []
    with page.expect_response("**/exams?kind=patient*"):
        page.set_viewport_size({"width": 1280, "height": 800})
    expect(page.locator("#beside")).to_be_visible()
    page.context.close()
    daemon.stop()
