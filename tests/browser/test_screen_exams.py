"""Whose exam it is, in a real Chromium: never by accident, never somebody else's, and each act in the audit."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon_process import QUICK_HAND, Daemon
from playwright.sync_api import Page, Route, expect
from scanned import scan
from screen_layout import wrong_in

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
EXAM = {
    "kind": "patient",
    "patient_ref": "A-17",
    "side": "left",
    "clock_position": 10,
    "nipple_distance_mm": 35.0,
    "operator": "Ada",
}


@pytest.fixture
def daemon(page: Page, tmp_path: Path) -> Iterator[Daemon]:
    running = Daemon(tmp_path, QUICK_HAND)
    yield running
    page.goto("about:blank")
    page.context.clear_cookies()
    running.stop()


def make(daemon: Daemon, **changes: object) -> dict[str, object]:
    answer = daemon.ask("/api/v1/exams", "POST", EXAM | changes)
    assert answer.status == 201, answer.body
    found: dict[str, object] = answer.json
    return found


def open_exam(page: Page, daemon: Daemon, patient: str) -> None:
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text=patient).first.click()
    expect(page.locator("#exam-who")).to_have_text(patient)


def test_what_was_missing_on_the_map_is_said_until_it_is_there_and_a_distance_can_be_taken_back(
    page: Page, daemon: Daemon
):
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    page.locator("#patient-ref").fill("G-3")
    page.locator("#operator").fill("Ada")
    page.locator("#patient-ref").press("Enter")
    page.locator("#begin-exam").click()
    expect(page.locator("#chooser-problem")).to_have_text("Choose side and clock position.")
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    expect(page.locator("#chooser-problem")).to_have_text("")
    not_said = page.locator("#distance").inner_text()
    page.locator("#farther").click()
    expect(page.locator("#distance")).to_have_text("30 mm")
    for _ in range(7):
        page.locator("#nearer").click()
    expect(page.locator("#distance")).to_have_text(not_said)
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-where")).to_have_text("Left 10 o'clock")
    assert daemon.ask("/api/v1/exams").json["exams"][0]["nipple_distance_mm"] is None


def test_an_exam_whose_answer_is_lost_is_begun_once_however_often_the_button_is_touched(page: Page, daemon: Daemon):
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()

    def lose_the_answer(route: Route) -> None:
        route.fetch()
        route.abort()

    page.route("**/api/v1/exams", lose_the_answer, times=1)
    page.locator("#exam-button").click()
    page.locator("#operator").fill("Ada")
    page.locator("#begin-phantom").click()
    expect(page.locator("#chooser-problem")).not_to_be_empty()
    page.locator("#begin-phantom").click()
    expect(page.locator("#chooser")).to_be_hidden()
    assert len(daemon.ask("/api/v1/exams?kind=phantom").json["exams"]) == 1
    page.locator("#exam-button").click()
    page.locator("#begin-phantom").click()
    expect(page.locator("#chooser")).to_be_hidden()
    assert len(daemon.ask("/api/v1/exams?kind=phantom").json["exams"]) == 2


def test_a_page_that_shows_an_old_exam_does_not_measure_but_shows_it_anew(page: Page, daemon: Daemon):
    exam = make(daemon)
    open_exam(page, daemon, "A-17")
    expect(page.locator("#exam-where")).to_have_text("Left 10 o'clock, 35 mm")
    change = {"by": "Bo", "reason": "Wrong side", "changes": {"side": "right"}}
    headers = {"If-Match": f'"{exam["version"]}"'}
    assert daemon.ask(f"/api/v1/exams/{exam['id']}", "PATCH", change, headers=headers).status == 200
    page.locator("#press-button").click()
    expect(page.locator("#status-line")).to_contain_text("Somebody changed this exam meanwhile.")
    expect(page.locator("#exam-where")).to_have_text("Right 10 o'clock, 35 mm")
    assert daemon.ask("/api/v1/status").json["press"] is None
    assert wrong_in(page) == []
    page.locator("#press-button").click()
    expect(page.locator("#press-button")).to_have_text("Cancel")


def test_what_is_typed_is_there_again_when_the_connection_comes_back(page: Page, daemon: Daemon):
    page.goto(daemon.url)
    page.locator("#exam-button").click()
    page.locator("#patient-ref").fill("A-17")
    daemon.process.send_signal(signal.SIGSTOP)
    expect(page.locator("#connection-lost")).to_be_visible()
    expect(page.locator("dialog[open]")).to_have_count(0)
    daemon.process.send_signal(signal.SIGCONT)
    expect(page.locator("#connection-lost")).to_be_hidden()
    expect(page.locator("#chooser")).to_be_visible()
    expect(page.locator("#patient-ref")).to_have_value("A-17")
    page.locator("#free-press").click()
    expect(page.locator("#free-yes")).to_be_visible()


STREAMS = """
window.streams = [];
window.EventSource = class extends EventSource { constructor(url) { super(url); window.streams.push(this); } };
"""


def test_a_press_that_began_meanwhile_is_shown_when_the_connection_comes_back(page: Page, daemon: Daemon):
    """A scan is still under way when this page's streams are cut, and when they are let through again."""
    browser = page.context.browser
    assert browser is not None
    cut_off = browser.new_page()
    cut_off.add_init_script(STREAMS)
    cut_off.goto(daemon.url)
    cut_off.locator("#menu-open").click()
    cut_off.route("**/api/v1/events", lambda route: route.abort())
    cut_off.evaluate("for (const stream of window.streams) stream.close()")
    expect(cut_off.locator("#connection-lost")).to_be_visible()
    assert daemon.ask("/api/v1/presses", "POST", {"mode": "precise"}).status == 202
    cut_off.unroute("**/api/v1/events")
    expect(cut_off.locator("#press-button")).to_have_text("Cancel")
    expect(cut_off.locator("dialog[open]")).to_have_count(0)
    cut_off.close()


