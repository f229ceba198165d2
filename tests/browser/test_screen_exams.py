"""Whose exam it is, in a real Chromium: never by accident, never somebody else's, and each act in the audit."""

from __future__ import annotations

import math
import re
import signal
from collections.abc import Callable, Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from daemon_process import QUICK_HAND, Daemon
from opened_screen import held, let_go, opened, shoot
from playwright.sync_api import Page, Route, expect
from scanned import scan
from screen_layout import wrong_in
from served_probe import ServedProbe

from device.instrument.watch import clock_watch
from device.records.audit import recorded
from device.records.exams import exam_content

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


def cut(page: Page) -> None:
    """Cut the page's streams: it takes the connection for lost, and yet is answered what it has asked for."""
    page.route("**/api/v1/events", lambda route: route.abort())
    page.evaluate("for (const stream of window.streams) stream.close()")
    expect(page.locator("#connection-lost")).to_be_visible()
    expect(page.locator("dialog[open]")).to_have_count(0)


def connect(page: Page) -> None:
    page.unroute("**/api/v1/events")
    expect(page.locator("#connection-lost")).to_be_hidden()


@pytest.fixture
def cut_off(page: Page) -> Iterator[Page]:
    """A page of its own that `cut` can cut off."""
    browser = page.context.browser
    assert browser is not None
    one = browser.new_page(locale="en-GB", viewport={"width": 800, "height": 480})
    one.add_init_script(STREAMS)
    yield one
    one.close()


def test_a_press_that_began_meanwhile_is_shown_when_the_connection_comes_back(daemon: Daemon, cut_off: Page):
    """A scan is still under way when this page's streams are cut, and when they are let through again."""
    cut_off.goto(daemon.url)
    cut_off.locator("#menu-open").click()
    cut(cut_off)
    assert daemon.ask("/api/v1/presses", "POST", {"mode": "precise"}).status == 202
    connect(cut_off)
    expect(cut_off.locator("#press-button")).to_have_text("Cancel")
    expect(cut_off.locator("dialog[open]")).to_have_count(0)


def test_a_question_that_was_answered_while_the_connection_was_lost_does_not_come_back(daemon: Daemon, cut_off: Page):
    cut_off.goto(daemon.url)
    expect(cut_off.locator("#modes")).to_be_visible()
    cut_off.locator("#exam-button").click()
    cut_off.locator("#operator").fill("Ada")
    late = held(cut_off, "**/api/v1/exams")
    with cut_off.expect_request("**/api/v1/exams"):
        cut_off.locator("#begin-phantom").click()
    cut(cut_off)
    let_go(cut_off, late)
    expect(cut_off.locator("#exam-button")).to_have_attribute("data-who", "phantom")
    connect(cut_off)
    expect(cut_off.locator("dialog[open]")).to_have_count(0)


def test_a_measurement_that_is_void_is_not_asked_about_again_when_the_connection_comes_back(
    daemon: Daemon, cut_off: Page
):
    exam = make(daemon)
    open_exam(cut_off, daemon, "A-17")
    press_in(daemon, exam)
    cut_off.locator("#act-void").click()
    late = held(cut_off, "**/void")
    with cut_off.expect_request("**/void"):
        cut_off.locator("#void-reasons .button").first.click()
    cut(cut_off)
    let_go(cut_off, late)
    expect(cut_off.locator("#result")).to_have_attribute("data-voided", "true")
    connect(cut_off)
    expect(cut_off.locator("dialog[open]")).to_have_count(0)


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


def zone_where_it_is(hour: int, at: datetime) -> str:
    """Return the zone of the clocks that show this hour at a moment; the names of these zones count westwards."""
    ahead = (hour - at.astimezone(UTC).hour + 9) % 24 - 9
    return f"Etc/GMT{-ahead:+d}"


def reload(page: Page) -> None:
    page.reload()


