"""The live picture of a press in a real Chromium: there while it is in sight, and asked for at no other time."""

from __future__ import annotations

from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import pytest
from daemon_process import wait_for
from opened_screen import SIZES, opened, shoot
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe, served_probe

from device.simulation.hand import HandSettings
from device.simulation.scenario import Scenario
from device.web.streams.live_view import LiveView

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
SLOW_HAND = Scenario(hand=HandSettings(reaction_s=0.05, ramp_rate_n_per_s=0.01))
"""A ramp of a minute: the press lasts until it is cancelled."""
HAS_PICTURE = "() => document.getElementById('live').naturalWidth > 0"
LOOK = """seen => {
  Object.defineProperty(document, "visibilityState", {value: seen ? "visible" : "hidden", configurable: true});
  document.dispatchEvent(new Event("visibilitychange"));
}"""


@pytest.fixture
def streams(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What has become of every stream of pictures that was asked for: "open" or "ended"."""
    known: list[str] = []
    whole = LiveView.parts

    async def parts(self: LiveView) -> AsyncIterator[bytes]:
        number = len(known)
        known.append("open")
        try:
            async for part in whole(self):
                yield part
        finally:
            known[number] = "ended"

    monkeypatch.setattr(LiveView, "parts", parts)
    return known


@pytest.fixture
def pressed(streams: list[str], tmp_path: Path) -> Iterator[ServedProbe]:
    """A probe that is being pressed, for a minute."""
    with served_probe(tmp_path, is_running=True, scenario=SLOW_HAND) as served:
        wait_for(lambda: served.procedure.board.now.step, lambda step: step == "ready")
        yield served


def press(probe: ServedProbe, page: Page) -> None:
    page.locator("#exam-button").click()
    page.locator("#free-press").click()
    page.locator("#free-yes").click()
    page.locator("#press-button").click()
    expect(page.locator("#press-button")).to_have_text("Cancel")


def test_the_picture_lives_while_the_probe_takes_images_and_somebody_looks(browser: Browser, pressed, streams):
    page = opened(browser, pressed)
    expect(page.locator("#live-view")).to_be_hidden()
    press(pressed, page)
    page.wait_for_function(HAS_PICTURE)
    shoot(page, "press-live")
    assert wrong_in(page) == []
    page.evaluate(LOOK, False)
    wait_for(lambda: list(streams), lambda seen: seen == ["ended"])
    page.evaluate(LOOK, True)
    page.wait_for_function(HAS_PICTURE)
    page.locator("#press-button").click()
    expect(page.locator("#instruction")).to_have_text("Cancelled")
    expect(page.locator("#live-view")).to_be_hidden()
    wait_for(lambda: list(streams), lambda seen: seen == ["ended", "ended"])
    page.context.close()


def test_where_it_has_no_room_it_is_not_asked_for(browser: Browser, pressed, streams):
    page = opened(browser, pressed)
    page.set_viewport_size({"width": 480, "height": 240})
    press(pressed, page)
    expect(page.locator("#live-view")).to_be_hidden()
    expect(page.locator("#frames")).to_have_text("1 of 10 images")
    assert streams == []
    page.set_viewport_size({"width": SIZES[1][0], "height": SIZES[1][1]})
    page.wait_for_function(HAS_PICTURE)
    assert wrong_in(page) == []
    page.locator("#press-button").click()
    wait_for(lambda: list(streams), lambda seen: seen == ["ended"])
    page.context.close()
