"""Photographs every state of the screen at both sizes of a panel into docs, of a simulated probe in a real Chromium.

`python tests/photograph_screen.py` writes docs/screens and the page that shows them, docs/screen_states.md. It ends
with 1 when the ruler of tests/screen_layout.py or axe finds anything in a state.
"""

from __future__ import annotations

import json
import sys
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from axe_playwright_python.sync_playwright import Axe
from chromium import chromium_page
from daemon_process import QUICK_HAND, ROOT, Daemon, wait_for
from fallback_process import Fallback, ProbeRoot, failed_start
from ordered_step import ordered
from orthanc import OWN_TITLE, TITLE, Orthanc
from PIL import Image
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe, served_probe

from device.errors import DeviceError
from device.instrument.press.states import Guidance
from device.instrument.status import PressJob
from device.simulation.hand import HandSettings
from device.simulation.scenario import Scenario

SHOTS = ROOT / "docs" / "screens"
PAGE = ROOT / "docs" / "screen_states.md"
SIZES = [(800, 480), (480, 320)]
AXE = Axe()
WCAG = {"runOnly": ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]}
COLOURS = 256
"""Of a photograph's palette: half of the file, and nobody sees it."""
EXAM = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "nipple_distance_mm": 35.0}
HAND = Scenario(hand=HandSettings(ramp_rate_n_per_s=0.06))
HEAD = """# The screen's states

This page answers how every state of the [screen](screen.md) looks at the two sizes of a panel.
Written by `python tests/photograph_screen.py` from a simulated probe, with the photographs in `docs/screens`.

| state | 800 x 480 | 480 x 320 |
|---|---|---|
"""


class Album:
    """Two pages of one probe, one a size, to which the same is done; each state is photographed on both."""

    def __init__(self, browser: Browser, url: str, rows: list[str], *, has_touch: bool = False, **more: Any) -> None:
        self._rows, self.wrong = rows, list[str]()
        self.pages: list[Page] = []
        for width, height in SIZES:
            size = {"width": width, "height": height}
            options = {"locale": "en-GB", "viewport": size, "has_touch": has_touch, "is_mobile": has_touch, **more}
            self.pages.append(browser.new_context(**options).new_page())
            self.pages[-1].goto(url)

    def each(self, act: Callable[[Page], object]) -> None:
        for page in self.pages:
            act(page)

    def tap(self, *names: str) -> None:
        """Touch something on both pages; what a small page has in its menu is sought there."""
        for name in names:
            self.each(lambda page, name=name: page.locator(name).click())  # type: ignore[misc]

    def sees(self, name: str, words: str) -> None:
        self.each(lambda page: expect(page.locator(name)).to_contain_text(words))

    def shoot(self, name: str, words: str) -> None:
        """Photograph a state, with words that say which it is, and have the ruler and axe look at it."""
        cells = [f"| {words} "]
        for page, (width, _) in zip(self.pages, SIZES, strict=True):
            page.wait_for_function("() => [...document.images].every(one => !one.src || one.complete)")
            path = SHOTS / f"{name}-{width}.png"
            page.screenshot(path=str(path))
            with Image.open(path) as image:
                image.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
                    path, optimize=True
                )
            self.wrong += [f"{name} {width}: {one}" for one in wrong_in(page)]
            violations = AXE.run(page, options=WCAG).response["violations"]
            self.wrong += [f"{name} {width}: axe {one['id']}" for one in violations]
            cells.append(f"| ![{words}](screens/{path.name}) ")
        self._rows.append("".join(cells) + "|")

    def close(self) -> None:
        self.each(lambda page: page.context.close())


def ask(probe: ServedProbe, path: str, body: dict[str, Any] | None = None) -> Any:
    """Return what the probe answers to a GET, or to a POST with a body."""
    data = None if body is None else json.dumps(body).encode()
    request = urllib.request.Request(f"{probe.url}/api/v1/{path}", data, {"content-type": "application/json"})
    with urllib.request.urlopen(request) as answer:
        return json.loads(answer.read())