@pytest.fixture
def left_open(page: Page, daemon: Daemon) -> Iterator[Callable[..., Page]]:
    """Open an exam in a page of its own at an hour of the day, and come back later, as by loading it anew."""
    browser, pages = page.context.browser, list[Page]()
    assert browser is not None

    def leaving(
        exam: dict[str, object], hour: int, later: timedelta, come_back: Callable[[Page], None] = reload
    ) -> Page:
        made_at = datetime.fromisoformat(str(exam["made_at"]))
        zone, panel = zone_where_it_is(hour, made_at), {"width": 800, "height": 480}
        context = browser.new_context(locale="en-GB", timezone_id=zone, viewport=panel)  # type: ignore[arg-type]
        one = context.new_page()
        pages.append(one)
        one.clock.set_fixed_time(made_at)
        open_exam(one, daemon, str(exam["patient_ref"]))
        one.clock.set_fixed_time(made_at + later)
        come_back(one)
        return one

    yield leaving
    for one in pages:
        one.goto("about:blank")
        one.context.close()


def expect_asked(page: Page) -> None:
    expect(page.locator("#kept-sure")).to_contain_text("Go on with the exam of A\u201117, begun ")
    expect(page.locator("#kept-where")).to_have_text("Left 10 o'clock, 35 mm")
    expect(page.locator("#exam-who")).to_have_text("Choose patient")


def test_an_exam_of_this_hour_is_open_again_after_a_reload(daemon: Daemon, left_open: Callable[..., Page]):
    page = left_open(make(daemon), 12, timedelta(hours=1, minutes=50))
    expect(page.locator("#exam-who")).to_have_text("A-17")
    expect(page.locator("#modes")).to_be_visible()
    expect(page.locator("#chooser")).to_be_hidden()


def test_an_exam_that_has_rested_is_open_again_only_by_yes(daemon: Daemon, left_open: Callable[..., Page]):
    exam = make(daemon)
    page = left_open(exam, 12, timedelta(hours=2, minutes=10))
    expect_asked(page)
    made_on = datetime.fromisoformat(str(exam["made_at"])).strftime("%Y")
    expect(page.locator("#kept-sure")).to_contain_text(made_on)
    assert wrong_in(page) == []
    expect(page.locator("#kept-no")).to_be_focused()
    page.locator("#kept-yes").click()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    assert daemon.ask("/api/v1/status").json["press"] is None


def test_an_exam_of_the_day_before_is_asked_about_and_no_leaves_it_for_good(
    daemon: Daemon, left_open: Callable[..., Page]
):
    page = left_open(make(daemon), 23, timedelta(hours=1))
    expect_asked(page)
    page.locator("#kept-no").click()
    expect(page.locator("#patient-ref")).to_be_visible()
    expect(page.locator("#patient-ref")).to_have_value("")
    page.reload()
    expect(page.locator("#modes")).to_be_visible()
    expect(page.locator("#chooser")).to_be_hidden()
    expect(page.locator("#exam-who")).to_have_text("Choose patient")


def test_who_puts_the_question_away_has_no_exam_and_is_asked_after_the_next_reload(
    daemon: Daemon, left_open: Callable[..., Page]
):
    page = left_open(make(daemon), 12, timedelta(days=3))
    expect_asked(page)
    page.keyboard.press("Escape")
    expect(page.locator("#chooser")).to_be_hidden()
    page.locator("#press-button").click()
    expect(page.locator("#patient-ref")).to_be_visible()
    assert daemon.ask("/api/v1/status").json["press"] is None
    page.reload()
    expect_asked(page)


def test_a_press_of_this_hour_keeps_an_exam_of_the_day_before_open(daemon: Daemon, left_open: Callable[..., Page]):
    exam = make(daemon)
    asked = daemon.ask("/api/v1/presses", "POST", {"exam_id": exam["id"]})
    assert asked.status == 202
    daemon.ask(f"/api/v1/presses/{asked.json['id']}", "DELETE")
    page = left_open(exam, 12, timedelta(minutes=1))

    def begun_before(route: Route) -> None:
        answer = route.fetch()
        route.fulfill(response=answer, json=answer.json() | {"made_at": "2026-11-01T08:00:00.000Z"})

    page.route(f"**/api/v1/exams/{exam['id']}", begun_before)
    page.reload()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    expect(page.locator("#modes")).to_be_visible()
    expect(page.locator("#chooser")).to_be_hidden()


