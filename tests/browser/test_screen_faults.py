"""Faults and warnings on the screen: code, meaning and remedy whole at every size, once, and never over the force."""

from __future__ import annotations

import re

import pytest
from kept_measurements import keep, taken
from opened_screen import SIZES, opened, shoot
from playwright.sync_api import Browser, expect
from screen_layout import wrong_in
from served_probe import ServedProbe

from device.errors import DeviceError
from device.fault_table import FAULTS
from device.instrument.press.states import Guidance
from device.instrument.status import PressJob

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
LANGUAGES = ["en-GB", "de-DE"]
LANGUAGES_AND_SIZES = [("en-GB", SIZES[0]), *(("de-DE", size) for size in SIZES)]
"""German is the longer one."""
SERVICE = "Load cell on /dev/tsis-force gave no reading: [Errno 5] the last b'\\x8a|\\x82'."
ERRORS = {entry.code: DeviceError.by_code[entry.code](SERVICE, f"Service of {entry.code}.") for entry in FAULTS}
WARNINGS = tuple(error for error in ERRORS.values() if error.severity == "warning")
STEPS = {
    "ready": Guidance.TOUCH_BESIDE,
    "reference": Guidance.PRESS_SLOWLY,
    "lesion": Guidance.TOUCH_LESION,
    "self_test": Guidance.KEEP_FREE,
}


@pytest.mark.parametrize(("language", "size"), LANGUAGES_AND_SIZES, ids=str)
def test_every_fault_is_whole_and_said_once(browser: Browser, probe: ServedProbe, language: str, size: tuple[int, int]):
    page, wrong = opened(browser, probe, size, locale=language), {}
    for code, error in ERRORS.items():
        if error.severity == "fault":
            probe.procedure.board.update(step="fault", guidance=Guidance.FAULT, fault=error, warnings=())
        else:
            probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, fault=None, warnings=(error,))
        expect(page.locator(".fault-code")).to_have_text([code])
        expect(page.locator(".fault-remedy")).to_have_count(1)
        wrong[code] = wrong_in(page)
        remedy = page.locator(".fault-remedy").inner_text()
        assert len(remedy) > 5
        shown = page.locator("#panel").inner_text()
        assert shown.count(remedy) == 1
        assert "/dev" not in shown
        assert "Errno" not in shown
        if size == SIZES[0] and language == LANGUAGES[0]:
            shoot(page, f"faults/{code}")
    page.context.close()
    assert {code: found for code, found in wrong.items() if found} == {}


@pytest.mark.parametrize(("language", "size"), LANGUAGES_AND_SIZES, ids=str)
def test_warnings_take_room_of_their_own_in_every_step(
    browser: Browser, probe: ServedProbe, language: str, size: tuple[int, int]
):
    page, wrong = opened(browser, probe, size, locale=language), {}
    at_most = 1 if size[1] < 420 else 2
    for step, guidance in STEPS.items():
        press = PressJob("p", "standard", "capturing") if step in ("reference", "lesion") else None
        for count in (0, 1, 2, len(WARNINGS)):
            warnings = WARNINGS[:count]
            probe.procedure.board.update(step=step, guidance=guidance, fault=None, warnings=warnings, press=press)
            expect(page.locator("#panel")).to_have_attribute("data-step", step)
            expect(page.locator(".fault-code")).to_have_count(min(count, at_most))
            more = [re.compile(f" {count - at_most} ")] if count > at_most else []
            expect(page.locator(".fault-more")).to_have_text(more)
            wrong[step, count] = wrong_in(page)
            shoot(page, f"faults/{step}-{count}-{language[:2]}-{size[0]}")
    page.context.close()
    assert {state: found for state, found in wrong.items() if found} == {}


