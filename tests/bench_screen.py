"""Times the screen's page from the local daemon, in a real Chromium: when it paints, and when it shows the probe.

The browser's own entries tell: `first-contentful-paint`, and the page's mark of its first status on the screen. The
page is opened in a browser that has never seen it, as after a start of the probe, and again by a reload.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from bench_table import Figure
from chromium import chromium_page
from daemon_process import QUICK_HAND, Daemon, wait_for
from playwright.sync_api import Page, expect

CHAPTER = "screen from the local daemon"
REPEATS = 7
BOUND_S = 0.5
TIMES = """() => Object.fromEntries(["first-contentful-paint", "first status shown"].map(
  name => [name, performance.getEntriesByName(name)[0].startTime / 1000]))"""
LOADED = """() => performance.getEntriesByType("resource").filter(one => !one.name.endsWith("/events"))
  .map(one => one.transferSize)"""
NAMES = {"first-contentful-paint": "first paint", "first status shown": "the probe's state is shown"}


def _times(page: Page) -> dict[str, float]:
    """Return when the page painted first and showed its first status (s since it was asked for)."""
    page.wait_for_function("() => performance.getEntriesByName('first status shown').length > 0")
    expect(page.locator("#modes")).to_be_visible()
    told: dict[str, float] = page.evaluate(TIMES)
    return told


def figures() -> Iterator[Figure]:
    """Yield the medians of a first visit and of a reload; skip them where there is no Chromium."""
    with TemporaryDirectory(prefix="tsis-") as folder, chromium_page() as spare:
        daemon = Daemon(Path(folder), QUICK_HAND)
        wait_for(lambda: daemon.ask("/api/v1/health/ready").status, lambda status: status == 200)
        browser = spare.context.browser
        assert browser is not None
        first, again, loads = [], [], []
        for _ in range(REPEATS):
            page = browser.new_context(viewport={"width": 800, "height": 480}).new_page()
            page.goto(daemon.url)
            first.append(_times(page))
            loads.append(page.evaluate(LOADED))
            page.reload()
            again.append(_times(page))
            page.context.close()
        daemon.stop()
    for told, when in ((first, "first visit"), (again, "reload")):
        for entry, name in NAMES.items():
            value_s = statistics.median(one[entry] for one in told)
            yield Figure(CHAPTER, f"{name}, {when}", value_s, "s", BOUND_S, here=f"{1000 * value_s:.0f} ms here")
    files, size_kb = len(loads[0]), sum(loads[0]) / 1000
    yield Figure(CHAPTER, "files of a first visit", files, "files", here=f"{size_kb:.0f} kB")