def of_the_patient(album: Album) -> None:
    """Whose exam it is: from nobody to a press that is ready."""
    album.each(lambda page: expect(page.locator("#modes")).to_be_visible())
    album.shoot("nobody", "Nobody is chosen yet")
    album.tap("#exam-button")
    album.each(lambda page: expect(page.locator(".recent")).to_have_count(1))
    album.shoot("chooser", "Whose exam it is")
    album.tap("#free-press")
    album.shoot("free", "A press without a patient is asked twice")
    album.tap('.chooser-page[data-page="free"] .to-who')
    album.each(lambda page: page.locator("#patient-ref").fill("B-22"))
    album.each(lambda page: page.locator("#operator").fill("Ada"))
    album.tap("#to-place")
    album.pages[1].locator("#side-left").click()
    album.each(lambda page: page.locator('.hour[data-side="left"][data-hour="10"]').click())
    album.tap("#farther")
    album.shoot("map", "Where the lesion is")
    album.tap("#chooser-close", "#exam-button", ".recent")
    album.sees("#exam-who", "A-17")
    album.shoot("ready", "Before a press: modes with what they cost")


def of_presses(album: Album) -> None:
    """Two presses in mode standard, one in mode quick, and a scan."""
    first = album.pages[0]
    first.locator("#press-button").click()
    album.sees("#frames", "4 of 10")
    album.shoot("beside", "The press beside the lesion, with what the camera sees")
    album.sees("#instruction", "Touch the lesion")
    album.shoot("next", "To the lesion")
    album.sees("#frames", "6 of 10")
    album.shoot("lesion", "The press on the lesion")
    album.sees("#image-title", "Measurement 1, Standard")
    album.shoot("result", "A result")
    first.locator("#press-button").click()
    album.sees("#image-title", "Measurement 2, Standard")
    album.tap("#act-mode")
    album.each(lambda page: page.locator("#modes label").filter(has_text="Quick").click())
    first.locator("#press-button").click()
    album.sees("#image-title", "Measurement 3, Quick")
    album.sees("#instruction", "Measured in part")
    album.shoot("result-in-part", "A result that leaves something open, and which tissue it takes for granted")
    album.tap("#act-mode")
    album.each(lambda page: page.locator("#modes label").filter(has_text="Precise").click())
    album.shoot("scan-asked", "How sure a scan is to be")
    first.locator("#press-button").click()
    album.sees("#scan-count", "1 of at most 5")
    album.shoot("scan", "A scan after its first press")
    first.locator("#enough-button").click()
    album.sees("#image-title", "Measurement 4, Precise")


def of_what_was_measured(album: Album) -> None:
    """Details, void, history, comparison and trend."""
    album.tap("#act-details")
    album.shoot("details", "Everything behind a measurement")
    album.tap("#details-close", "#act-void")
    album.shoot("void", "Why a measurement does not count")
    album.tap("#void-close")
    open_history(album)
    album.each(lambda page: expect(page.locator(".kept")).to_have_count(4))
    album.shoot("history", "What was measured")
    album.each(lambda page: [page.locator(".marker").nth(one).click() for one in (2, 3)])
    album.shoot("comparison", "Two measurements side by side")
    album.tap("#history-patient")
    album.each(lambda page: expect(page.locator(".trend")).to_have_count(2))
    album.shoot("trend", "A patient's trend")
    album.tap("#history-close")


def open_history(album: Album) -> None:
    """Open what was measured; a small page has it in its menu."""
    for page in album.pages:
        if not page.locator("#history-open").is_visible():
            page.locator("#menu-open").click()
            page.locator("#menu-history").click()
        else:
            page.locator("#history-open").click()


def of_service(album: Album) -> None:
    """The menu and its pages."""
    album.tap("#menu-open")
    album.shoot("menu", "The menu")
    album.tap("#self-test-open")
    album.shoot("self-test", "The self-test")
    album.tap("#self-test-close", "#menu-open", "#releases-open")
    album.shoot("software", "Software")
    album.tap("#releases-close", "#act-finish")
    album.sees("#exam-who", "Choose patient")


def of_a_voided_one(browser: Browser, probe: ServedProbe, rows: list[str]) -> list[str]:
    """A measurement that does not count, and one in German and in other colours."""
    wrong = list[str]()
    for name, words, options in (
        ("german", "A result in German", {"locale": "de-DE"}),
        ("dark", "A result in dark colours", {"color_scheme": "dark"}),
        ("forced", "A result in the colours of the system", {"forced_colors": "active"}),
    ):
        album = Album(browser, probe.url, rows, **options)
        album.each(lambda page: expect(page.locator("#modes")).to_be_visible())
        album.tap("#exam-button", ".recent")
        open_history(album)
        album.each(lambda page: page.locator(".kept-open").last.click())
        album.each(lambda page: expect(page.locator("#act-now")).to_be_visible())
        album.shoot(name, words)
        if name == "german":
            first = album.pages[0]
            first.locator("#act-void").click()
            first.locator("#void-by").fill("Ada")
            first.locator("#void .reasons-grid .button").first.click()
            expect(first.locator("#void")).to_be_hidden()
            open_history(album)
            album.each(lambda page: expect(page.locator('.kept[data-voided="true"]')).to_have_count(1))
            album.each(lambda page: page.locator('.kept[data-voided="true"]').scroll_into_view_if_needed())
            album.shoot("voided", "A measurement that does not count, in German")
        album.close()
        wrong += album.wrong
    return wrong


