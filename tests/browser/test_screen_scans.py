"""What a scanner types, in a real Chromium, whatever has the focus: it is the patient's, or the screen asks whose."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from opened_screen import opened, shoot
from playwright.sync_api import Browser, Page, expect
from scanned import scan
from screen_layout import wrong_in
from served_probe import ServedProbe

pytestmark = [pytest.mark.browser, pytest.mark.real_time]


@pytest.fixture
def choosing(browser: Browser, probe: ServedProbe) -> Iterator[Page]:
    """The page that asks whose exam it is, with a patient and who examines."""
    page = opened(browser, probe)
    page.locator("#exam-button").click()
    page.locator("#patient-ref").fill("PREV-7")
    page.locator("#operator").fill("Ada")
    yield page
    page.goto("about:blank")
    page.context.close()


def test_a_scan_while_who_examines_is_typed_is_the_patients(choosing: Page):
    choosing.locator("#operator").focus()
    scan(choosing, "NEXT-8")
    expect(choosing.locator("#scanned")).to_have_text("Scanned: NEXT-8")
    expect(choosing.locator("#patient-ref")).to_have_value("NEXT-8")
    expect(choosing.locator("#operator")).to_have_value("Ada")
    shoot(choosing, "exams/scanned-over-operator")
    choosing.locator("#patient-ref").fill("PREV-7")
    choosing.locator("#patient-ref").focus()
    scan(choosing, "NEXT-9")
    expect(choosing.locator("#patient-ref")).to_have_value("NEXT-9")


def test_a_scan_while_a_mode_has_the_focus_is_the_patients(choosing: Page):
    choosing.locator("#chooser-close").click()
    choosing.locator("#modes input").first.focus()
    scan(choosing, "NEXT-8")
    expect(choosing.locator("#patient-ref")).to_have_value("NEXT-8")


def test_a_scan_into_the_orders_field_is_asked_about(choosing: Page):
    choosing.locator("#order-number").press_sequentially("12", delay=100)  # as a hand types
    scan(choosing, "ORD-5")
    expect(choosing.locator("#scan-sure")).to_contain_text("Scanned: ORD\u20115. Is it the patient's or the order's")
    shoot(choosing, "exams/scanned-over-order")
    assert wrong_in(choosing) == []
    choosing.locator("#scan-order").click()
    expect(choosing.locator("#order-number")).to_have_value("ORD-5")
    expect(choosing.locator("#patient-ref")).to_have_value("PREV-7")
    choosing.locator("#order-number").focus()
    scan(choosing, "NEXT-8")
    choosing.locator("#scan-patient").click()
    expect(choosing.locator("#patient-ref")).to_have_value("NEXT-8")
    expect(choosing.locator("#order-number")).to_have_value("")
