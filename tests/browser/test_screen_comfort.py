"""The screen for every hand and eye: touch without keys, both schemes, forced colours, sound, a reload, the curtain."""

from __future__ import annotations

from pathlib import Path

import pytest
from axe_playwright_python.sync_playwright import Axe
from opened_screen import SIZES, named, opened, shoot
from playwright.sync_api import Browser, Page, expect
from scanned import scan
from screen_layout import wrong_in
from served_probe import ServedProbe, served_probe

from device.errors import DeviceError
from device.instrument.press.states import Guidance
from device.instrument.status import PressJob
from device.simulation.hand import HandSettings
from device.simulation.scenario import Scenario

pytestmark = [pytest.mark.browser, pytest.mark.real_time]

FOCUSED = """() => {
  const node = document.activeElement;
  const box = node.getBoundingClientRect();
  const isInside = box.left >= 0 && box.top >= 0 && box.right <= innerWidth && box.bottom <= innerHeight;
  const marked = [node, node.nextElementSibling].filter(Boolean).map(one => getComputedStyle(one).outlineStyle);
  const isSeen = node === document.body || (isInside && marked.includes("solid"));
  return {id: node.id || node.value || node.tagName, isSeen};
}"""


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
    for key in ("A", "1", "7", "X", "Erase"):
        page.locator("#keys").get_by_role("button", name=key, exact=True).tap()
    expect(page.locator("#patient-ref")).to_have_value("A17")
    expect(page.locator("#patient-ref")).to_have_attribute("inputmode", "none")
    small = "keys => keys.filter(k => k.getBoundingClientRect().height < 47.5).length"
    assert page.locator("#keys .key").evaluate_all(small) == 0
    page.locator("#keys").get_by_role("button", name="Done").tap()
    expect(page.locator("#keys")).to_be_hidden()
    page.context.close()


def type_by_keys(page: Page, field: str, keys: str) -> None:
    """Tap a field, and then its letters on the keyboard of the screen."""
    page.locator(f"#{field}").tap()
    for key in keys:
        page.locator("#keys").get_by_role("button", name=key, exact=True).tap()


@pytest.mark.parametrize("size", SIZES[:2], ids=named)
def test_the_german_keys_have_all_signs_of_a_number_and_the_tick_goes_on(browser: Browser, probe: ServedProbe, size):
    page = opened(browser, probe, size, has_touch=True, is_mobile=True, locale="de-DE")
    page.locator("#press-button").tap()
    type_by_keys(page, "patient-ref", "AB-2026/1.")
    expect(page.locator("#patient-ref")).to_have_value("AB-2026/1.")
    shoot(page, f"comfort/keys-de-{size[0]}")
    keys = page.locator("#keys .key")
    assert keys.evaluate_all("keys => keys.filter(k => k.getBoundingClientRect().height < 47.5).length") == 0
    assert keys.evaluate_all("keys => new Set(keys.map(k => k.getBoundingClientRect().top)).size") == 5
    page.locator("#keys").get_by_role("button", name="Großbuchstaben").tap()
    type_by_keys(page, "patient-ref", "bc")
    expect(page.locator("#patient-ref")).to_have_value("AB-2026/1.bc")
    tick = page.locator("#keys").get_by_role("button", name="Fertig")
    tick.tap()
    expect(page.locator("#keys")).to_be_hidden()
    expect(page.locator("#patient-ref")).to_be_visible()  # nobody has said who examines
    type_by_keys(page, "operator", "ada")
    tick.tap()
    expect(page.locator("#where-of")).to_contain_text("AB\u20112026/1.bc")
    page.context.close()


@pytest.mark.parametrize("size", SIZES[:2], ids=named)
def test_a_number_in_other_capitals_than_a_known_one_is_asked_about(browser: Browser, probe: ServedProbe, size):
    page = opened(browser, probe, size)
    known = {"kind": "patient", "patient_ref": "MEYER-1", "operator": "Ada"}
    assert page.request.post(f"{probe.url}/api/v1/exams", data=known).ok
    page.locator("#press-button").click()
    page.locator("#operator").fill("Ada")
    page.locator("#patient-ref").fill("meyer-1")
    offer = page.locator(".recent-like")
    expect(offer).to_have_text("MEYER\u20111 has exams: same patient?")
    page.locator("#to-place").click()
    expect(page.locator("#chooser-problem")).to_have_text("MEYER\u20111 has exams: same patient?")
    shoot(page, f"comfort/alike-{size[0]}")
    assert wrong_in(page) == []
    page.locator("#to-place").click()
    expect(page.locator("#where-of")).to_contain_text("meyer\u20111")
    page.locator(".to-who").first.click()
    offer.click()
    expect(page.locator("#patient-ref")).to_have_value("MEYER-1")
    expect(page.locator("#recent strong").first).to_have_text("MEYER-1")
    expect(offer).to_have_count(0)
    page.context.close()


