"""The probe's own panel, in a real Chromium, whose browser remembers nothing and has no place for files.

What was chosen there is there again after a power-off, and a file is said to be where another machine has it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from chromium import CHROMIUM, FLAGS
from daemon_process import Daemon
from kept_measurements import keep
from opened_screen import SIZES, named, opened, shoot
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe, served_probe

from device.files.screen_choices import NAME, ScreenChoices, read_choices
from device.records.exams import ExamContent
from device.web.entrance.network import ServedNetwork

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
ENGLISH, GERMAN = "Choose whose exam it is", "Wählen, wessen Untersuchung es ist"
DATA = "var"
SEEN = """
window.seen = new Set();
const note = () => {
  const root = document.documentElement;
  if (!root) return;
  seen.add(`colours ${root.dataset.colours}`);
  const words = document.getElementById("instruction")?.textContent.trim();
  if (words) seen.add(words);
};
new MutationObserver(note).observe(document, { subtree: true, childList: true, attributes: true, characterData: true });
"""
"""Notes every colour scheme and every instruction that the page has had."""


@pytest.fixture
def daemon(tmp_path: Path) -> Iterator[Daemon]:
    running = Daemon(tmp_path)
    yield running
    if running.process.poll() is None:
        running.stop()


def switched_on(browser: Browser, daemon: Daemon) -> Page:
    """Return the screen in a browser that remembers nothing, as the panel's after each power-off."""
    page = browser.new_context(locale="en-GB", viewport={"width": 800, "height": 480}).new_page()
    page.add_init_script(SEEN)
    page.goto(daemon.url)
    return page


def choose_german(page: Page) -> None:
    page.locator("#menu-open").click()
    page.locator("#language-de").click()
    expect(page.locator("#instruction")).to_have_text(GERMAN)


def test_what_was_chosen_is_there_again_after_a_power_off(browser: Browser, daemon: Daemon, tmp_path: Path):
    page = switched_on(browser, daemon)
    expect(page.locator("#instruction")).to_have_text(ENGLISH)
    page.locator("#menu-open").click()
    for name in ("sound-off", "colours-dark"):
        with page.expect_response("**/api/v1/screen") as kept:
            page.locator(f"#{name}").click()
        assert kept.value.status == 200
    page.locator("#menu-close").click()
    choose_german(page)
    page.context.close()
    assert read_choices(tmp_path / DATA) == ScreenChoices("de", "dark", "off")
    assert daemon.stop() == 0
    restarted = Daemon(tmp_path)
    try:
        page = switched_on(browser, restarted)
        expect(page.locator("#instruction")).to_have_text(GERMAN)
        assert page.evaluate("localStorage.length") == 0
        said = page.evaluate("[...seen]")
        assert {one for one in said if one.startswith("colours")} == {"colours dark"}
        assert not [one for one in said if "Conn" in one or one == ENGLISH], said
        page.locator("#menu-open").click()
        for name in ("sound-off", "colours-dark", "language-de"):
            expect(page.locator(f"#{name}")).to_have_attribute("aria-pressed", "true")
        shoot(page, "panel/switched-on-again")
        page.goto(f"{restarted.url}/pair")
        expect(page.locator("h1")).to_have_text("Mit der Sonde koppeln")
        page.context.close()
    finally:
        restarted.stop()


def test_a_browser_that_remembers_has_its_own_choice(browser: Browser, daemon: Daemon):
    page = switched_on(browser, daemon)
    choose_german(page)
    daemon.ask("/api/v1/screen", "PATCH", {"language": "en", "colours": "light"})
    page.reload()
    expect(page.locator("#instruction")).to_have_text(GERMAN)
    expect(page.locator("html")).to_have_attribute("data-colours", "light")
    page.context.close()


def test_a_disk_that_takes_nothing_does_not_break_the_menu(browser: Browser, daemon: Daemon, tmp_path: Path):
    (tmp_path / DATA / NAME).mkdir()  # nothing can be written in its place
    page = switched_on(browser, daemon)
    with page.expect_response("**/api/v1/screen") as refused:
        choose_german(page)
    assert refused.value.status == 507
    page.reload()
    expect(page.locator("#instruction")).to_have_text(GERMAN)
    page.context.close()
    page = switched_on(browser, daemon)
    expect(page.locator("#instruction")).to_have_text(ENGLISH)
    page.context.close()


def test_a_probe_that_does_not_answer_does_not_break_the_menu(browser: Browser, daemon: Daemon):
    page = switched_on(browser, daemon)
    page.route("**/api/v1/screen", lambda route: None)
    choose_german(page)
    page.context.close()


def kept_exam(probe: ServedProbe, number: int) -> None:
    """Keep a measurement of an exam of a patient who is called by its number."""
    content = ExamContent(kind="patient", patient_ref=f"A-{number}", side="left", clock_position=10, operator="Ada")
    keep(probe.procedure.store, number, exam_id=probe.procedure.store.exams.make(content)["id"])


