"""The smallest panel, 480 x 320: all that a press and its result need is in reach, and no word is broken."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from kept_measurements import keep
from opened_screen import SIZES, named, opened, shoot
from playwright.sync_api import Browser, Page, expect
from screen_layout import wrong_in
from served_probe import ServedProbe

from device.errors import ArchiveUnreachable, ClockJumpError, DeviceError
from device.instrument.press.states import Guidance
from device.instrument.status import PressJob
from device.measurement.mode import ModeWorth

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
SMALLEST = SIZES[1]
EXAM = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "operator": "Ada"}
CLOCK = ClockJumpError("The clock was set by +86400.0 s.", "Check the board's clock and its time server.")
ARCHIVE = ArchiveUnreachable("The archive at 192.0.2.9:104 does not answer.", "Check the network.")
PICTURE = cv2.imencode(".png", np.full((358, 480), 90, np.uint8))[1].tobytes()
CUT_OFF = """(box) => [...box.querySelectorAll(".button")].filter((one) => one.offsetParent).flatMap((one) => {
  const [outer, inner] = [box.getBoundingClientRect(), one.getBoundingClientRect()];
  const isCut = inner.left < outer.left - 0.5 || inner.right > outer.right + 0.5 || inner.bottom > innerHeight;
  return isCut || one.scrollWidth > one.clientWidth || one.scrollHeight > one.clientHeight ? [one.textContent] : [];
})"""
BROKEN_WORDS = """(box) => {
  const found = [];
  const walk = document.createTreeWalker(box, NodeFilter.SHOW_TEXT);
  while (walk.nextNode()) {
    for (const word of walk.currentNode.textContent.matchAll(/[^\\s-]+/g)) {
      const range = document.createRange();
      range.setStart(walk.currentNode, word.index);
      range.setEnd(walk.currentNode, word.index + word[0].length);
      if (new Set([...range.getClientRects()].map((rect) => Math.round(rect.top))).size > 1) found.push(word[0]);
    }
  }
  return found;
}"""


def open_exam(page: Page, probe: ServedProbe) -> str:
    """Begin an exam and open it; return its id."""
    exam = page.request.post(f"{probe.url}/api/v1/exams", data=EXAM).json()
    page.locator("#exam-button").click()
    page.locator(".recent").first.click()
    expect(page.locator("#exam-who")).to_have_text("A-17")
    return str(exam["id"])


def show(page: Page, probe: ServedProbe, measurement_id: str, exam_id: str | None) -> None:
    """Let a press end with a measurement that is kept."""
    press = PressJob("p", "standard", "done", measurement_id=measurement_id, exam_id=exam_id)
    told = {"step": "result", "guidance": Guidance.DONE, "press": press, "measurement_id": measurement_id}
    probe.procedure.board.update(**told)
    expect(page.locator("#panel")).to_have_attribute("data-view", "result")
    expect(page.locator("#act-details")).to_be_visible()


def open_from_history(page: Page, measurement_id: str) -> None:
    """Show a measurement of before, whosever it is."""
    page.locator("#menu-open").click()
    page.locator("#menu-history").click()
    page.locator("#history-all").click()
    page.locator(f'.kept[data-id="{measurement_id}"] .kept-open').click()
    expect(page.locator("#act-now")).to_be_visible()


@pytest.mark.parametrize("number", [1, 2])
@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_every_button_below_a_result_is_in_reach(browser: Browser, probe: ServedProbe, language: str, number: int):
    """The second one belongs to no exam, and is opened from the history: it can be added to this one."""
    number += 10 * (language == "de-DE")
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe, SMALLEST, locale=language)
    exam_id = open_exam(page, probe)
    of_exam = exam_id if number % 10 == 1 else None
    keep(probe.procedure.store, number, exam_id=of_exam)
    if of_exam:
        show(page, probe, f"m-{number}", of_exam)
    else:
        open_from_history(page, f"m-{number}")
    assert page.locator(".acts .button:visible").count() == (5 if of_exam else 4)
    shoot(page, f"small/acts-{language[:2]}-{number % 10}")
    assert page.locator(".acts").evaluate(CUT_OFF) == []
    assert page.locator(".acts").evaluate(BROKEN_WORDS) == []
    assert wrong_in(page) == []
    if of_exam:
        expect(page.locator("#repeats")).to_be_in_viewport(ratio=0.99)  # how far measurements agree
    page.locator("#act-details").click()
    expect(page.locator("#details-picture .image-frame")).to_be_in_viewport(ratio=0.99)
    page.wait_for_function("() => document.querySelector('#details-picture img').complete")
    shoot(page, f"small/details-{language[:2]}-{number % 10}")
    assert wrong_in(page) == []
    page.context.close()


@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
@pytest.mark.parametrize("warnings", [(CLOCK,), (CLOCK, ARCHIVE)], ids=["one", "two"])
def test_beside_a_warning_every_figure_keeps_its_interval(
    browser: Browser, probe: ServedProbe, language: str, warnings: tuple[DeviceError, ...]
):
    """E030 stays as long as the hospital's archive is down, which may be all day."""
    number = 60 + 2 * len(warnings) + (language == "de-DE")
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe, SMALLEST, locale=language)
    exam_id = open_exam(page, probe)
    keep(probe.procedure.store, number, exam_id=exam_id)
    show(page, probe, f"m-{number}", exam_id)
    probe.procedure.board.update(warnings=warnings)
    expect(page.locator("#faults .fault")).to_have_count(1)
    shoot(page, f"small/warned-{language[:2]}-{len(warnings)}")
    for name in ("size", "depth", "modulus"):
        tile = page.locator(f"#{name}-tile")
        assert tile.evaluate("(one) => one.scrollHeight <= one.clientHeight"), name
        expect(page.locator(f"#{name}-interval")).to_be_in_viewport(ratio=0.99)
    assert wrong_in(page) == []
    probe.procedure.board.update(warnings=())
    page.context.close()


