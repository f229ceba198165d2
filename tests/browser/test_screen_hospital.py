"""The hospital at the screen, by a real archive and worklist: an ordered exam is begun, sent and confirmed."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from datetime import date
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from daemon_process import QUICK_HAND, Daemon
from opened_screen import SIZES, shoot
from ordered_step import ordered
from orthanc import OWN_TITLE, TITLE, Orthanc, needs_orthanc
from playwright.sync_api import Page, expect
from screen_layout import wrong_in

from device.records.manifest import note_removed

pytestmark = [pytest.mark.browser, pytest.mark.real_time, pytest.mark.long, needs_orthanc]


@pytest.fixture
def archive(tmp_path: Path) -> Iterator[Orthanc]:
    """An archive that is not running yet, with a step of today in its worklist."""
    made = Orthanc(tmp_path)
    ordered(made.worklists, "ana", day=f"{date.today():%Y%m%d}")
    yield made
    made.close()


@pytest.fixture
def daemon(page: Page, archive: Orthanc, tmp_path: Path) -> Iterator[Daemon]:
    scene = (
        f'[settings.dicom]\narchive_host = "127.0.0.1"\narchive_port = {archive.port}\narchive_title = "{TITLE}"\n'
        f'worklist_host = "127.0.0.1"\nworklist_port = {archive.port}\nworklist_title = "{TITLE}"\n'
        f'own_title = "{OWN_TITLE}"\nsend_phantoms = true\n'  # its presses are simulated
    )
    running = Daemon(tmp_path, scene + QUICK_HAND)
    yield running
    page.goto("about:blank")
    running.stop()


def look(page: Page, name: str) -> None:
    """Have axe and the ruler look at the page at both sizes of a panel."""
    for width, height in SIZES[:2]:
        page.set_viewport_size({"width": width, "height": height})
        shoot(page, f"hospital/{name}-{width}")
        assert wrong_in(page) == [], (name, width)
    page.set_viewport_size({"width": SIZES[0][0], "height": SIZES[0][1]})
    assert Axe().run(page).response["violations"] == [], name


def follow_rule(folder: Path, recording_id: str) -> None:
    """Note in the store what the rule for old recordings notes, which it follows once an hour."""
    with closing(sqlite3.connect(folder / "var" / "tsis.sqlite")) as db, db:
        note_removed(db, recording_id, "older than 30 days")


def test_an_ordered_exam_is_begun_measured_and_sent(page: Page, archive: Orthanc, daemon: Daemon, tmp_path: Path):
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    expect(page.locator("#ordered")).to_have_text("The hospital's worklist does not answer. Scan or type the patient.")
    look(page, "worklist-silent")
    page.locator("#chooser-close").click()
    archive.start()
    page.locator("#exam-button").click()
    steps = page.locator("#ordered .recent")
    expect(steps).to_have_text(["Ana MüllerA-17 (HOSP)born 02/01/1970 · 10:15 · Palpable lesion · 2026/1"])
    look(page, "worklist")
    page.locator("#operator").fill("Ada")
    steps.first.click()
    expect(page.locator("#where-of")).to_have_text("Where is the lesion of Ana Müller?")
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-who")).to_have_text("A-17 (HOSP)")
    made = daemon.ask("/api/v1/exams").json["exams"][0]
    assert (made["patient_ref"], made["order_number"], made["operator"]) == ("A-17", "2026/1", "Ada")
    page.locator("#history-open").click()
    expect(page.locator("#history-none")).to_be_visible()
    expect(page.locator("#archive")).to_be_hidden()  # there is nothing to send
    page.locator("#history-close").click()
    page.locator("#modes label").filter(has_text="Quick").click()
    page.locator("#press-button").click()
    expect(page.locator("#image-title")).to_have_text("Measurement 1, Quick")
    archive.kill()
    page.locator("#history-open").click()
    state, send = page.locator(".archive-state"), page.locator("#archive-send")
    expect(state).to_have_text("Not sent yet.")
    look(page, "archive-not-sent")
    second = page.context.browser.new_context(locale="en-GB").new_page()  # another screen looks at the same exam
    second.goto(daemon.url)
    expect(second.locator("#modes")).to_be_visible()
    second.locator("#exam-button").click()
    second.locator("#recent .recent").click()
    second.locator("#history-open").click()
    expect(second.locator(".archive-state")).to_have_text("Not sent yet.")
    send.click()
    expect(state).to_contain_text("The archive does not answer. It is tried again at")
    expect(send).to_have_attribute("aria-disabled", "true")
    look(page, "archive-waits")
    archive.start()
    expect(state).to_have_text("In the archive: 2 objects, confirmed.")
    expect(second.locator(".archive-state")).to_have_text("In the archive: 2 objects, confirmed.")
    second.context.close()
    look(page, "archive-confirmed")
    page.locator("#history-close").click()
    page.locator("#press-button").click()
    expect(page.locator("#image-title")).to_have_text("Measurement 2, Quick")
    page.locator("#history-open").click()
    expect(state).to_have_text("Not sent yet: 1 of 2 measurements.")
    expect(state).to_have_attribute("data-tone", "caution")
    look(page, "archive-unsent")
    follow_rule(tmp_path, daemon.ask("/api/v1/measurements").json["measurements"][0]["recording_id"])
    send.click()
    expect(state).to_have_text("Not sent: 1 of 2 measurements, whose recordings were deleted by rule.")
    look(page, "archive-missing")
    exam = daemon.ask("/api/v1/exams").json["exams"][0]
    change = {"by": "Bo", "reason": "Wrong side", "changes": {"side": "right"}}
    headers = {"If-Match": f'"{exam["version"]}"'}
    assert daemon.ask(f"/api/v1/exams/{exam['id']}", "PATCH", change, headers=headers).status == 200
    expect(state).to_have_text("Not sent yet: 2 of 2 measurements.")  # notes of what was recalled are no measurements
    assert {one["PatientName"] for one in archive.kept()} == {"Müller^Ana"}
    page.locator("#history-all").click()
    expect(page.locator("#archive")).to_be_hidden()


def test_an_order_that_was_withdrawn_meanwhile_leads_back_to_the_list(page: Page, archive: Orthanc, daemon: Daemon):
    archive.start()
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    page.locator("#operator").fill("Ada")
    page.locator("#ordered .recent").click()
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    (archive.worklists / "ana.wl").unlink()
    assert daemon.ask(f"/api/v1/worklist?day={date.today():%Y-%m-%d}").json == {"steps": []}  # another screen asks
    page.locator("#begin-exam").click()
    expect(page.locator("#chooser-problem")).to_have_text("This order is too old or withdrawn. Choose again.")
    expect(page.locator("#ordered")).to_have_text("Nothing is ordered.")
    expect(page.locator("#patient-ref")).to_have_value("")
    look(page, "worklist-gone")
    assert daemon.ask("/api/v1/exams").json["exams"] == []


def begin_ordered(page: Page, daemon: Daemon) -> None:
    """Begin an exam of the step that is shown, at a place of the body."""
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    page.locator("#operator").fill("Ada")
    page.locator("#ordered .recent").click()
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    page.locator("#begin-exam").click()


def test_an_exam_that_is_not_in_the_ordered_study_is_told_of_before_its_first_press(
    page: Page, archive: Orthanc, daemon: Daemon
):
    """Another exam of the order is there, and the hospital has corrected the patient's name since."""
    archive.start()
    [step] = daemon.ask("/api/v1/worklist").json["steps"]
    made = daemon.ask("/api/v1/worklist/exams", "POST", {"step": step["id"], "operator": "Ada"})
    assert (made.status, "own_study" in made.json) == (201, False)
    ordered(archive.worklists, "ana", day=f"{date.today():%Y%m%d}", PatientName="Meier^Ana")
    begin_ordered(page, daemon)
    expect(page.locator(".question:visible")).to_have_text("This exam is sent as a study of its own.")
    look(page, "apart")
    page.locator("#apart-yes").click()
    expect(page.locator("#chooser")).to_be_hidden()
    expect(page.locator("#exam-who")).to_have_text("A-17 (HOSP)")
    told = daemon.ask("/api/v1/exams").json["exams"][0]["own_study"]
    assert told.startswith("The ordered study has an exam with another patient's name: ")


