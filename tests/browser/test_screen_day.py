"""A day at the screen in a real Chromium: three patients, ten presses, a rejection, a fault, a restart and an export.

Every state on the way is looked at by axe, and measured: nothing cut off, nothing too small.
"""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from daemon_process import QUICK_HAND, Daemon
from opened_screen import shoot
from playwright.sync_api import Page, expect
from scanned import scan
from screen_layout import wrong_in

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
MORNING = """[[faults]]
kind = "wet_face"
ratio = 1.0
from_press = 3
"""
NOON = """[[faults]]
kind = "i2c_stuck"
from_press = 3
until_s = 3.0
"""


class Nurse:
    """Somebody at the screen; each state she comes to is looked at once."""

    def __init__(self, page: Page) -> None:
        self.page, self.axe, self.measured = page, Axe(), 0

    def look(self, name: str) -> None:
        """Have axe and the ruler look at the page as it is, and take a photograph."""
        shoot(self.page, f"day/{name}")
        found = self.axe.run(self.page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]})
        assert [one["id"] for one in found.response["violations"]] == [], (name, found.generate_report())
        assert wrong_in(self.page) == [], name

    def tap(self, name: str) -> None:
        self.page.locator(f"#{name}").click()

    def begin_exam(self, patient: str, side: str, hour: int) -> None:
        """Make an exam of a patient who is typed, at a place of the map."""
        self.page.locator("#patient-ref").fill(patient)
        self.page.locator("#operator").fill("Ada")
        self.tap("to-place")
        self.page.locator(f'.hour[data-side="{side}"][data-hour="{hour}"]').click()
        self.tap("farther")
        self.look(f"map-{patient}")
        self.tap("begin-exam")
        expect(self.page.locator("#exam-who")).to_have_text(patient)

    def press(self) -> None:
        """Press once in mode quick, and see its result."""
        expect(self.page.locator("#press-button")).to_have_text("Press the simulated probe")
        expect(self.page.locator("#modes label, #act-mode").filter(visible=True).first).to_be_visible()
        if self.page.locator("#modes").is_visible():
            self.page.locator("#modes label").filter(has_text="Quick").click()
        self.tap("press-button")
        self.measured += 1
        expect(self.page.locator("#image-title")).to_have_text(f"Measurement {self.measured}, Quick")
        expect(self.page.locator("#result")).to_be_visible()


def kept(daemon: Daemon) -> list[dict[str, object]]:
    found: list[dict[str, object]] = daemon.ask("/api/v1/measurements?limit=50").json["measurements"]
    return found


@pytest.mark.long
def test_a_day(page: Page, tmp_path: Path):
    daemon, nurse = Daemon(tmp_path, MORNING + QUICK_HAND), Nurse(page)
    page.goto(daemon.url)
    expect(page.locator("#instruction")).to_have_text("Choose whose exam it is")
    nurse.look("nobody")
    nurse.tap("press-button")
    nurse.look("chooser")
    nurse.begin_exam("A-17", "left", 10)
    expect(page.locator("#instruction")).to_have_text("Touch beside the lesion")
    nurse.look("ready")
    nurse.press()
    nurse.look("result")
    nurse.press()
    expect(page.locator("#repeats")).to_contain_text("2 measurements here, ")
    # the third press is rejected: the face is wet
    nurse.tap("press-button")
    expect(page.locator("#status-reason")).to_contain_text("Wipe gel and sweat off face and skin")
    nurse.look("rejected")
    # a restart: whose exam it is and what was measured are there again
    daemon.stop()
    expect(page.locator("#connection-lost")).to_be_visible()
    nurse.look("lost")
    daemon = Daemon(tmp_path, NOON + QUICK_HAND, port=int(daemon.url.rpartition(":")[2]))
    expect(page.locator("#connection-lost")).to_be_hidden()
    page.reload()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    nurse.press()
    nurse.tap("act-finish")
    expect(page.locator("#exam-who")).to_have_text("Choose patient")
    expect(page.locator("#result")).to_be_hidden()
    # the second patient, from a scanner
    scan(page, "B-22")
    expect(page.locator("#patient-ref")).to_have_value("B-22")
    nurse.begin_exam("B-22", "right", 2)
    nurse.press()
    # a press meets a fault, which passes
    nurse.tap("press-button")
    expect(page.locator(".fault-code")).to_have_text("E202")
    nurse.look("fault")
    expect(page.locator("#faults")).to_be_hidden()
    nurse.press()
    nurse.tap("act-void")
    nurse.look("void")
    page.get_by_role("button", name="The probe slipped").click()
    expect(page.locator("#instruction")).to_have_text("Void: does not count")
    nurse.look("voided")
    nurse.tap("act-place")
    page.locator('.hour[data-side="right"][data-hour="5"]').click()
    nurse.tap("begin-exam")
    expect(page.locator("#exam-where")).to_contain_text("Right 5 o'clock")
    nurse.press()
    nurse.press()
    nurse.tap("act-finish")
    # the third patient
    nurse.tap("exam-button")
    nurse.begin_exam("C-5", "left", 6)
    nurse.press()
    nurse.press()
    nurse.press()
    nurse.tap("act-details")
    expect(page.locator("#details-forces .force-press")).to_have_count(2)  # its image, and what the sign means
    nurse.look("details")
    nurse.tap("details-close")
    nurse.tap("history-open")
    expect(page.locator(".kept")).to_have_count(3)
    nurse.look("history")
    page.locator(".marker").nth(0).click()
    page.locator(".marker").nth(1).click()
    expect(page.locator("#comparison tr")).to_have_count(5)
    nurse.look("comparison")
    nurse.tap("history-patient")
    expect(page.locator(".trend")).to_have_count(2)
    nurse.look("trend")
    nurse.tap("history-exam")
    with page.expect_download() as table:
        page.get_by_role("link", name="Table (CSV)").click()
    assert len(Path(table.value.path()).read_text().splitlines()) == 4
    with page.expect_download() as report:
        page.get_by_role("link", name="Report (PDF)").click()
    assert Path(report.value.path()).read_bytes().startswith(b"%PDF")
    nurse.tap("history-close")
    nurse.tap("menu-open")
    nurse.look("menu")
    page.locator("#language-de").click()
    expect(page.locator("#exam-who")).to_have_text("C-5")
    expect(page.locator("html")).to_have_attribute("lang", "de")
    nurse.look("german")
    measurements = kept(daemon)
    exams = {one["id"]: one for one in daemon.ask("/api/v1/exams").json["exams"]}
    assert len(measurements) == nurse.measured == 10
    assert (
        sorted(exams[one["exam_id"]]["patient_ref"] for one in measurements)
        == ["A-17"] * 3 + ["B-22"] * 4 + ["C-5"] * 3
    )
    assert [bool(one["voided"]) for one in measurements].count(True) == 1
    assert json.dumps(measurements).count("The probe slipped") == 1
    assert daemon.stop() == 0
