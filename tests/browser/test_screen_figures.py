"""Figures on the screen, in a real Chromium: written by the rule of paper and archive, and whole in their tiles."""

from __future__ import annotations

import pytest
from kept_measurements import ESTIMATE, keep
from opened_screen import SIZES, named, opened, shoot
from playwright.sync_api import Browser, expect
from screen_layout import wrong_in
from served_probe import ServedProbe
from shown_intervals import SHOWN

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
WRITTEN = """async (shown) => {
  const { shownEnds, valueFigure } = await import("/static/result/quantities.js");
  return shown.map(([low, value, high]) => [valueFigure({ low, value, high }), ...shownEnds({ low, high })]);
}"""
CLOSED = {"identifiable": True, "low_is_open": False, "high_is_open": False, "std": 0.1}
LONGEST = {
    **ESTIMATE,
    "size_mm": {"low": 19.812, "value": 19.951, "high": 20.074, **CLOSED},
    "depth_mm": {"low": 14.812, "value": 14.951, "high": 15.074, **CLOSED},
    "youngs_modulus_kpa": {"low": 159.512, "value": 159.751, "high": 159.974, **CLOSED},
    "status": "ok",
    "reason": "",
}
"""Each unknown with two decimals: an interval of 0.3 mm or kPa and the largest figures of the trained range."""


@pytest.mark.parametrize(("locale", "point"), [("en-GB", "."), ("de-DE", ",")])
def test_figures_have_the_digits_that_their_interval_supports(
    browser: Browser, probe: ServedProbe, locale: str, point: str
):
    page = opened(browser, probe, locale=locale)
    written = page.evaluate(WRITTEN, [case[:3] for case in SHOWN])
    page.context.close()
    assert written == [[figure.replace(".", point) for figure in case[3]] for case in SHOWN]


@pytest.mark.parametrize("size", [*SIZES, (360, 640), (1600, 900)], ids=named)
@pytest.mark.parametrize("locale", ["en-GB", "de-DE"])
def test_the_longest_figures_are_whole_in_their_tiles(
    browser: Browser, probe: ServedProbe, locale: str, size: tuple[int, int]
):
    number = 100 + 10 * size[0] + (locale == "de-DE")
    keep(probe.procedure.store, number, estimate=LONGEST, taken_at="2026-03-04T10:00:05.250Z")
    page = opened(browser, probe, size, locale=locale)
    page.evaluate("document.querySelector('#history-open').click()")  # a small page has it in its menu
    page.locator(f'.kept[data-id="m-{number}"] .kept-open').click()
    expect(page.locator("#size-interval")).to_contain_text("20.08" if locale == "en-GB" else "20,08")
    shoot(page, f"figures/longest-{locale[:2]}-{size[0]}")
    wide = "tiles => tiles.filter(one => one.scrollWidth > one.clientWidth).map(one => one.id)"
    assert page.locator(".tile").evaluate_all(wide) == []
    assert wrong_in(page) == []
    page.context.close()