@pytest.mark.parametrize("size", SIZES[:2], ids=named)
@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_the_map_is_whole_without_scrolling(browser: Browser, probe: ServedProbe, size, language: str):
    page = opened(browser, probe, size, locale=language)
    page.locator("#exam-button").click()
    page.locator("#patient-ref").fill("B-22")
    page.locator("#operator").fill("Ada")
    page.locator("#to-place").click()
    targets = page.locator('[data-page="where"] :is(.hour, .button)').filter(visible=True)
    for index in range(targets.count()):
        expect(targets.nth(index)).to_be_in_viewport(ratio=0.99)
    page.context.close()


@pytest.mark.parametrize(("scheme", "size"), [("light", SIZES[0]), *(("dark", size) for size in SIZES)], ids=str)
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


@pytest.mark.parametrize("size", [(640, 400), (960, 540)], ids=named)
def test_at_double_zoom_nothing_is_cut_off_and_every_focus_is_seen(browser: Browser, probe: ServedProbe, size):
    """As a browser zooms 1280 x 800 and 1920 x 1080: half the pixels of CSS, twice as many of the screen for each."""
    page = opened(browser, probe, size, device_scale_factor=2)
    stops = set()
    for _ in range(30):
        page.keyboard.press("Tab")
        stop = page.evaluate(FOCUSED)
        if stop["id"] in stops:
            break
        stops.add(stop["id"])
        assert stop["isSeen"], stop
    assert {"exam-button", "press-button", "menu-open"} <= stops
    opens = {"menu": "#menu-open", "history": "#menu-history", "chooser": "#exam-button"}
    for name in ("ready", "lesion", "fault", *opens):
        press = PressJob("p", "standard", "capturing") if name == "lesion" else None
        step = name if name in ("lesion", "fault") else "ready"
        fault = DeviceError.by_code["E304"]("It gave no reading.", "Plug it in.") if name == "fault" else None
        probe.procedure.board.update(step=step, guidance=Guidance.PRESS_SLOWLY, press=press, fault=fault)
        expect(page.locator("#panel")).to_have_attribute("data-step", step)
        if name == "history":
            page.locator("#menu-open").click()
        if name in opens:
            page.locator(opens[name]).click()
            expect(page.locator(f"#{name}")).to_be_visible()
        shoot(page, f"comfort/zoom-{name}-{size[0]}")
        assert wrong_in(page) == [], name
        if name in opens:
            page.locator(f"#{name}-close").click()
    page.context.close()


CUT_RINGS = """name => {
  const page = document.querySelector(`.chooser-page[data-page="${name}"]`);
  const { left, right } = page.getBoundingClientRect();
  const ofPage = (node) => node.closest(".recent-list") === null && node.checkVisibility();
  return [...page.querySelectorAll("input, button")].filter(ofPage).filter((node) => {
    const box = node.getBoundingClientRect();
    return box.left - 5 < left || box.right + 5 > right;
  }).map((node) => node.id);
}"""
"""The ids of what stands on a page of the chooser whose ring, 3 px wide and 2 px beyond, is cut off at a side."""


@pytest.mark.parametrize("size", SIZES[:2], ids=named)
def test_the_ring_of_the_focus_is_whole_in_the_chooser(browser: Browser, probe: ServedProbe, size: tuple[int, int]):
    page = opened(browser, probe, size)
    page.locator("#exam-button").click()
    page.locator("#patient-ref").focus()
    shoot(page, f"comfort/ring-who-{size[0]}")
    assert page.evaluate(CUT_RINGS, "who") == []
    page.locator("#free-press").click()
    page.locator("#free-yes").focus()
    shoot(page, f"comfort/ring-free-{size[0]}")
    assert page.evaluate(CUT_RINGS, "free") == []
    assert wrong_in(page) == []
    page.context.close()