def test_beside_a_press_and_a_fault_a_warning_says_what_it_is_and_not_what_to_do(browser: Browser, probe: ServedProbe):
    """What it says to do contradicts what press or fault say: nobody could follow both."""
    page, warning = opened(browser, probe), ERRORS["E309"]
    press = PressJob("p", "standard", "capturing")
    page.locator("#exam-button").click()
    page.locator("#free-press").click()
    page.locator("#free-yes").click()
    board = probe.procedure.board
    board.update(step="lesion", guidance=Guidance.PRESS_SLOWLY, fault=None, warnings=(warning,), press=press)
    expect(page.locator(".fault-title")).to_have_text(["The load cell does not read zero"])
    expect(page.locator(".fault-remedy")).to_have_count(0)
    shoot(page, "faults/warning-beside-press")
    board.update(step="fault", guidance=Guidance.FAULT, fault=ERRORS["E310"], warnings=(warning,), press=None)
    expect(page.locator(".fault-remedy")).to_have_text(["Do not measure. Call service: its amplifier is set too slow."])
    expect(page.locator("#press-button")).to_have_text("Try again")
    shoot(page, "faults/warning-beside-fault")
    board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, fault=None, warnings=(), press=None)
    page.context.close()


def test_after_a_press_without_light_the_screen_does_not_invite_to_the_next(browser: Browser, probe: ServedProbe):
    page, dark = opened(browser, probe), ERRORS["E203"]
    failed = PressJob("p", "standard", "failed", reason=str(dark), code="E203")
    page.locator("#exam-button").click()
    page.locator("#free-press").click()
    page.locator("#free-yes").click()
    probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, fault=None, warnings=(), press=failed)
    expect(page.locator("#instruction")).to_have_text("Not measured")
    expect(page.locator("#status-reason")).to_have_text("No light, or one side is dark. Do not measure. Call service.")
    shoot(page, "faults/after-a-dark-press")
    probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, press=None)
    expect(page.locator("#instruction")).to_have_text("Touch beside the lesion")
    page.context.close()


def test_what_service_needs_is_one_tap_away(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    probe.procedure.board.update(step="fault", guidance=Guidance.FAULT, fault=ERRORS["E304"], warnings=WARNINGS[:4])
    expect(page.locator(".fault-code")).to_have_count(3)
    expect(page.locator(".fault-more")).to_have_text("and 2 more")
    page.locator(".fault-open").click()
    expect(page.locator("#fault-list dt")).to_have_count(5)
    expect(page.locator("#fault-list")).to_contain_text("/dev/tsis-force")
    assert wrong_in(page) == []
    page.context.close()


@pytest.mark.parametrize(("language", "size"), LANGUAGES_AND_SIZES, ids=str)
def test_a_measurement_from_the_history_says_what_was_warned_of_then(
    browser: Browser, probe: ServedProbe, language: str, size: tuple[int, int]
):
    """Also beside a warning of now, and no more once the screen is back to now."""
    number = 10 * size[0] + LANGUAGES.index(language)
    told = [ERRORS[code].as_record() for code in ("E032", "E030", "E606")]
    keep(probe.procedure.store, number, warnings=told, taken_at=taken(1))
    page, wrong = opened(browser, probe, size, locale=language), {}
    page.evaluate("document.querySelector('#history-open').click()")  # a small page has it in its menu
    page.locator(f'.kept[data-id="m-{number}"] .kept-open').click()
    for count in (0, 1):
        probe.procedure.board.update(warnings=(ERRORS["E030"],)[:count])
        expect(page.locator(".fault-code")).to_have_count(count)
        expect(page.locator("#kept-warnings")).to_contain_text(
            re.compile("E032 .+ · E030 .+ (and 1 more|und 1 weitere)$")
        )
        expect(page.locator(".kept-title")).to_have_count(2)  # a low screen has room for the codes alone
        expect(page.locator("#kept-warnings")).to_be_visible()
        wrong[count] = wrong_in(page)
        shoot(page, f"faults/kept-{count}-{language[:2]}-{size[0]}")
    probe.procedure.board.update(warnings=())
    page.locator("#act-now").click()
    expect(page.locator("#kept-warnings")).to_be_empty()
    page.context.close()
    assert {state: found for state, found in wrong.items() if found} == {}