def open_files(page: Page, number: int) -> None:
    """Open the history of an exam, where report and table are."""
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text=f"A-{number}").first.click()
    page.locator("#menu-open").click()
    page.locator("#menu-history").click()


WORDS = {
    "en-GB": (
        "Report (PDF)",
        "Recording",
        "No file can be saved at this screen.",
        "Pair a machine.",
        "none can reach this probe",
    ),
    "de-DE": (
        "Bericht (PDF)",
        "Aufnahme",
        "An diesem Bildschirm lässt sich keine Datei speichern.",
        "Gerät koppeln.",
        "keines kann diese Sonde erreichen",
    ),
}
PANEL = {"has_touch": True, "is_mobile": True}


PAIRS = [(True, 0, "en-GB"), (True, 1, "de-DE"), (False, 0, "de-DE"), (False, 1, "en-GB")]
"""Served by a network or alone, size and language: every pair of two of them."""


@pytest.mark.parametrize(
    ("is_served", "size", "language"),
    [
        pytest.param(
            served, SIZES[size], language, id=f"{'served' if served else 'alone'}-{named(SIZES[size])}-{language}"
        )
        for served, size, language in PAIRS
    ],
)
def test_at_the_panel_a_file_is_where_another_machine_has_it(
    browser: Browser, tmp_path: Path, size: tuple[int, int], language: str, is_served: bool
):
    network = ServedNetwork("https://tsis-0007:8443/", "AB:CD") if is_served else None
    report, recording, why, menu, alone = WORDS[language]
    with served_probe(tmp_path, is_running=False, network=network) as probe:
        kept_exam(probe, 17)
        page = opened(browser, probe, size, locale=language, **PANEL)
        downloads: list[object] = []
        page.on("download", lambda one: downloads.append(one))
        open_files(page, 17)
        expect(page.locator("#exports a")).to_have_count(0)
        page.get_by_role("button", name=report).click()
        said = page.locator("#elsewhere")
        expect(said.locator("h2")).to_have_text(report)
        expect(said).to_contain_text(why)
        expect(said).to_contain_text(menu if is_served else alone)
        expect(page.locator("#elsewhere-address")).to_have_text("https://tsis-0007:8443/" if is_served else "")
        shoot(page, f"panel/{'served' if is_served else 'alone'}-{language[:2]}-{size[0]}")
        assert wrong_in(page) == []
        assert Axe().run(page).response["violations"] == []
        page.locator("#elsewhere-close").click()
        page.locator(".kept-open").click()
        page.locator("#act-details").click()
        page.locator("#details").get_by_role("button", name=recording).click()
        expect(said.locator("h2")).to_have_text(recording)
        assert downloads == []
        page.context.close()


def test_a_panel_that_gets_no_answer_says_so(browser: Browser, probe: ServedProbe):
    kept_exam(probe, 18)
    page = opened(browser, probe, **PANEL)
    open_files(page, 18)
    page.route("**/api/v1/device", lambda route: route.abort())
    page.get_by_role("button", name="Table (CSV)").click()
    expect(page.locator("#elsewhere-how")).to_have_text("The probe did not answer. Try again.")
    page.context.close()


def test_a_kiosk_is_a_panel_also_where_its_board_says_that_it_has_a_mouse(
    browser: Browser, probe: ServedProbe, tmp_path: Path
):
    """As systemd/tsis-kiosk.service starts it, on a Pi whose HDMI counts as a mouse."""
    kept_exam(probe, 19)
    options = {"executable_path": CHROMIUM, "args": [*FLAGS, "--kiosk"], "no_viewport": True}
    context = browser.browser_type.launch_persistent_context(tmp_path / "profile", **options)  # type: ignore[arg-type]
    page = context.pages[0]
    page.goto(probe.url)
    assert page.evaluate("matchMedia('(pointer: coarse)').matches") is False
    open_files(page, 19)
    page.get_by_role("button", name="Report (PDF)").click()
    expect(page.locator("#elsewhere")).to_be_visible()
    page.locator("#elsewhere-close").click()
    page.locator("#history-close").click()
    page.locator("#exam-button").click()
    page.locator("#order-number").click()
    page.locator("#keys").get_by_role("button", name="7", exact=True).click()
    expect(page.locator("#order-number")).to_have_value("7")
    context.close()


def test_on_a_laptop_that_runs_the_probe_itself_a_file_is_downloaded(browser: Browser, probe: ServedProbe):
    kept_exam(probe, 20)
    page = opened(browser, probe)
    open_files(page, 20)
    with page.expect_download() as report:
        page.get_by_role("link", name="Report (PDF)").click()
    assert Path(report.value.path()).read_bytes().startswith(b"%PDF")
    page.locator(".kept-open").click()
    page.locator("#act-details").click()
    with page.expect_download() as recording:
        page.get_by_role("link", name="Recording").click()
    assert re.fullmatch(r"tsis-measurement-.+\.zip", recording.value.suggested_filename)
    page.context.close()