@pytest.mark.parametrize("size", [(360, 640)], ids=named)
@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_a_phone_shows_a_result_whole_and_starts_the_next_press(
    browser: Browser, probe: ServedProbe, language: str, size: tuple[int, int]
):
    """It scrolls; the press button stays in reach."""
    number = 40 + (language == "de-DE")
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe, size, locale=language)
    exam_id = open_exam(page, probe)
    assert wrong_in(page) == []
    keep(probe.procedure.store, number, exam_id=exam_id, picture=PICTURE)
    show(page, probe, f"m-{number}", exam_id)
    expect(page.locator("#press-button")).to_be_in_viewport(ratio=0.99)
    shoot(page, f"small/phone-{language[:2]}-{size[0]}")
    for name in ("modulus-interval", "image-title", "repeats", "act-finish"):
        page.locator(f"#{name}").scroll_into_view_if_needed()
        expect(page.locator(f"#{name}")).to_be_in_viewport(ratio=0.99)
    assert page.locator(".tile").evaluate_all("tiles => tiles.flatMap(tile => (" + BROKEN_WORDS + ")(tile))") == []
    assert wrong_in(page) == []
    page.context.close()


def said_size_error(worth: ModeWorth | None) -> str:
    """Return how the screen writes a mode's typical error of size, as the model card has it; "" where it has none."""
    return f"±{worth.median_percent['size_mm']:.0f}\u00a0%" if worth else ""


@pytest.mark.parametrize("size", SIZES[:2], ids=named)
@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_each_mode_says_its_worth_and_leaves_the_figures_whole(
    browser: Browser, probe: ServedProbe, language: str, size: tuple[int, int]
):
    probe.procedure.board.update(measurement_id=None)
    page, wrong = opened(browser, probe, size, locale=language), {}
    size_errors = [said_size_error(offer.worth) for offer in probe.procedure.offers()]
    assert sum(bool(error) for error in size_errors) == 3, "each mode but paper has a figure in its model card"
    for who in ("nobody", "A-17"):
        for index, error in enumerate(size_errors):
            page.locator("#modes label").nth(index).click()
            worth = page.locator("#mode-trade" if size == SMALLEST else "#modes input:checked + .mode-words")
            expect(worth).to_contain_text(error)
            expect(worth).to_be_in_viewport(ratio=0.99)
            wrong[who, index] = wrong_in(page)
            shoot(page, f"small/mode-{who}-{index}-{language[:2]}-{size[0]}")
        open_exam(page, probe)
    page.context.close()
    assert {state: found for state, found in wrong.items() if found} == {}


@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_who_is_examined_and_the_menu_need_no_scrolling(browser: Browser, probe: ServedProbe, language: str):
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe, SMALLEST, locale=language)
    page.locator("#exam-button").click()
    for name in ("patient-ref", "operator", "order-number", "to-place", "begin-phantom", "free-press"):
        expect(page.locator(f"#{name}")).to_be_in_viewport(ratio=0.99)
    assert wrong_in(page) == []
    page.locator("#chooser-close").click()
    page.locator("#menu-open").click()
    for name in ("self-test-open", "pair", "language-de", "colours-dark", "sound-off"):
        expect(page.locator(f"#{name}")).to_be_in_viewport(ratio=0.99)
    assert wrong_in(page) == []
    page.locator("#self-test-open").click()
    expect(page.locator("#self-test-close")).to_be_in_viewport(ratio=0.99)
    assert wrong_in(page) == []
    page.context.close()


@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
def test_no_word_of_a_comparison_is_broken(browser: Browser, probe: ServedProbe, language: str):
    probe.procedure.board.update(measurement_id=None)
    page = opened(browser, probe, SMALLEST, locale=language)
    exam_id = open_exam(page, probe)
    first = 30 if language == "de-DE" else 20
    for number in (first, first + 1):
        keep(probe.procedure.store, number, exam_id=exam_id, picture=PICTURE)
    page.locator("#menu-open").click()
    page.locator("#menu-history").click()
    for index in range(2):
        page.locator(".marker").nth(index).click()
    expect(page.locator("#comparison tr")).to_have_count(5)
    page.wait_for_function("() => [...document.images].every(one => !one.src || one.complete)")
    shoot(page, f"small/comparison-{language[:2]}")
    assert page.locator("#comparison").evaluate(BROKEN_WORDS) == []
    sideways = "box => box.parentElement.scrollWidth - box.parentElement.clientWidth"
    assert page.locator("#comparison").evaluate(sideways) == 0
    assert wrong_in(page) == []
    page.context.close()