def test_an_exam_of_before_that_has_rested_is_asked_about_and_no_leaves_the_open_one(page: Page, daemon: Daemon):
    made = make(daemon)
    make(daemon, patient_ref="B-22")
    open_exam(page, daemon, "B-22")
    later = page.context.browser.new_context(locale="en-GB", viewport={"width": 800, "height": 480}).new_page()  # type: ignore[union-attr]
    open_exam(later, daemon, "B-22")
    later.clock.set_fixed_time(datetime.fromisoformat(str(made["made_at"])) + timedelta(hours=2, minutes=10))
    later.locator("#exam-button").click()
    later.locator("#recent .recent").filter(has_text="A-17").click()
    expect(later.locator("#kept-sure")).to_contain_text("Go on with the exam of A\u201117, begun ")
    expect(later.locator("#exam-who")).to_have_text("B-22")
    shoot(later, "exam-of-before-rested")
    assert wrong_in(later) == []
    later.locator("#kept-no").click()
    expect(later.locator("#patient-ref")).to_be_visible()
    later.locator("#chooser-close").click()
    expect(later.locator("#exam-who")).to_have_text("B-22")
    later.locator("#exam-button").click()
    later.locator("#recent .recent").filter(has_text="A-17").click()
    later.locator("#kept-yes").click()
    expect(later.locator("#exam-who")).to_have_text("A-17")
    later.goto("about:blank")
    later.context.close()


def test_an_exam_of_before_that_the_probe_knows_late_is_not_opened_in_place_of_another(page: Page, daemon: Daemon):
    before = make(daemon, patient_ref="C-3")
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    page.locator("#operator").fill("Ada")
    asked = re.compile(f"/presses\\?exam_id={before['id']}")
    late = held(page, asked)
    with page.expect_request(asked):
        page.locator("#recent .recent").filter(has_text="C-3").click()
    page.locator("#patient-ref").fill("D-4")
    page.locator("#to-place").click()
    let_go(page, late)
    expect(page.locator("#exam-who")).to_have_text("Choose patient")
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-who")).to_have_text("D-4")


def test_an_exam_of_before_that_the_probe_knows_late_is_not_opened_in_a_press(page: Page, daemon: Daemon):
    browser = page.context.browser
    assert browser is not None
    exam, before = make(daemon), make(daemon, patient_ref="C-3")
    wide = browser.new_context(locale="en-GB", viewport={"width": 1280, "height": 800}).new_page()
    wide.goto(daemon.url)
    wide.locator("#beside-list .recent").filter(has_text="A-17").click()
    expect(wide.locator("#exam-who")).to_have_text("A-17")
    asked = re.compile(f"/presses\\?exam_id={before['id']}")
    late = held(wide, asked)
    with wide.expect_request(asked):
        wide.locator("#beside-list .recent").filter(has_text="C-3").click()
    begun = daemon.ask("/api/v1/presses", "POST", {"mode": "precise", "exam_id": exam["id"]})
    assert begun.status == 202, begun.body
    expect(wide.locator("#press-button")).to_have_text("Cancel")
    let_go(wide, late)
    expect(wide.locator("#exam-who")).to_have_text("A-17")
    wide.goto("about:blank")
    wide.context.close()


def test_a_finger_that_bounces_on_the_button_opens_no_exam_of_before(page: Page, daemon: Daemon):
    """The second touch comes 0.25 s later, 20 px aside: by a clock that stands still in between."""
    browser = page.context.browser
    assert browser is not None
    for number in range(6):
        make(daemon, patient_ref=f"A-{number}")
    now = datetime.now(UTC)
    noon = f"Etc/GMT{now.hour - 12:+d}"  # ten minutes on it is the same day there
    context = browser.new_context(
        locale="en-GB", timezone_id=noon, viewport={"width": 800, "height": 480}, has_touch=True
    )
    panel = context.new_page()
    panel.clock.install(time=now)
    panel.goto(daemon.url)
    expect(panel.locator("#modes")).to_be_visible()
    panel.clock.pause_at(now + timedelta(minutes=10))
    box = panel.locator("#press-button").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    panel.touchscreen.tap(x, y)
    expect(panel.locator("#recent .recent")).to_have_count(6)
    row = panel.evaluate_handle("([x, y]) => document.elementFromPoint(x, y).closest('.recent')", [x + 20, y])
    assert row.as_element() is not None, "no exam of before lies under the button: nothing is tested"
    panel.clock.run_for(250)
    panel.touchscreen.tap(x + 20, y)
    panel.clock.run_for(600)
    expect(panel.locator("#chooser")).to_be_visible()
    expect(panel.locator("#exam-who")).to_have_text("Choose patient")
    panel.touchscreen.tap(x + 20, y)  # on purpose
    expect(panel.locator("#chooser")).to_be_hidden()
    expect(panel.locator("#exam-who")).to_contain_text("A-")
    panel.goto("about:blank")
    context.close()


