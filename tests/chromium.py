"""A page of a real headless Chromium, as large as the probe's panel."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from daemon_process import WAIT_S
from playwright.sync_api import Error, Locator, Page, expect, sync_playwright

CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


NO_BOUNCE = "dispatchEvent(new KeyboardEvent('keydown', {key: 'Shift'}))"
"""A key between two touches says that no finger has bounced."""


@contextmanager
def meant_clicks() -> Iterator[None]:
    """Let each click of a test count, however fast another one at its place was; `tap` and `dblclick` may bounce."""
    click = Locator.click

    def meant(self: Locator, *args: Any, **options: Any) -> None:
        try:
            self.page.evaluate(NO_BOUNCE)
        except Error as error:  # a page that is being left: the next one has seen no finger yet
            if "context was destroyed" not in error.message:
                raise
        click(self, *args, **options)

    Locator.click = meant  # type: ignore[method-assign]
    try:
        yield
    finally:
        Locator.click = click  # type: ignore[method-assign]


@contextmanager
def chromium_page(*flags: str) -> Iterator[Page]:
    """Give a page that waits as long as the tests do; skip the test where there is no Chromium."""
    if CHROMIUM is None:
        assert not os.environ.get("TSIS_REQUIRE_PEERS"), "Chromium is required here but not installed"
        pytest.skip("no Chromium on this machine: install it to test the screen")
    with sync_playwright() as playwright, meant_clicks():
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=[*FLAGS, *flags])
        page = browser.new_page(viewport={"width": 800, "height": 480})
        page.set_default_timeout(1000 * WAIT_S)
        expect.set_options(timeout=1000 * WAIT_S)
        yield page
        browser.close()
