"""A daemon that refuses to start, in a real Chromium: the page that says why, its ways out, and the daemon's return."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from daemon_process import wait_for
from fallback_process import Fallback, ProbeRoot, failed_start, good_daemon
from opened_screen import SIZES, named, shoot
from playwright.sync_api import Page, expect
from screen_layout import wrong_in

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
BAD = '[press]\ntarget_n = 99\n[camera]\nexposure_ms = 4\nwidth_px = "wide"\n'


@pytest.fixture
def fallback(page: Page, tmp_path: Path) -> Iterator[Fallback]:
    root = ProbeRoot(tmp_path)
    root.releases("0.2.0+412", committed="0.2.0+412", previous="0.1.0+398")
    running = Fallback(root)
    yield running
    page.goto("about:blank")
    assert running.stop() == 0


def test_bad_settings_are_a_page_that_says_what_is_wrong_and_the_mended_probe_is_the_screen_again(page, fallback):
    root = fallback.root
    page.goto(root.url)
    expect(page.locator("#instruction")).to_have_text("The probe is starting")
    root.settings(BAD)
    said = failed_start(root)
    expect(page.locator("#instruction")).to_have_text("The probe does not start")
    expect(page.locator(".fault-code")).to_have_text("E001")
    for setting in ("press.target_n is 99", "camera.exposure_ms", "camera.width_px"):
        assert setting in said
        expect(page.locator(".fault-cause")).to_contain_text(setting)
    expect(page.locator(".facts")).to_contain_text("0.1.0+398")
    expect(page.locator(".fault-remedy")).to_have_text("Call service.")
    shoot(page, "fallback")
    page.locator(".service summary").click()
    shoot(page, "fallback-details")
    size = page.evaluate("[document.documentElement.scrollWidth, document.documentElement.scrollHeight]")
    assert size == [800, 480]
    root.settings("")
    daemon = good_daemon(root)
    try:
        expect(page.locator("#press-button")).to_have_text("Choose patient")
        assert not (root.folder / "run/tsis/start.json").exists()
    finally:
        daemon.stop()
    expect(page.locator("#instruction")).to_have_text("The probe is starting")


def test_the_page_at_the_probe_goes_back_to_the_last_good_release(page, fallback):
    page.goto(fallback.root.url)
    button = page.locator("#roll-back")
    expect(button).to_have_text("Go back to 0.1.0+398")
    button.click()
    expect(page.locator("#told")).to_contain_text("goes back")
    asked = fallback.root.folder / "var/lib/tsis-update/incoming/roll_back"
    wait_for(asked.exists, bool)


def test_a_release_that_ends_before_it_can_say_why_shows_its_last_words(page, fallback):
    root = fallback.root
    root.command(
        "systemctl",
        "#!/bin/sh\nprintf 'LoadState=loaded\\nActiveState=activating\\nResult=exit-code\\nExecMainStatus=1\\n"
        "ExecMainPID=77\\nMainPID=0\\n'\n",
    )
    root.command("journalctl", "#!/bin/sh\necho \"ModuleNotFoundError: No module named 'numpy' <b>\"\n")
    page.goto(root.url)
    page.locator(".service summary").click()
    expect(page.locator(".fault-cause")).to_contain_text(
        "Release 0.2.0+412 ended before it could say why (exit-code, 1)"
    )
    expect(page.locator(".log")).to_contain_text("No module named 'numpy' <b>")
    shoot(page, "fallback-broken-release")


@pytest.mark.parametrize("size", SIZES, ids=named)
@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_the_page_is_whole_in_the_language_of_the_browser(page, fallback, language, size):
    fallback.root.settings(BAD)
    failed_start(fallback.root)
    options = {"locale": language, "viewport": {"width": size[0], "height": size[1]}}
    page = page.context.browser.new_context(**options).new_page()
    page.goto(fallback.root.url)
    said = {"en-GB": "The probe does not start", "de-DE": "Die Sonde startet nicht"}[language]
    expect(page.locator("#instruction")).to_have_text(said)
    shoot(page, f"fallback-{language[:2]}-{size[0]}")
    wrong = wrong_in(page)
    page.context.close()
    assert wrong == []


def test_the_language_and_colours_that_were_chosen_on_the_screen_hold_here_too(page, fallback):
    page.goto(fallback.root.url)
    page.evaluate("localStorage['tsis.language'] = 'de'; localStorage['tsis.colours'] = 'dark'")
    page.reload()
    expect(page.locator("#instruction")).to_have_text("Die Sonde startet")
    assert page.evaluate("document.documentElement.lang") == "de"
    assert page.evaluate("getComputedStyle(document.getElementById('panel')).backgroundColor") == "rgb(12, 16, 19)"
    page.locator("#roll-back").click()
    expect(page.locator("#told")).to_have_text("Die Sonde geht zur letzten guten Version zurück.")
    page.evaluate("document.getElementById('roll-back').disabled = false")
    page.locator("#roll-back").click()
    expect(page.locator("#told")).to_contain_text("Das ging nicht. The probe was asked to go back already.")
    page.evaluate("localStorage.clear()")


@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
@pytest.mark.parametrize("size", SIZES[:2], ids=named)
def test_at_the_panel_nobody_is_sent_to_downloads_that_it_has_not(page, fallback, language, size):
    options = {"locale": language, "viewport": {"width": size[0], "height": size[1]}, "has_touch": True}
    panel = page.context.browser.new_context(**options, is_mobile=True).new_page()
    panel.goto(fallback.root.url)
    panel.locator("#support").click()
    expect(panel.locator("#told")).to_contain_text("python -m device support")
    shoot(panel, f"panel/support-{language[:2]}-{size[0]}")
    wrong = wrong_in(panel)
    panel.context.close()
    assert wrong == []