def test_the_order_of_one_patient_is_not_taken_over_to_another(page: Page, daemon: Daemon):
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    for name, text in (("patient-ref", "A-17"), ("operator", "Ada"), ("order-number", "2026/1")):
        page.locator(f"#{name}").fill(text)
    page.locator("#to-place").click()
    page.locator('.chooser-page[data-page="where"] .to-who').click()
    expect(page.locator("#order-number")).to_have_value("2026/1")
    page.locator("#patient-ref").fill("B-22")
    expect(page.locator("#order-number")).to_have_value("")
    page.locator("#to-place").click()
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    made = daemon.ask("/api/v1/exams").json["exams"][0]
    assert (made["patient_ref"], made["order_number"]) == ("B-22", None)


def press_in(daemon: Daemon, exam: dict[str, object]) -> None:
    answer = daemon.ask("/api/v1/presses", "POST", {"mode": "quick", "exam_id": exam["id"]})
    assert answer.status == 202, answer.body
    assert daemon.ended(answer.headers["location"])["state"] == "done"


def test_what_was_said_of_one_exam_does_not_stand_under_the_name_of_another(page: Page, daemon: Daemon):
    exam = make(daemon)
    make(daemon, patient_ref="B-22")
    open_exam(page, daemon, "A-17")
    press_in(daemon, exam)
    said = page.locator("#status-line")
    page.locator("#act-finish").click()
    expect(said).to_contain_text("Exam of A-17 finished.")
    page.locator("#exam-button").click()
    page.locator("#recent .recent").filter(has_text="B-22").click()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    expect(said).not_to_contain_text("A-17")


def test_an_exam_that_is_finished_stays_so_when_the_probe_answers_late_how_it_was(page: Page, daemon: Daemon):
    exam = make(daemon)
    open_exam(page, daemon, "A-17")
    asked = f"**/api/v1/exams/{exam['id']}"
    late = held(page, asked)
    with page.expect_request(asked):  # as after each press
        press_in(daemon, exam)
    page.locator("#act-finish").click()
    expect(page.locator("#exam-who")).to_have_text("Choose patient")
    with page.expect_response("**/api/v1/device"):  # asked for when the answer has been taken over
        late[0].continue_()
    expect(page.locator("#exam-who")).to_have_text("Choose patient")
    expect(page.locator("#status-line")).to_contain_text("Exam of A-17 finished.")


def test_a_measurement_that_comes_late_is_not_drawn_over_one_of_the_history(page: Page, daemon: Daemon):
    exam = make(daemon)
    open_exam(page, daemon, "A-17")
    press_in(daemon, exam)
    title = page.locator("#image-title")
    expect(title).to_have_text("Measurement 1, Quick")
    first = daemon.ask("/api/v1/status").json["measurement_id"]
    asked = re.compile(f"/api/v1/measurements/(?!{first})[0-9a-f-]+$")
    late = held(page, asked)
    with page.expect_request(asked):
        press_in(daemon, exam)
    page.locator("#history-open").click()
    expect(page.locator(".kept")).to_have_count(2)
    page.locator(".kept-open").last.click()
    expect(page.locator("#act-now")).to_be_visible()
    with page.expect_response("**/api/v1/device"):  # asked for when the newest has been taken over
        late[0].continue_()
    expect(title).to_have_text("Measurement 1, Quick")
    page.locator("#act-now").click()
    expect(title).to_have_text("Measurement 2, Quick")


