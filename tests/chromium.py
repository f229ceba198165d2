"""A page of a real headless Chromium, as large as the probe's panel."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager

import pytest
from daemon_process import WAIT_S
from playwright.sync_api import Page, expect, sync_playwright

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


@contextmanager
def chromium_page(*flags: str) -> Iterator[Page]:
    """Give a page that waits as long as the tests do; skip the test where there is no Chromium."""
    if CHROMIUM is None:
        assert not os.environ.get("TSIS_REQUIRE_PEERS"), "Chromium is required here but not installed"
        pytest.skip("no Chromium on this machine: install it to test the screen")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS, *flags])
        page = browser.new_page(viewport={"width": 800, "height": 480})
        page.set_default_timeout(1000 * WAIT_S)
        expect.set_options(timeout=1000 * WAIT_S)
        yield page
        browser.close()
