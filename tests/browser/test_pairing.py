"""Pairing in a real Chromium: the code is read at the own screen and typed in the browser of another machine.

The other machine is this one at its own address; its browser takes the probe's own certificate as a user would, who
has compared its SHA-256.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from axe_playwright_python.sync_playwright import Axe
from chromium import chromium_page
from networked_daemon import NetworkedDaemon
from opened_screen import SIZES, named, shoot
from playwright.sync_api import Page, expect
from screen_layout import wrong_in

SCHEMES = ["light", "dark"]
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
    expect(elsewhere.locator("#line")).to_have_text(
        "The pairing code is wrong or has ended. Ask for a new one at the probe's screen."
    )
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


LOOKS = [
    (size, language, SCHEMES[(at + of) % 2])
    for at, size in enumerate(SIZES[:3])
    for of, language in enumerate(["en-GB", "de-DE"])
]
"""Every size in both languages; the schemes take turns, so that each is there with every size and language."""


@pytest.mark.parametrize(
    ("size", "language", "scheme"), LOOKS, ids=lambda one: one if isinstance(one, str) else named(one)
)
def test_the_page_is_in_both_languages_and_schemes_whole_at_every_size(probe, page, size, language: str, scheme: str):
    for url, name in ((f"{probe.daemon.url}/pair", "offer"), (f"{probe.url}/pair", "bring")):
        viewport = {"width": size[0], "height": size[1]}
        options = {"locale": language, "color_scheme": scheme, "viewport": viewport, "ignore_https_errors": True}
        other = page.context.browser.new_context(**options).new_page()
        other.goto(url)
        expect(other.locator(f"#{name}")).to_be_visible()
        if name == "offer":
            if other.locator("#ask-again").is_visible():  # the code of before is still valid
                other.locator("#ask-again").click()
            other.locator("#name").fill("Ward PC")
            other.locator("#ask button").click()
            expect(other.locator("#shown-valid")).not_to_have_text("")
        words = "Mit der Sonde koppeln" if language == "de-DE" else "Pair with the probe"
        expect(other.locator("h1")).to_have_text(words)
        shoot(other, f"pair/{name}-{language[:2]}-{scheme}-{size[0]}")
        may_scroll = ("page ", "outside ") if size[0] < 480 else ()  # a phone
        assert [one for one in wrong_in(other) if not one.startswith(may_scroll)] == []
        assert Axe().run(other).response["violations"] == []
        other.context.close()


def test_the_probes_own_panel_has_keys_for_the_name(probe, page):
    options = {"viewport": {"width": 480, "height": 320}, "has_touch": True, "is_mobile": True}
    panel = page.context.browser.new_context(**options).new_page()
    panel.goto(f"{probe.daemon.url}/pair")
    panel.locator("#ask-again").tap()  # the code of before is still valid
    panel.locator("#name").tap()
    panel.locator("#keys").get_by_role("button", name="w", exact=True).tap()
    expect(panel.locator("#name")).to_have_value("w")
    panel.context.close()