def test_how_far_measurements_agree_is_not_said_of_the_exam_before(page: Page, daemon: Daemon):
    """It stood below the first press of the next exam, until the probe had said which measurements that one has."""
    exam, other = make(daemon), make(daemon, patient_ref="B-22")
    open_exam(page, daemon, "A-17")
    for _ in range(2):
        press_in(daemon, exam)
    agreement = page.locator("#repeats")
    expect(agreement).to_contain_text("2 measurements here")
    page.locator("#act-finish").click()
    page.locator("#exam-button").click()
    page.locator("#recent .recent").filter(has_text="B-22").click()
    expect(page.locator("#exam-who")).to_have_text("B-22")
    asked = re.compile(f"/measurements\\?.*exam_id={other['id']}")
    held(page, asked, most=math.inf)
    with page.expect_request(asked):
        press_in(daemon, other)
    expect(page.locator("#image-title")).to_have_text("Measurement 3, Quick")
    expect(page.locator("#result")).to_be_visible()
    expect(agreement).to_have_text("")


def test_that_an_exam_is_finished_is_said_for_some_seconds(page: Page, daemon: Daemon):
    browser = page.context.browser
    assert browser is not None
    exam = make(daemon)
    panel = browser.new_context(locale="en-GB", viewport={"width": 800, "height": 480}).new_page()
    panel.clock.install()
    panel.goto(daemon.url)
    panel.locator("#exam-button").click()
    panel.locator("#recent .recent").click()
    expect(panel.locator("#exam-who")).to_have_text("A-17")
    press_in(daemon, exam)
    panel.locator("#act-finish").click()
    expect(panel.locator("#status-line")).to_contain_text("Exam of A-17 finished.")
    panel.clock.fast_forward(7000)
    expect(panel.locator("#status-line")).not_to_contain_text("A-17")
    panel.goto("about:blank")
    panel.context.close()


def touch_press(page: Page) -> None:
    page.locator("#press-button").click()


def look_again(page: Page) -> None:
    """Have the page told that it is shown again, as on a tablet that was laid aside."""
    page.evaluate("document.dispatchEvent(new Event('visibilitychange'))")


def test_a_press_into_an_exam_that_has_rested_is_asked_about_before_it_starts(
    daemon: Daemon, left_open: Callable[..., Page]
):
    page = left_open(make(daemon), 12, timedelta(hours=2, minutes=10), touch_press)
    expect_asked(page)
    shoot(page, "exam-rested")
    assert wrong_in(page) == []
    assert daemon.ask("/api/v1/status").json["press"] is None
    page.locator("#kept-yes").click()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    page.locator("#press-button").click()  # asked once, not again
    expect(page.locator("#press-button")).to_have_text("Cancel")


def test_a_page_that_is_shown_again_on_the_next_day_asks_and_its_press_belongs_to_nobody(
    daemon: Daemon, left_open: Callable[..., Page]
):
    page = left_open(make(daemon), 23, timedelta(hours=1), look_again)
    expect_asked(page)
    page.keyboard.press("Escape")
    expect(page.locator("#press-button")).to_have_text("Choose patient")
    page.locator("#press-button").click()
    expect(page.locator("#patient-ref")).to_be_visible()
    assert daemon.ask("/api/v1/status").json["press"] is None
    page.reload()
    expect_asked(page)


def test_a_page_that_nobody_touches_asks_by_itself(page: Page, daemon: Daemon):
    browser, exam = page.context.browser, make(daemon)
    assert browser is not None
    panel = browser.new_context(locale="en-GB", viewport={"width": 800, "height": 480}).new_page()
    panel.clock.install(time=datetime.fromisoformat(str(exam["made_at"])))
    open_exam(panel, daemon, "A-17")
    panel.clock.fast_forward("02:10:00")
    expect_asked(panel)
    panel.goto("about:blank")
    panel.context.close()


def test_an_exam_that_is_pressed_in_elsewhere_does_not_rest(daemon: Daemon, left_open: Callable[..., Page]):
    exam = make(daemon)

    def press_after_one_hour_pressed_elsewhere(page: Page) -> None:
        pressed = {"asked_at": recorded(datetime.fromisoformat(str(exam["made_at"])) + timedelta(hours=1))}
        page.route("**/api/v1/presses?exam_id=*", lambda route: route.fulfill(json={"presses": [pressed]}))
        touch_press(page)

    page = left_open(exam, 12, timedelta(hours=2, minutes=10), press_after_one_hour_pressed_elsewhere)
    expect(page.locator("#press-button")).to_have_text("Cancel")
    expect(page.locator("#exam-who")).to_have_text("A-17")


