"""Pairing in a real Chromium: the code is read at the own screen and typed in the browser of another machine.

The other machine is this one at its own address; its browser takes the probe's own certificate as a user would, who
has compared its SHA-256.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from chromium import chromium_page
from networked_daemon import NetworkedDaemon
from playwright.sync_api import Page, expect

pytestmark = [pytest.mark.browser, pytest.mark.real_time]


@pytest.fixture(scope="module")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Iterator[NetworkedDaemon]:
    running = NetworkedDaemon(tmp_path_factory.mktemp("network"))
    yield running
    running.daemon.stop()


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    with chromium_page("--ignore-certificate-errors") as page:
        yield page


def test_a_browser_elsewhere_is_paired_by_the_code_of_the_own_screen_and_turned_away_by_it(probe, page):
    page.goto(f"{probe.daemon.url}/pair")
    page.get_by_label("Name of the other machine").fill("Ward PC")
    page.get_by_label("What it may").select_option("measure")
    page.get_by_role("button", name="Show a code").click()
    expect(page.locator("#shown-code")).to_have_text(re.compile("^.{9}$"))
    code = page.locator("#shown-code").inner_text()
    shown = page.locator("#shown-sha256").inner_text()
    assert shown == probe.daemon.ask("/api/v1/device").json["network"]["certificate_sha256"]

    elsewhere = page.context.browser.new_context(ignore_https_errors=True).new_page()
    elsewhere.goto(f"http://{probe.address}:{probe.port}/")
    assert elsewhere.url == f"{probe.url}/pair"
    elsewhere.get_by_label("Code on the probe's screen").fill("AAAA-AAAA")
    elsewhere.get_by_role("button", name="Pair").click()
    expect(elsewhere.locator("#line")).to_contain_text("not the code")
    elsewhere.get_by_label("Code on the probe's screen").fill(code.lower())
    with elsewhere.expect_event("framenavigated"):
        elsewhere.get_by_role("button", name="Pair").click()
    elsewhere.wait_for_url(f"{probe.url}/")
    assert elsewhere.evaluate("document.cookie") == ""
    assert elsewhere.evaluate("fetch('/api/v1/status').then((answer) => answer.status)") == 200
    assert elsewhere.evaluate("fetch('/api/v1/tokens').then((answer) => answer.status)") == 403

    page.get_by_role("button", name="Revoke").click()
    expect(page.locator("#line")).to_contain_text("Ward PC is not let in any more")
    assert elsewhere.evaluate("fetch('/api/v1/status').then((answer) => answer.status)") == 401
    elsewhere.goto(f"{probe.url}/")
    assert elsewhere.url == f"{probe.url}/pair"
