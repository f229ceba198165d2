"""The screen for every hand and eye: touch without keys, both schemes, forced colours, sound, a reload, the curtain."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from chromium import chromium_page
from daemon_process import ROOT
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe, served_probe

from device.instrument.press.states import Guidance
from device.instrument.status import PressJob

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
SHOTS = ROOT / "build" / "screens" / "comfort"
SIZES = [(800, 480), (480, 320), (390, 844), (1280, 800)]


@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    with chromium_page() as page:
        browser = page.context.browser
        assert browser is not None
        page.close()
        yield browser


@pytest.fixture(scope="module")
def probe(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServedProbe]:
    with served_probe(tmp_path_factory.mktemp("probe"), is_running=False) as served:
        yield served


def opened(browser: Browser, probe: ServedProbe, size: tuple[int, int] = SIZES[0], **context: object) -> Page:
    options = {"locale": "en-GB", "viewport": {"width": size[0], "height": size[1]}} | context
    page = browser.new_context(**options).new_page()  # type: ignore[arg-type]
    probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, fault=None, warnings=(), press=None)
    page.goto(probe.url)
    expect(page.locator("#modes")).to_be_visible()
    return page


def shoot(page: Page, name: str) -> None:
    SHOTS.mkdir(parents=True, exist_ok=True)
    page.screenshot(path=str(SHOTS / f"{name}.png"))


@pytest.mark.parametrize("size", SIZES[:2], ids=lambda size: f"{size[0]}x{size[1]}")
def test_the_probes_own_touch_screen_has_keys_for_every_field(browser: Browser, probe: ServedProbe, size):
    page = opened(browser, probe, size, has_touch=True, is_mobile=True)
    page.locator("#press-button").tap()
    page.locator("#patient-ref").tap()
    expect(page.locator("#keys")).to_be_visible()
    field, keys = page.locator("#patient-ref").bounding_box(), page.locator("#keys").bounding_box()
    assert field is not None
    assert keys is not None
    assert field["y"] >= 0
    assert field["y"] + field["height"] <= keys["y"] + 1
    shoot(page, f"keys-{size[0]}")
    for key in ("Capitals", "A", "1", "7", "x", "Erase"):
        page.locator("#keys").get_by_role("button", name=key, exact=True).tap()
    expect(page.locator("#patient-ref")).to_have_value("A17")
    expect(page.locator("#patient-ref")).to_have_attribute("inputmode", "none")
    small = "keys => keys.filter(k => k.getBoundingClientRect().height < 47.5).length"
    assert page.locator("#keys .key").evaluate_all(small) == 0
    page.locator("#keys").get_by_role("button", name="Done").tap()
    expect(page.locator("#keys")).to_be_hidden()
    page.context.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES, ids=lambda size: f"{size[0]}x{size[1]}")
def test_every_page_can_be_read_in_both_schemes(browser: Browser, probe: ServedProbe, size, scheme: str):
    page, axe = opened(browser, probe, size, color_scheme=scheme), Axe()
    opens = {"chooser": "#exam-button", "menu": "#menu-open"}
    for name in ("ready", "press", *opens):
        press = PressJob("p", "standard", "capturing") if name == "press" else None
        step, guidance = ("lesion", Guidance.PRESS_SLOWLY) if press else ("ready", Guidance.TOUCH_BESIDE)
        probe.procedure.board.update(step=step, guidance=guidance, press=press)
        expect(page.locator("#panel")).to_have_attribute("data-step", step)
        if name in opens:
            page.locator(opens[name]).click()
            expect(page.locator(f"#{name}")).to_be_visible()
        shoot(page, f"{name}-{scheme}-{size[0]}")
        found = axe.run(page, options={"runOnly": ["wcag2a", "wcag2aa", "wcag21aa", "wcag22aa"]})
        assert [one["id"] for one in found.response["violations"]] == [], (name, found.generate_report())
        assert wrong_in(page) == [], name
        if name in opens:
            page.locator(f"#{name}-close").click()
    page.context.close()


def test_forced_colours_and_reduced_motion_keep_every_mark(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe, forced_colors="active", reduced_motion="reduce")
    band = page.locator(".gauge-marker").evaluate("node => getComputedStyle(node, '::before').backgroundColor")
    ground = page.evaluate("getComputedStyle(document.body).backgroundColor")
    assert band != ground
    moved = page.locator(".gauge-fill div").evaluate("node => getComputedStyle(node).transitionDuration")
    assert moved == "0s"
    shoot(page, "forced-colours")
    assert wrong_in(page) == []
    page.context.close()


def test_what_a_person_has_chosen_stays_after_a_reload(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    page.locator("#menu-open").click()
    for name in ("sound-off", "colours-dark"):
        page.locator(f"#{name}").click()
        expect(page.locator(f"#{name}")).to_have_attribute("aria-pressed", "true")
    page.locator("#language-de").click()
    expect(page.locator("#instruction")).to_have_text("Wählen, wessen Untersuchung es ist")
    page.reload()
    expect(page.locator("#instruction")).to_have_text("Wählen, wessen Untersuchung es ist")
    expect(page.locator("html")).to_have_attribute("data-colours", "dark")
    expect(page.locator("#sound-off")).to_have_attribute("aria-pressed", "true")
    page.context.close()


def test_a_step_sounds_unless_it_is_muted(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    probe.procedure.board.update(step="lesion", guidance=Guidance.LIFT)
    expect(page.locator("html")).to_have_attribute("data-sounded", "good")
    page.locator("#menu-open").click()
    page.locator("#sound-off").click()
    page.locator("#menu-close").click()
    probe.procedure.board.update(guidance=Guidance.TOUCH_LESION)
    expect(page.locator("html")).to_have_attribute("data-sounded", "")
    page.context.close()


def test_a_reload_in_a_press_shows_what_the_probe_says(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    press = PressJob("p", "standard", "capturing")
    probe.procedure.board.update(step="lesion", guidance=Guidance.PRESS_SLOWLY, press=press)
    expect(page.locator("#press-button")).to_have_text("Cancel")
    page.reload()
    expect(page.locator("#instruction")).to_have_text("Press slowly harder")
    expect(page.locator("#press-button")).to_have_text("Cancel")
    expect(page.locator("#footer")).to_have_js_property("inert", value=True)
    page.context.close()


def test_nothing_can_be_pressed_under_the_curtain(browser: Browser, tmp_path: Path):
    with served_probe(tmp_path, is_running=False) as served:
        page = opened(browser, served)
    expect(page.locator("#connection-lost")).to_be_visible()
    for id in ("main", "header", "footer"):
        expect(page.locator(f"#{id}")).to_have_js_property("inert", value=True)
    shoot(page, "lost")
    assert wrong_in(page) == []
    page.context.close()