def test_the_focus_is_never_lost(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    page.locator("#history-open").focus()
    press = PressJob("p", "standard", "capturing")
    probe.procedure.board.update(step="lesion", guidance=Guidance.PRESS_SLOWLY, press=press)
    expect(page.locator("#press-button")).to_be_focused()  # another screen has begun a press
    probe.procedure.board.update(step="ready", guidance=Guidance.TOUCH_BESIDE, press=None)
    expect(page.locator("#header")).to_have_js_property("inert", value=False)
    page.locator("#exam-button").focus()
    page.keyboard.press("Enter")
    page.locator("#free-press").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#chooser-heading")).to_be_focused()  # the button that had it is on another page
    page.locator("#free-yes").focus()
    page.keyboard.press("Enter")
    expect(page.locator("#exam-button")).to_be_focused()
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


ASKED = """() => {
  window.locks = [];
  const ask = navigator.wakeLock.request.bind(navigator.wakeLock);
  navigator.wakeLock.request = async (kind) => {
    const lock = await ask(kind);
    window.locks.push(lock);
    return lock;
  };
}"""
"""Notes each lock that the browser itself gives to the page."""
HELD = "() => window.locks.map((lock) => !lock.released)"


@pytest.mark.long
def test_while_the_probe_is_pressed_the_screen_stays_awake_and_a_stray_touch_does_nothing(
    browser: Browser, tmp_path: Path
):
    hand = HandSettings(reaction_s=3.0)  # it begins late enough for all that is tried meanwhile
    with served_probe(tmp_path, is_running=True, scenario=Scenario(hand=hand)) as served:
        context = browser.new_context(locale="en-GB", viewport={"width": 800, "height": 480}, has_touch=True)
        context.add_init_script(f"({ASKED})()")
        page = context.new_page()
        page.goto(served.url)
        for button in ("#exam-button", "#free-press", "#free-yes"):
            page.locator(button).tap()
        exam, history = (centre(page, name) for name in ("#exam-button", "#history-open"))
        expect(page.locator("#press-button")).to_have_text("Press the simulated probe")
        assert page.evaluate(HELD) == []
        page.locator("#press-button").dblclick()  # a finger that bounces
        expect(page.locator("#press-button")).to_have_text("Cancel")
        page.wait_for_function(f"() => ({HELD})().includes(true)")
        for x, y in (exam, history):
            page.touchscreen.tap(x, y)
        expect(page.locator("dialog[open]")).to_have_count(0)
        assert served.procedure.board.now.press.state in ("waiting", "capturing")
        page.locator("#press-button").tap()
        expect(page.locator("#instruction")).to_have_text("Cancelled")
        page.wait_for_function(f"() => !({HELD})().includes(true)")
        page.touchscreen.tap(*exam)
        expect(page.locator("#chooser")).to_be_visible()
        page.context.close()


def centre(page: Page, name: str) -> tuple[float, float]:
    """Return where a finger touches an element."""
    box = page.locator(name).bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def test_keys_side_by_side_count_as_fast_as_anybody_types(browser: Browser, probe: ServedProbe):
    """Nothing has come under the finger: so a second touch near the first one is no bounce."""
    page = opened(browser, probe, has_touch=True)
    page.locator("#exam-button").tap()
    page.locator("#patient-ref").tap()
    boxes = [page.locator("#keys").get_by_role("button", name=key, exact=True).bounding_box() for key in ("Q", "W")]
    assert boxes[0] is not None
    assert boxes[1] is not None
    y = boxes[0]["y"] + boxes[0]["height"] / 2
    page.touchscreen.tap(boxes[0]["x"] + boxes[0]["width"] - 4, y)
    page.touchscreen.tap(boxes[1]["x"] + 4, y)
    expect(page.locator("#patient-ref")).to_have_value("QW")
    page.context.close()


def test_nothing_can_be_pressed_under_the_curtain(browser: Browser, tmp_path: Path):
    with served_probe(tmp_path, is_running=False) as served:
        page = opened(browser, served)
    expect(page.locator("#connection-lost")).to_be_visible()
    for id in ("main", "header", "footer"):
        expect(page.locator(f"#{id}")).to_have_js_property("inert", value=True)
    scan(page, "A-17")
    expect(page.locator("dialog[open]")).to_have_count(0)
    shoot(page, "comfort/lost")
    assert wrong_in(page) == []
    page.context.close()
