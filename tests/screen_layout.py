"""What every state of the screen must keep: nothing cut off, nothing over another thing, text and targets large enough.

It measures a page as the browser has laid it out.
"""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import Page

LEAST_TEXT_PX = 14
LEAST_TARGET_PX = 48
MEASURE = (Path(__file__).parent / "screen_layout.js").read_text(encoding="utf-8")


def wrong_in(page: Page) -> list[str]:
    """Return everything that is cut off, lies over another thing, or is too small to read or to touch; [] is good."""
    found: list[str] = page.evaluate(MEASURE, {"leastText": LEAST_TEXT_PX, "leastTarget": LEAST_TARGET_PX})
    return found
