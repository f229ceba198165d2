"""The screen for every hand and eye: touch without keys, both schemes, forced colours, sound, a reload, the curtain."""

from __future__ import annotations

from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from opened_screen import SIZES, named, opened, shoot
from playwright.sync_api import Browser, expect
from screen_layout import wrong_in
from served_probe import ServedProbe, served_probe

from device.instrument.press.states import Guidance
from device.instrument.status import PressJob

pytestmark = [pytest.mark.browser, pytest.mark.real_time]


@pytest.mark.parametrize("size", SIZES[:2], ids=named)
def test_the_probes_own_touch_screen_has_keys_for_every_field(browser: Browser, probe: ServedProbe, size):
    page = opened(browser, probe, size, has_touch=True, is_mobile=True)
    page.locator("#press-button").tap()
    page.locator("#patient-ref").tap()
    expect(page.locator("#keys")).to_be_visible()
    field, keys = page.locator("#patient-ref").bounding_box(), page.locator("#keys").bounding_box()
    assert field is not None
    assert keys is not None
    label = page.locator("label:has(#patient-ref) > span").bounding_box()
    assert label is not None
    assert min(field["y"], label["y"]) >= 0
    assert label["y"] + label["height"] <= keys["y"] + 1
    assert field["y"] + field["height"] <= keys["y"] + 1
    shoot(page, f"comfort/keys-{size[0]}")
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
@pytest.mark.parametrize("size", SIZES, ids=named)
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
        shoot(page, f"comfort/{name}-{scheme}-{size[0]}")
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
    shoot(page, "comfort/forced-colours")
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
    shoot(page, "comfort/lost")
    assert wrong_in(page) == []
    page.context.close()
