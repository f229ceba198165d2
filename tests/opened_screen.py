"""The screen of a probe that a test brings into a state: opened at a size, in a language, once it has heard it."""

from __future__ import annotations

import re
from pathlib import Path

from daemon_process import ROOT
from playwright.sync_api import Browser, Page, Route, expect
from served_probe import ServedProbe

from device.instrument.press.states import Guidance

SHOTS = ROOT / "build" / "screens"
SIZES = [(800, 480), (480, 320), (390, 844), (1280, 800)]
"""The probe's panel, the smallest one, a phone, and a PC or a tablet, in CSS pixels."""


def named(size: tuple[int, int]) -> str:
    """Return a size as a test's name has it."""
    return f"{size[0]}x{size[1]}"


def opened(browser: Browser, probe: ServedProbe, size: tuple[int, int] = SIZES[0], **context: object) -> Page:
    """Return the screen of a probe that is ready, in a browser's context of its own."""
    options = {"locale": "en-GB", "viewport": {"width": size[0], "height": size[1]}} | context
    page = browser.new_context(**options).new_page()  # type: ignore[arg-type]
    probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, fault=None, warnings=(), press=None)
    page.goto(probe.url)
    expect(page.locator("#modes")).to_be_visible()
    return page


def shoot(page: Page, name: str) -> Path:
    """Photograph a page into build/screens; a name may have folders."""
    path = SHOTS / f"{name}.png"
    path.parent.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=str(path))
    return path


PATIENT = "AbortSignal.timeout = () => new AbortController().signal"
"""A page that waits for each answer however long a busy machine takes."""


def held(page: Page, asked: str | re.Pattern[str], most: float = 1) -> list[Route]:
    """Keep answers of this kind back, as many as said, else the first; return where they wait to go on."""
    late: list[Route] = []
    page.evaluate(PATIENT)
    page.route(asked, lambda route: late.append(route) if len(late) < most else route.continue_())
    return late


def let_go(page: Page, late: list[Route]) -> None:
    """Give the page the answer that was kept back; return when it has it: one asked for after that is there, too."""
    with page.expect_event("requestfinished", lambda request: request == late[0].request):
        late[0].continue_()
    page.evaluate("async () => (await fetch('/api/v1/status')).text()")