def of_an_update(album: Album, probe: ServedProbe) -> None:
    """How far an update is, little storage, and the page that pairs another machine."""
    low = DeviceError.by_code["E606"]("The disk has some 200 MB left, below 500 MB.", "Export the exams.")
    told = {"step": "ready", "guidance": Guidance.TOUCH_BESIDE, "press": None, "fault": None}
    probe.procedure.board.update(**told, warnings=(low,))
    album.sees(".fault-code", "E606")
    album.shoot("storage-low", "Little storage is left")
    probe.procedure.board.update(warnings=())
    probe.updates.mkdir(exist_ok=True)
    progress = {"state": "unpacking", "release": "0.2.0+412", "progress": 0.42, "step": "unpacking numpy"}
    (probe.updates / "progress.json").write_text(json.dumps(progress), encoding="utf-8")
    album.sees("#status-line", "0.2.0 is being installed")
    album.tap("#menu-open", "#releases-open")
    album.each(lambda page: expect(page.locator("#release-progress")).to_be_visible())
    album.shoot("updating", "How far an update is")
    album.each(lambda page: page.goto(f"{probe.url}/pair"))
    album.each(lambda page: expect(page.locator("#offer")).to_be_visible())
    album.shoot("pairing", "The page that pairs another machine")


def of_no_start(browser: Browser, rows: list[str], folder: Path) -> list[str]:
    """The page of a probe whose software does not start, in both languages."""
    root, wrong = ProbeRoot(folder), list[str]()
    root.releases("0.2.0+412", committed="0.2.0+412", previous="0.1.0+398")
    root.settings("[press]\ntarget_n = 99\n")
    failed_start(root)
    fallback = Fallback(root)
    for name, words, language in (
        ("fallback", "The probe does not start", "en-GB"),
        ("fallback-german", "The same in German", "de-DE"),
    ):
        album = Album(browser, root.url, rows, locale=language)
        album.sees(".fault-code", "E001")
        album.shoot(name, words)
        album.close()
        wrong += album.wrong
    fallback.stop()
    return wrong


def of_the_hospital(browser: Browser, rows: list[str], folder: Path) -> list[str]:
    """What the hospital has ordered, and how far an exam is on its way to the archive, by a real one."""
    archive = Orthanc(folder)
    ordered(archive.worklists, "ana", day=f"{date.today():%Y%m%d}")
    scene = (
        f'[settings.dicom]\narchive_host = "127.0.0.1"\narchive_port = {archive.port}\narchive_title = "{TITLE}"\n'
        f'worklist_host = "127.0.0.1"\nworklist_port = {archive.port}\nworklist_title = "{TITLE}"\n'
        f'own_title = "{OWN_TITLE}"\nsend_phantoms = true\n'  # its presses are simulated
    )
    archive.start()
    daemon = Daemon(folder, scene + QUICK_HAND)
    daemon.ask("/api/v1/exams", "POST", {**EXAM, "operator": "Ada"})
    album = Album(browser, daemon.url, rows)
    album.each(lambda page: expect(page.locator("#modes")).to_be_visible())
    album.tap("#exam-button")
    album.each(lambda page: expect(page.locator("#ordered .recent")).to_have_count(1))
    album.shoot("worklist", "What the hospital has ordered")
    album.tap("#recent .recent")
    album.each(lambda page: page.locator("#modes label").filter(has_text="Quick").click())
    album.pages[0].locator("#press-button").click()
    album.sees("#image-title", "Measurement 1, Quick")
    open_history(album)
    album.each(lambda page: expect(page.locator("#archive-send")).to_be_visible())
    album.pages[0].locator("#archive-send").click()
    expect(album.pages[0].locator(".archive-state")).to_contain_text("confirmed")
    album.tap("#history-close")
    open_history(album)
    album.sees(".archive-state", "confirmed")
    album.shoot("archive", "An exam that the hospital's archive has")
    album.close()
    daemon.stop()
    archive.close()
    return album.wrong