def to_another_place(page: Page, side: str) -> None:
    """Measure, and open the map for another place of the same patient."""
    page.locator("#modes label").filter(has_text="Quick").click()
    page.locator("#press-button").click()
    expect(page.locator("#act-place")).to_be_visible()
    page.locator("#act-place").click()
    expect(page.locator("#where-of")).to_have_text("Where is the lesion of A\u201117 (HOSP)?")
    page.locator(f'.hour[data-side="{side}"][data-hour="2"]').click()


def test_another_place_is_of_the_order_before_and_after_a_reload_until_it_is_withdrawn(
    page: Page, archive: Orthanc, daemon: Daemon
):
    archive.start()
    begin_ordered(page, daemon)
    expect(page.locator("#exam-where")).to_have_text("Left 10 o'clock")
    to_another_place(page, "right")
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-where")).to_have_text("Right 2 o'clock")
    page.reload()
    expect(page.locator("#exam-where")).to_have_text("Right 2 o'clock")
    to_another_place(page, "left")
    look(page, "another-place")
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-where")).to_have_text("Left 2 o'clock")
    exams = daemon.ask("/api/v1/exams").json["exams"]
    whose = {(one["patient_ref"], one["patient_issuer"], one["order_number"]) for one in exams}
    assert (len(exams), whose) == (3, {("A-17", "HOSP", "2026/1")})
    (archive.worklists / "ana.wl").unlink()
    assert daemon.ask(f"/api/v1/worklist?day={date.today():%Y-%m-%d}").json == {"steps": []}  # another screen asks
    to_another_place(page, "right")
    page.locator("#begin-exam").click()
    expect(page.locator("#chooser-problem")).to_have_text("This order is too old or withdrawn. Choose again.")
    assert len(daemon.ask("/api/v1/exams").json["exams"]) == 3


def test_without_archive_and_worklist_nothing_of_them_is_there(page: Page, tmp_path: Path):
    daemon = Daemon(tmp_path, QUICK_HAND)
    exam = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "operator": "Ada"}
    daemon.ask("/api/v1/exams", "POST", exam)
    page.goto(daemon.url)
    expect(page.locator("#modes")).to_be_visible()
    page.locator("#exam-button").click()
    expect(page.locator("#ordered-today")).to_be_hidden()
    page.locator(".recent").click()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    page.locator("#modes label").filter(has_text="Quick").click()
    page.locator("#press-button").click()
    expect(page.locator("#image-title")).to_have_text("Measurement 1, Quick")
    page.locator("#history-open").click()
    expect(page.locator(".kept")).to_have_count(1)
    expect(page.locator("#archive")).to_be_hidden()
    page.goto("about:blank")
    daemon.stop()