def test_the_question_fits_the_smallest_screen_in_the_longer_language(page: Page, daemon: Daemon):
    browser = page.context.browser
    assert browser is not None
    exam = make(daemon, patient_ref="PATIENTENNUMMER-2026-11-0017-A")
    small = browser.new_context(locale="de-DE", viewport={"width": 480, "height": 320}).new_page()
    small.goto(daemon.url)
    expect(small.locator("#modes")).to_be_visible()
    small.locator("#exam-button").click()
    small.locator(".recent").click()
    expect(small.locator("#exam-who")).to_have_text(str(exam["patient_ref"]))
    small.clock.set_fixed_time(datetime.fromisoformat(str(exam["made_at"])) + timedelta(days=3))
    small.reload()
    expect(small.locator("#kept-sure")).to_contain_text("Weiter mit der Untersuchung von")
    assert wrong_in(small) == []
    small.goto("about:blank")
    small.context.close()


def test_a_press_into_an_exam_of_more_than_a_week_is_refused_in_plain_words(
    page: Page, probe: ServedProbe, monkeypatch: pytest.MonkeyPatch
):
    browser, store = page.context.browser, probe.procedure.store
    assert browser is not None
    monkeypatch.setattr(clock_watch, "STEADY_S", 0.0)
    exam = store.exams.make(exam_content(EXAM))
    made_at = recorded(datetime.now(UTC) - timedelta(days=8))
    with store._transaction() as db:
        db.execute("UPDATE exam SET record = json_set(record, '$.made_at', ?) WHERE id = ?", (made_at, exam["id"]))
    old = opened(browser, probe)
    old.locator("#exam-button").click()
    old.locator(".recent").click()
    old.locator("#kept-yes").click()
    old.locator("#press-button").click()
    expect(old.locator("#status-line")).to_contain_text(
        "The exam was begun more than 7 days ago. Begin a new exam, and press again."
    )
    assert store.last_press() is None
    old.context.close()


@pytest.mark.long
def test_a_press_begun_elsewhere_is_added_to_the_exam_and_no_result_is_anothers(page: Page, daemon: Daemon):
    exam = make(daemon)
    make(daemon, patient_ref="B-22")
    open_exam(page, daemon, "A-17")
    job = daemon.press("quick")
    expect(page.locator("#status-line")).to_contain_text("A press without a patient was measured. It is in the history")
    expect(page.locator("#result")).to_be_hidden()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    page.locator("#history-open").click()
    page.locator("#history-all").click()
    page.locator(".kept-open").click()
    expect(page.locator("#exam-who")).to_have_text("Free press: no patient")
    page.locator("#act-file").click()
    page.locator("#move-yes").click()
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


def test_another_place_of_an_exam_that_was_corrected_meanwhile_is_asked_for_anew(page: Page, daemon: Daemon):
    exam = make(daemon)
    open_exam(page, daemon, "A-17")
    page.locator("#modes label").filter(has_text="Quick").click()
    page.locator("#press-button").click()
    page.locator("#act-place").click()
    page.locator('.hour[data-side="right"][data-hour="2"]').click()
    change = {"by": "Bo", "reason": "Another patient", "changes": {"patient_ref": "B-18"}}
    headers = {"If-Match": f'"{exam["version"]}"'}
    assert daemon.ask(f"/api/v1/exams/{exam['id']}", "PATCH", change, headers=headers).status == 200
    page.locator("#begin-exam").click()
    expect(page.locator("#chooser-problem")).to_contain_text("Somebody changed this exam meanwhile.")
    expect(page.locator("#where-of")).to_have_text("Where is the lesion of B\u201118?")
    assert len(daemon.ask("/api/v1/exams").json["exams"]) == 1
    page.locator('.hour[data-side="right"][data-hour="2"]').click()
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-where")).to_have_text("Right 2 o'clock")
    assert daemon.ask("/api/v1/exams").json["exams"][0]["patient_ref"] == "B-18"