def of_trouble(album: Album, probe: ServedProbe) -> None:
    """What the probe says of a press that came to nothing, of faults and of warnings."""

    def tell(step: str, guidance: Guidance, **said: Any) -> None:
        whole = {"fault": None, "warnings": (), "press": None, **said}
        probe.procedure.board.update(step=step, guidance=guidance, **whole)
        album.each(lambda page: expect(page.locator("#panel")).to_have_attribute("data-step", step))

    def error(code: str) -> DeviceError:
        return DeviceError.by_code[code]("What it saw.", "What service does.")

    reason = "The force rose to 1.20 N, above 1.00 N: lift and press more gently."
    tell("rejected", Guidance.REJECTED, press=PressJob("p", "quick", "rejected", reason=reason))
    album.each(lambda page: expect(page.locator("#modes")).to_be_visible())
    album.sees("#instruction", "Press more gently")
    album.shoot("rejected", "A press that does not count, and why")
    tell("rejected", Guidance.REJECTED, press=PressJob("p", "quick", "cancelled"))
    album.sees("#instruction", "Cancelled")
    album.shoot("cancelled", "Cancelled")
    tell("computing", Guidance.WAIT, press=PressJob("p", "precise", "computing"))
    album.shoot("computing", "The answer is being computed")
    tell("fault", Guidance.FAULT, fault=error("E304"))
    album.sees(".fault-code", "E304")
    album.shoot("fault", "A fault")
    press = PressJob("p", "standard", "capturing")
    tell("lesion", Guidance.PRESS_SLOWLY, press=press, warnings=(error("E015"),))
    album.sees(".fault-code", "E015")
    album.shoot("warning", "A warning beside the force: undervoltage")
    tell("fault", Guidance.FAULT, fault=error("E408"), warnings=(error("E015"), error("E409")))
    album.each(lambda page: expect(page.locator(".fault")).not_to_have_count(1))
    album.shoot("faults", "A wrong clock, and warnings")
    album.tap(".fault-open")
    album.shoot("fault-details", "What service needs")
    album.tap("#fault-close")


@contextmanager
def probe_of(*, is_running: bool) -> Iterator[ServedProbe]:
    with (
        TemporaryDirectory(prefix="tsis-") as folder,
        served_probe(Path(folder), is_running=is_running, scenario=HAND) as served,
    ):
        yield served


def photographed(browser: Browser, rows: list[str]) -> list[str]:
    """Photograph everything; return what the ruler found."""
    wrong: list[str] = []
    with probe_of(is_running=True) as probe:
        wait_for(lambda: probe.procedure.board.now.step, lambda step: step == "ready")
        ask(probe, "exams", {**EXAM, "operator": "Ada"})
        album = Album(browser, probe.url, rows)
        for chapter in (of_the_patient, of_presses, of_what_was_measured, of_service):
            chapter(album)
        album.close()
        wrong += album.wrong
        wrong += of_a_voided_one(browser, probe, rows)
    with probe_of(is_running=False) as probe:
        probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE)
        album = Album(browser, probe.url, rows, has_touch=True)
        album.each(lambda page: page.locator("#exam-button").tap())
        album.each(lambda page: page.locator("#patient-ref").tap())
        album.shoot("keys", "Keys of the probe's own screen")
        album.close()
        wrong += album.wrong
        album = Album(browser, probe.url, rows)
        album.each(lambda page: expect(page.locator("#modes")).to_be_visible())
        of_an_update(album, probe)
        album.close()
        wrong += album.wrong
        (probe.updates / "progress.json").unlink()
        album = Album(browser, probe.url, rows)
        of_trouble(album, probe)
    album.each(lambda page: expect(page.locator("#connection-lost")).to_be_visible())
    album.shoot("lost", "No connection")
    album.close()
    wrong += album.wrong
    for chapter in (of_no_start, of_the_hospital):
        with TemporaryDirectory(prefix="tsis-") as folder:
            wrong += chapter(browser, rows, Path(folder))
    return wrong


def main() -> int:
    """Write photographs and page; return 1 when a state is not whole."""
    SHOTS.mkdir(exist_ok=True)
    rows: list[str] = []
    with chromium_page() as spare:
        browser = spare.context.browser
        assert browser is not None
        wrong = photographed(browser, rows)
    PAGE.write_text(HEAD + "\n".join(rows) + "\n", encoding="utf-8")
    print(f"{len(rows)} states, {sum(path.stat().st_size for path in SHOTS.glob('*.png')) // 1000} kB")
    print(*wrong, sep="\n")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