def test_a_scanner_fills_in_the_patient_and_its_enter_presses_nothing(page: Page, daemon: Daemon):
    make(daemon)
    make(daemon, patient_ref="B-22")
    open_exam(page, daemon, "B-22")
    page.locator("#press-button").focus()
    scan(page, "A-17")
    expect(page.locator("#scanned")).to_have_text("Scanned: A-17")
    expect(page.locator(".recent")).to_have_count(1)
    assert daemon.ask("/api/v1/status").json["press"] is None
    page.locator(".recent").click()
    expect(page.locator("#exam-who")).to_have_text("A-17")


def test_a_press_without_a_patient_is_asked_for_on_purpose_after_every_load(page: Page, daemon: Daemon):
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#press-button").click()
    expect(page.locator("#chooser")).to_be_visible()
    assert daemon.ask("/api/v1/status").json["press"] is None
    page.locator("#free-press").click()
    expect(page.locator("#free-yes")).to_be_visible()
    page.locator("#free-yes").click()
    expect(page.locator("#exam-who")).to_have_text("Free press: no patient")
    page.reload()
    expect(page.locator("#exam-who")).to_have_text("Choose patient")


@pytest.mark.long
def test_a_press_begun_elsewhere_is_added_to_the_exam_and_no_result_is_anothers(page: Page, daemon: Daemon):
    exam = make(daemon)
    make(daemon, patient_ref="B-22")
    open_exam(page, daemon, "A-17")
    job = daemon.press("quick")
    expect(page.locator("#status-line")).to_contain_text("Not in this exam.")
    page.locator("#act-file").click()
    expect(page.locator("#act-file")).to_be_hidden()
    moved = daemon.ask(f"/api/v1/measurements/{job['measurement_id']}").json
    assert moved["exam_id"] == exam["id"]
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text="B-22").click()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    expect(page.locator("#result")).to_be_hidden()
    page.locator("#history-open").click()
    expect(page.locator("#history-none")).to_be_visible()
    page.locator("#history-all").click()
    expect(page.locator(".kept")).to_have_count(1)
    expect(page.locator(".kept")).to_contain_text("A-17 Left 10 o'clock, 35 mm")


def test_enter_twice_starts_and_cancels_and_the_focus_stays(page: Page, daemon: Daemon):
    make(daemon)
    open_exam(page, daemon, "A-17")
    button = page.locator("#press-button")
    button.focus()
    page.keyboard.press("Enter")
    expect(button).to_have_text("Cancel")
    expect(button).to_be_focused()
    expect(page.locator("#header")).to_have_js_property("inert", value=True)
    page.keyboard.press("Enter")
    expect(page.locator("#instruction")).to_have_text("Cancelled")
    expect(button).to_be_focused()
    assert daemon.ask("/api/v1/status").json["press"]["state"] == "cancelled"


def test_by_the_keyboard_alone_an_exam_is_begun_and_enter_goes_on(page: Page, daemon: Daemon):
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").focus()
    page.keyboard.press("Enter")
    page.locator("#patient-ref").press_sequentially("K-9", delay=100)  # as a hand types
    page.keyboard.press("Enter")
    expect(page.locator("#chooser-problem")).to_have_text("Say who examines.")
    page.keyboard.press("Tab")
    expect(page.locator("#operator")).to_be_focused()
    page.keyboard.type("Ada", delay=100)
    page.keyboard.press("Enter")
    expect(page.locator("#where-of")).to_be_visible()
    page.locator('.hour[data-side="right"][data-hour="4"]').focus()
    page.keyboard.press("Space")
    page.locator("#begin-exam").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#exam-where")).to_have_text("Right 4 o'clock")
