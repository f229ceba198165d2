"""What was measured, in a real Chromium: of one lesion and no other, as it is now, whoever has changed it."""

from __future__ import annotations

import math
import re
from typing import Any

import cv2
import numpy as np
import pytest
from kept_measurements import ESTIMATE, keep, taken
from opened_screen import SIZES, held, let_go, named, opened, shoot
from playwright.sync_api import Browser, Page, expect
from scanned import scan
from screen_layout import wrong_in
from served_probe import ServedProbe

from device.instrument.press.states import Guidance
from device.records.exams import ExamContent

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
EXAM = {"kind": "patient", "patient_ref": "A-17", "side": "left", "clock_position": 10, "operator": "Ada"}


def exam_of(page: Page, probe: ServedProbe, **changes: object) -> str:
    """Make an exam; return its id."""
    answer = page.request.post(f"{probe.url}/api/v1/exams", data=EXAM | changes)
    assert answer.ok, answer.text()
    return str(answer.json()["id"])


def of_size(size_mm: float) -> dict[str, Any]:
    """Return an estimate of a size, with an interval of 0.3 mm on both sides."""
    size = ESTIMATE["size_mm"] | {"value": size_mm, "low": size_mm - 0.3, "high": size_mm + 0.3}
    return {**ESTIMATE, "size_mm": size, "status": "partly_identifiable", "mode": "standard", "model": "standard"}


def open_history(page: Page, words: str) -> None:
    """Go on with an exam, and open what was measured."""
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text=words).first.click()
    expect(page.locator("#exam-button")).to_contain_text(words)
    page.locator("#history-open").click()


def compare(page: Page, words: str) -> None:
    """Put the two measurements of an exam side by side."""
    open_history(page, words)
    for index in range(2):
        page.locator(".marker input").nth(index).check()


def test_two_lesions_of_one_patient_have_a_trend_each(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    left, right = exam_of(page, probe), exam_of(page, probe, side="right", clock_position=2)
    again = exam_of(page, probe, nipple_distance_mm=35.0)
    for number, exam_id in ((41, left), (42, right), (43, right), (44, right), (45, again)):
        keep(probe.procedure.store, number, exam_id=exam_id)
    open_history(page, "Left 10 o'clock, 35 mm")
    page.locator("#history-patient").click()
    expect(page.locator(".kept")).to_have_count(5)
    expect(page.locator(".trend")).to_have_count(2)
    expect(page.locator(".trend").first).to_contain_text("Size in mm, Left 10 o'clock, with")
    expect(page.locator(".trend").first.locator(".trend-value")).to_have_count(2)
    shoot(page, "history-trend")
    assert wrong_in(page) == []
    page.context.close()


NORTH, SOUTH = "Klinikum Nord", "Klinikum Süd"


def test_one_number_of_two_issuers_is_two_patients_in_the_trend_and_beside_each_other(
    browser: Browser, probe: ServedProbe
):
    """The hospital has merged: 4711 of one and of the other are two people; who types it by hand names neither."""
    store = probe.procedure.store
    content = ExamContent(**{**EXAM, "patient_ref": "4711"})
    exams = {issuer: store.exams.make(content, issuer=issuer)["id"] for issuer in (NORTH, SOUTH, NORTH, None)}
    for number, issuer in ((11, NORTH), (12, NORTH), (13, SOUTH), (14, None)):
        keep(store, number, exam_id=exams[issuer])
    page = opened(browser, probe)
    page.locator("#exam-button").click()
    rows = page.locator("#recent .recent strong").filter(has_text="4711")
    for width, height in SIZES[:2][::-1]:
        page.set_viewport_size({"width": width, "height": height})
        shoot(page, f"chooser-issuers-{width}")
        assert wrong_in(page) == []
    expect(rows).to_have_text(["4711", "4711 (Klinikum Nord)", "4711 (Klinikum Süd)", "4711 (Klinikum Nord)"])
    page.locator("#chooser-close").click()
    open_history(page, "4711 (Klinikum Nord)")
    page.locator("#history-patient").click()
    expect(page.locator(".kept")).to_have_count(2)
    expect(page.locator(".trend").first.locator(".trend-value")).to_have_count(2)
    left_out = page.locator("#history-others")
    expect(left_out).to_have_text("Exams of number 4711 that may be another person's, left out: 2.")
    for width, height in SIZES[:2]:
        page.set_viewport_size({"width": width, "height": height})
        shoot(page, f"history-issuers-{width}")
        assert wrong_in(page) == []
    page.set_viewport_size({"width": SIZES[0][0], "height": SIZES[0][1]})
    page.locator("#history-all").click()
    expect(left_out).to_be_hidden()
    for one, other in (("m-11", "m-13"), ("m-13", "m-14")):
        for measurement_id in (one, other):
            page.locator(f'.kept[data-id="{measurement_id}"] .marker input').check()
        expect(page.locator("#compare-why")).to_have_text("No difference: they are not known to be of one lesion.")
    expect(page.locator("#comparison")).to_contain_text("4711 (Klinikum Süd) Left 10 o'clock")
    page.locator("#history-close").click()
    expect(page.locator("#exam-who")).to_have_text("4711 (Klinikum Nord)")
    for width, height in SIZES[:2][::-1]:
        page.set_viewport_size({"width": width, "height": height})
        shoot(page, f"header-issuer-{width}")
    page.locator("#exam-button").click()
    page.locator("#recent .recent").filter(has_text="4711").first.click()
    page.locator("#history-open").click()
    page.locator("#history-patient").click()
    expect(page.locator(".kept")).to_have_count(1)
    expect(left_out).to_have_text("Exams of number 4711 that may be another person's, left out: 3.")
    expect(page.locator(".trend")).to_have_count(0)
    page.context.close()


def test_a_patient_whose_number_another_issuer_has_given_more_often_has_a_trend(browser: Browser, probe: ServedProbe):
    """The newest exams of that number, as many as one answer holds, are all of the other patient."""
    store = probe.procedure.store
    content = ExamContent(**{**EXAM, "patient_ref": "0815"})
    of_north = store.exams.make(content, issuer=NORTH)["id"]
    for _ in range(200):
        store.exams.make(content, issuer=SOUTH)
    again = store.exams.make(content, issuer=NORTH)["id"]
    for number, exam_id in ((71, of_north), (72, again)):
        keep(store, number, exam_id=exam_id)
    page = opened(browser, probe)
    open_history(page, "0815 (Klinikum Nord)")
    page.locator("#history-patient").click()
    expect(page.locator(".kept")).to_have_count(2)
    expect(page.locator("#history-others")).to_contain_text("left out: 199.")
    page.context.close()


def test_an_exam_of_more_measurements_than_an_answer_holds_is_shown_whole(browser: Browser, probe: ServedProbe):
    store = probe.procedure.store
    exam = store.exams.make(ExamContent(**{**EXAM, "patient_ref": "C-33"}))
    for number in range(1000, 1203):
        keep(store, number, exam_id=exam["id"], taken_at=taken(number % 60))
    page = opened(browser, probe)
    open_history(page, "C-33")
    expect(page.locator(".kept")).to_have_count(203)
    expect(page.locator("#history-more")).to_be_hidden()
    page.context.close()


def test_the_reason_of_a_void_one_is_said_in_the_language_of_who_reads_it(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe, locale="de-DE")
    exam_id = exam_of(page, probe, patient_ref="B-22")
    keep(probe.procedure.store, 51, exam_id=exam_id)
    open_history(page, "B-22")
    page.locator(".kept-open").click()
    page.locator("#act-void").click()
    page.get_by_role("button", name="Sonde abgerutscht").click()
    expect(page.locator("#status-reason")).to_contain_text("Sonde abgerutscht")
    voided = probe.procedure.store.measurement("m-51")["voided"]
    assert (voided["by"], voided["reason"]) == ("Ada", "The probe slipped")
    page.context.close()
    page = opened(browser, probe)
    open_history(page, "B-22")
    page.locator(".kept-open").click()
    expect(page.locator("#status-reason")).to_contain_text("The probe slipped")
    page.context.close()


def test_what_another_screen_does_is_shown_in_an_open_history_and_result(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    exam_id = exam_of(page, probe, patient_ref="C-5")
    keep(probe.procedure.store, 55, exam_id=exam_id)
    probe.procedure.board.update(measurement_id="m-55")
    open_history(page, "C-5")
    page.locator(".marker input").check()
    page.locator(".marker input").focus()
    keep(probe.procedure.store, 56, exam_id=exam_id)
    expect(page.locator(".kept")).to_have_count(2)
    expect(page.locator('.kept[data-id="m-55"] input')).to_be_checked()
    expect(page.locator('.kept[data-id="m-55"] input')).to_be_focused()
    page.locator("#history-close").click()
    other = opened(browser, probe)
    open_history(other, "C-5")
    page.locator("#history-open").click()
    page.locator('.kept[data-id="m-55"] .kept-open').click()
    expect(page.locator("#instruction")).to_have_text("Measured in part")
    other.locator('.kept[data-id="m-55"] .kept-open').click()
    other.locator("#act-void").click()
    other.get_by_role("button", name="Wrong place").click()
    other.get_by_role("button", name="Void it").click()
    expect(page.locator("#instruction")).to_have_text("Void: does not count")
    expect(page.locator("#result")).to_have_attribute("data-voided", "true")
    probe.procedure.board.update(measurement_id=None)
    for one in (page, other):
        one.context.close()


def test_what_is_shown_from_the_history_has_its_own_patients_name(browser: Browser, probe: ServedProbe):
    """Another patient's figures never stand under the name of the exam that is open."""
    page = opened(browser, probe)
    other = exam_of(page, probe, patient_ref="E-9", side="right", clock_position=2)
    exam_of(page, probe, patient_ref="D-7")
    keep(probe.procedure.store, 31, exam_id=other)
    keep(probe.procedure.store, 32)
    open_history(page, "D-7")
    page.locator("#history-all").click()
    header = page.locator("#exam-button")
    for measurement_id, who in (("m-31", "E-9Right 2 o'clock"), ("m-32", "Free press: no patient")):
        page.locator(f'.kept[data-id="{measurement_id}"] .kept-open').click()
        expect(header).to_have_attribute("data-who", "other")
        expect(header).to_contain_text(who)
        expect(header).not_to_contain_text("D-7")
        shoot(page, f"history-other-{measurement_id}")
        assert wrong_in(page) == []
        if measurement_id == "m-31":
            change = {"by": "Bo", "reason": "Mistyped", "changes": {"patient_ref": "E-10"}}
            url, headers = f"{probe.url}/api/v1/exams/{other}", {"If-Match": '"1"'}
            assert page.request.patch(url, data=change, headers=headers).ok
            expect(header).to_contain_text("E-10")
        expect(page.locator("#press-button")).to_have_text("Back to D-7")
        page.locator("#press-button").click()
        expect(header).to_contain_text("D-7")
        assert page.request.get(f"{probe.url}/api/v1/status").json()["press"] is None
        page.locator("#history-open").click()
        page.locator("#history-all").click()
    page.context.close()


def test_a_difference_is_told_of_one_lesion_alone_and_between_its_ends(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    here = exam_of(page, probe, patient_ref="F-1")
    later = exam_of(page, probe, patient_ref="F-1", nipple_distance_mm=30.0)
    elsewhere = exam_of(page, probe, patient_ref="F-1", side="right", clock_position=2)
    for number, exam_id, size_mm in ((21, here, 10.2), (22, later, 12.2), (23, elsewhere, 12.2), (24, here, 10.3)):
        keep(probe.procedure.store, number, exam_id=exam_id, estimate=of_size(size_mm))
    probe.procedure.store.exams.void("m-24", version=1, by="Ada", reason="Slipped")
    open_history(page, "F-1")
    page.locator("#history-patient").click()
    expect(page.locator(".kept")).to_have_count(4)
    marks = {id: page.locator(f'.kept[data-id="m-{id}"] input') for id in (21, 22, 23, 24)}
    size = page.locator("#comparison tr").nth(2).locator("td").nth(2)
    marks[21].check()
    marks[22].check()
    expect(size).to_have_text("+1.5 – +2.5 mm")
    expect(page.locator("#comparison tr").nth(3).locator("td").nth(2)).to_have_text("none can be told")
    expect(page.locator("#comparison tr").first).to_contain_text("· F-1 Left 10 o'clock, 30 mm")
    marks[23].check()
    expect(page.locator("#comparison tr").first).to_contain_text("· F-1 Right 2 o'clock")
    expect(size).to_have_text("–")
    expect(page.locator("#compare-why")).to_contain_text("not known to be of one lesion")
    marks[24].check()
    marks[21].check()
    expect(page.locator("#comparison tr").first).to_contain_text("void")
    expect(size).to_have_text("–")
    shoot(page, "history-comparison")
    assert wrong_in(page) == []
    page.context.close()


def sized(low: float, size_mm: float, high: float, **of_estimate: object) -> dict[str, Any]:
    """Return an estimate of a size with its interval; `low_is_open` and `high_is_open` are of its ends."""
    ends = {end: bool(of_estimate.pop(end, False)) for end in ("low_is_open", "high_is_open")}
    size = ESTIMATE["size_mm"] | {"low": low, "value": size_mm, "high": high} | ends
    return {**of_size(size_mm), "size_mm": size, **of_estimate}


NETWORK_ALONE = {"model_card_sha256": ""}
"""Of measurements of before, which say no card."""
DIFFERENCES = [
    (sized(10.0, 10.2, 11.6), sized(10.8, 12.0, 12.2), "none can be told"),  # half widths, 0.8 and 0.7, told of growth
    (sized(8.8, 10.2, 10.4), sized(11.8, 12.0, 13.4), "+1.5 – +3.8 mm"),
    (sized(11.8, 12.0, 13.4), sized(8.8, 10.2, 10.4), "-3.8 – -1.5 mm"),
    (sized(10.0, 10.2, 10.4), sized(11.8, 12.0, 13.4, high_is_open=True), "+1.5 mm or more"),
    (sized(10.0, 10.2, 10.4), sized(11.8, 12.0, 13.4, low_is_open=True), "open interval: none can be told"),
    (sized(10.0, 10.2, 10.4, high_is_open=True), sized(11.8, 12.0, 12.2), "open interval: none can be told"),
    (sized(10.0, 10.0, 10.0), sized(10.3, 14.0, 18.0), "none can be told"),  # 0.3 to 8 mm, rounded outwards to 0
    (sized(10.0, 10.2, 10.4, **NETWORK_ALONE), sized(11.8, 12.0, 12.2, **NETWORK_ALONE), "+1.51 – +2.09 mm"),
]


@pytest.mark.parametrize(("one", "other", "words"), DIFFERENCES)
def test_each_end_of_a_difference_has_the_arms_that_lead_to_it(
    browser: Browser, probe: ServedProbe, one: dict[str, Any], other: dict[str, Any], words: str
):
    page = opened(browser, probe)
    nth = DIFFERENCES.index((one, other, words))
    exam_id = exam_of(page, probe, patient_ref=f"G-{nth}")
    for number, estimate in ((300 + 2 * nth, one), (301 + 2 * nth, other)):
        keep(probe.procedure.store, number, exam_id=exam_id, estimate=estimate, taken_at=taken(number % 60))
    compare(page, f"G-{nth}")
    expect(page.locator("#comparison tr").nth(2).locator("td").nth(2)).to_have_text(words)
    expect(page.locator("#compare-why")).to_be_hidden()
    shoot(page, f"history-difference-{nth}")
    page.context.close()


@pytest.mark.parametrize(
    ("number", "changes", "words"),
    [
        (400, {"mode": "quick"}, "modes differ by more than presses of one mode do"),
        (402, {"estimate": of_size(12.2) | {"model_card_sha256": "c3" * 32}}, "not known to be of one model"),
        (404, {"estimate": of_size(12.2) | {"model_card_sha256": ""}}, "not known to be of one model"),
    ],
)
def test_presses_of_two_modes_or_models_have_no_difference_and_the_screen_says_why(
    browser: Browser, probe: ServedProbe, number: int, changes: dict[str, Any], words: str
):
    page = opened(browser, probe)
    exam_id = exam_of(page, probe, patient_ref=f"H-{number}")
    keep(probe.procedure.store, number, exam_id=exam_id, estimate=of_size(10.2), taken_at=taken(1))
    keep(
        probe.procedure.store, number + 1, exam_id=exam_id, **{"estimate": of_size(12.2), **changes}, taken_at=taken(2)
    )
    compare(page, f"H-{number}")
    expect(page.locator("#comparison tr").nth(2).locator("td").nth(2)).to_have_text("–")
    expect(page.locator("#compare-why")).to_contain_text(words)
    assert wrong_in(page) == []
    page.context.close()


def test_a_trend_is_of_one_mode_and_its_open_ends_are_arrows(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    exam_id = exam_of(page, probe, patient_ref="I-1")
    closed, opened_up = sized(9.9, 10.2, 10.5), sized(9.0, 12.2, 30.0, high_is_open=True)
    opened_down = sized(2.0, 4.2, 6.0, low_is_open=True)
    for number, mode, estimate in (
        (500, "standard", closed), (501, "standard", opened_up), (502, "standard", opened_down), (503, "quick", closed),
    ):  # fmt: skip
        keep(probe.procedure.store, number, exam_id=exam_id, mode=mode, estimate=estimate, taken_at=taken(number - 490))
    open_history(page, "I-1")
    page.locator("#history-patient").click()
    trend = page.locator(".trend").first
    expect(trend.locator(".trend-value")).to_have_count(3)
    expect(trend.locator(".trend-open")).to_have_count(2)
    expect(trend).to_contain_text("An arrow is an open end.")
    expect(page.locator(".trend").nth(1)).not_to_contain_text("arrow")
    expect(page.locator("#trends > .hint")).to_have_text("Mode Standard by one model alone; others left out: 1.")
    ends = trend.locator(".trend-interval").evaluate_all("all => all.map(one => one.getAttribute('d').split('V')[1])")
    assert ends[1] == "6", "the open interval goes to the edge of the chart"
    shoot(page, "history-trend-open")
    assert wrong_in(page) == []
    page.context.close()


@pytest.mark.parametrize(
    ("locale", "words"), [("en-GB", "Size: some are open, no range"), ("de-DE", "Größe: teils offen, keine Spanne")]
)
def test_presses_that_agree_as_far_as_open_ends_let_see_have_no_range(
    browser: Browser, probe: ServedProbe, locale: str, words: str
):
    page = opened(browser, probe, SIZES[1], locale=locale)
    number = 600 if locale == "en-GB" else 610
    exam_id = exam_of(page, probe, patient_ref=f"J-{number}")
    for more, estimate in ((0, sized(9.9, 10.2, 10.5)), (1, sized(9.0, 12.2, 30.0, high_is_open=True))):
        keep(probe.procedure.store, number + more, exam_id=exam_id, estimate=estimate, taken_at=taken(more))
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text=f"J-{number}").first.click()
    probe.procedure.board.update(step="result", guidance=Guidance.DONE, measurement_id=f"m-{number + 1}")
    expect(page.locator("#repeats")).to_contain_text(words)
    expect(page.locator("#repeats")).to_contain_text("6.4 – 6.4 mm" if locale == "en-GB" else "6,4 – 6,4 mm")
    shoot(page, f"repeats-open-{locale[:2]}")
    assert wrong_in(page) == []
    probe.procedure.board.update(step="ready", measurement_id=None)
    page.context.close()


def test_presses_by_another_model_are_not_among_those_that_agree(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe, SIZES[1])
    exam_id = exam_of(page, probe, patient_ref="J-620")
    for more, (low, card) in enumerate(((5.0, "c3"), (9.9, "b2"), (10.0, "b2"))):
        estimate = sized(low, low + 0.3, low + 0.6) | {"model_card_sha256": card * 32}
        keep(probe.procedure.store, 620 + more, exam_id=exam_id, estimate=estimate, taken_at=taken(more))
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text="J-620").first.click()
    probe.procedure.board.update(step="result", guidance=Guidance.DONE, measurement_id="m-622")
    expect(page.locator("#repeats")).to_contain_text("2 measurements here")
    expect(page.locator("#repeats")).to_contain_text("Size 10.20 – 10.30 mm")
    probe.procedure.board.update(step="ready", measurement_id=None)
    page.context.close()


@pytest.mark.parametrize(
    ("number", "card", "cited"), [(700, "b2" * 32, "standard " + "b2" * 32), (701, "", "standard " + "a1" * 32)]
)
def test_the_details_cite_the_models_card_and_say_which_probe_measured_at_which_force(
    browser: Browser, probe: ServedProbe, number: int, card: str, cited: str
):
    page = opened(browser, probe)
    exam_id = exam_of(page, probe, patient_ref=f"K-{number}")
    keep(
        probe.procedure.store,
        number,
        exam_id=exam_id,
        estimate=ESTIMATE | {"model_card_sha256": card},
        taken_at=taken(1),
    )
    open_history(page, f"K-{number}")
    page.locator(".kept-open").click()
    page.locator("#act-details").click()
    expect(page.locator("#details-list")).to_contain_text(cited)
    expect(page.locator("#details-list")).to_contain_text("10 images, mean force 0.501 N")
    expect(page.locator("#details-list")).to_contain_text("SIM-0001, software 0.1.0")
    assert wrong_in(page) == []
    page.context.close()


def test_who_scans_another_patient_finds_the_history_of_the_one_before_closed(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    exam_of(page, probe, patient_ref="OLD-1")
    open_history(page, "OLD-1")
    expect(page.locator("#exports a").first).to_have_text("Report (PDF)")
    of_old = page.locator("#exports a").first.get_attribute("href")
    scan(page, "NEW-2")
    page.locator("#operator").fill("Ada")
    page.locator("#to-place").click()
    page.locator('.hour[data-side="left"][data-hour="10"]').click()
    page.locator("#begin-exam").click()
    expect(page.locator("#exam-who")).to_have_text("NEW-2")
    expect(page.locator("dialog[open]")).to_have_count(0)
    page.locator("#history-open").click()
    new = page.request.get(f"{probe.url}/api/v1/exams?patient_ref=NEW-2").json()["exams"][0]["id"]
    expect(page.locator("#exports a").first).to_have_attribute("href", f"/api/v1/exams/{new}/report.pdf")
    assert of_old != page.locator("#exports a").first.get_attribute("href")
    shoot(page, "history-after-scan")
    assert wrong_in(page) == []
    page.context.close()


GREY = 90
PICTURE = cv2.imencode(".png", np.full((358, 480), GREY, np.uint8))[1].tobytes()


def middle_of_picture(page: Page) -> int:
    """Return how bright the picture of the result is in its middle, as a person sees it; without one it is black."""
    seen = cv2.imdecode(np.frombuffer(page.locator(".image-frame").screenshot(), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert seen is not None
    return int(seen[seen.shape[0] // 2, seen.shape[1] // 2])


def test_the_picture_of_one_measurement_does_not_stand_beside_the_figures_of_another(
    browser: Browser, probe: ServedProbe
):
    """While its own picture is on its way there is none, nor what the colours of the one before mean."""
    page = opened(browser, probe)
    exam_id = exam_of(page, probe, patient_ref="M-1")
    for number in (811, 812):
        keep(probe.procedure.store, number, exam_id=exam_id, taken_at=taken(number - 810), picture=PICTURE)
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text="M-1").first.click()
    probe.procedure.board.update(step="result", guidance=Guidance.DONE, measurement_id="m-812")
    page.wait_for_function("() => document.querySelector('#image').naturalWidth > 0")
    assert middle_of_picture(page) == GREY
    expect(page.locator("#colour-relative")).to_be_visible()
    held(page, "**/api/v1/measurements/m-811/image.png", most=math.inf)
    page.locator("#history-open").click()
    page.locator('.kept[data-id="m-811"] .kept-open').click()
    expect(page.locator("#act-now")).to_be_visible()
    assert middle_of_picture(page) == 0
    expect(page.locator("#colour-relative")).to_be_hidden()
    page.locator("#act-now").click()
    page.wait_for_function("() => document.querySelector('#image').naturalWidth > 0")
    assert middle_of_picture(page) == GREY
    expect(page.locator("#colour-relative")).to_be_visible()
    probe.procedure.board.update(step="ready", measurement_id=None)
    page.context.close()


def test_figures_that_were_looked_at_do_not_stand_under_the_exam_that_is_opened_then(
    browser: Browser, probe: ServedProbe
):
    """Also while the page asks the probe again what it offers, as after each press."""
    page = opened(browser, probe)
    of_newest, of_older = exam_of(page, probe, patient_ref="N-1"), exam_of(page, probe, patient_ref="N-2")
    keep(probe.procedure.store, 821, exam_id=of_older, taken_at=taken(1), estimate=of_size(12.2))
    keep(probe.procedure.store, 822, exam_id=of_newest, taken_at=taken(2))
    late = held(page, "**/api/v1/device")
    with page.expect_request("**/api/v1/device"):
        probe.procedure.board.update(step="result", guidance=Guidance.DONE, measurement_id="m-822")
    page.locator("#history-open").click()
    page.locator('.kept[data-id="m-821"] .kept-open').click()
    expect(page.locator("#exam-who")).to_have_text("N-2")
    expect(page.locator("#size-value")).to_have_text("12.2 mm")
    page.locator("#exam-button").click()
    page.locator(".recent").filter(has_text="N-1").first.click()
    expect(page.locator("#exam-who")).to_have_text("N-1")
    expect(page.locator("#size-value")).to_be_hidden()
    late[0].continue_()
    probe.procedure.board.update(step="ready", measurement_id=None)
    page.context.close()


def test_a_measurement_that_was_left_is_not_shown_again_by_an_answer_that_comes_late(
    browser: Browser, probe: ServedProbe
):
    """The probe was asked what another screen has changed of it, and answered after the way back to the open exam."""
    page = opened(browser, probe)
    here, elsewhere = exam_of(page, probe, patient_ref="O-1"), exam_of(page, probe, patient_ref="O-2")
    keep(probe.procedure.store, 831, exam_id=elsewhere, taken_at=taken(1), estimate=of_size(12.2))
    keep(probe.procedure.store, 832, exam_id=here, taken_at=taken(2))
    open_history(page, "O-1")
    page.locator("#history-all").click()
    page.locator('.kept[data-id="m-831"] .kept-open').click()
    who = page.locator("#exam-who")
    expect(who).to_have_text("O-2")
    probe.procedure.board.update(step="result", guidance=Guidance.DONE, measurement_id="m-832")
    asked = f"**/api/v1/exams/{elsewhere}"
    late = held(page, asked)
    with page.expect_request(asked):
        keep(probe.procedure.store, 833, exam_id=elsewhere, taken_at=taken(3))
    page.locator("#act-now").click()
    expect(who).to_have_text("O-1")
    let_go(page, late)
    expect(page.locator("#size-value")).to_have_text("10.2 mm")
    expect(who).to_have_text("O-1")
    probe.procedure.board.update(step="ready", measurement_id=None)
    page.context.close()


def ask_where_to_move(page: Page, measurement_id: str) -> None:
    """Look at a measurement of the open exam, and say that it is another patient's."""
    page.locator("#history-open").click()
    page.locator(f'.kept[data-id="{measurement_id}"] .kept-open').click()
    page.locator("#act-void").click()
    page.locator("#void-reasons .button").nth(2).click()
    page.locator("#void-move").click()


def test_the_measurement_that_is_moved_is_the_one_that_was_asked_about_last(browser: Browser, probe: ServedProbe):
    page = opened(browser, probe)
    wrong, right = exam_of(page, probe, patient_ref="P-1"), exam_of(page, probe, patient_ref="P-2")
    for number in (841, 842):
        keep(probe.procedure.store, number, exam_id=wrong, taken_at=taken(number - 840))
    open_history(page, "P-1")
    page.locator("#history-close").click()
    asked = "**/api/v1/exams?kind=patient&limit=12"
    late = held(page, asked)
    with page.expect_request(asked):
        ask_where_to_move(page, "m-841")
    page.locator("#move-back").click()
    ask_where_to_move(page, "m-842")
    row = page.locator("#move-exams .recent").filter(has_text="P-2")
    expect(row).to_be_visible()
    let_go(page, late)
    row.click()
    page.locator("#move-yes").click()
    expect(page.locator("#exam-who")).to_have_text("P-2")
    kept = [probe.procedure.store.measurement(f"m-{number}")["exam_id"] for number in (841, 842)]
    assert kept == [wrong, right]
    page.context.close()


def test_what_is_marked_while_the_history_is_asked_for_anew_keeps_its_patient_and_is_shown_as_it_is_then(
    browser: Browser, probe: ServedProbe
):
    page, store = opened(browser, probe), probe.procedure.store
    exam_id = exam_of(page, probe, patient_ref="Q-1")
    for number in (851, 852):
        keep(store, number, exam_id=exam_id, taken_at=taken(number - 850))
    open_history(page, "Q-1")
    expect(page.locator(".kept")).to_have_count(2)
    asked = re.compile(f"/measurements\\?.*exam_id={exam_id}")
    late = held(page, asked)
    with page.expect_request(asked):
        keep(store, 853, exam_id=exam_id, taken_at=taken(3))
    for index in range(2):
        page.locator(".marker input").nth(index).check()
    heads = page.locator("#comparison tr").first.locator("td")
    expect(heads.first).to_contain_text("Q-1")
    expect(heads.nth(1)).to_contain_text("Q-1")
    let_go(page, late)
    expect(page.locator(".kept")).to_have_count(3)
    store.exams.void("m-851", version=1, by="Ada", reason="Slipped")
    expect(heads.first).to_contain_text("void")
    page.context.close()


def test_a_history_that_the_probe_has_not_answered_yet_shows_nothing_of_the_exam_before(
    browser: Browser, probe: ServedProbe
):
    """Neither rows nor the report of the patient before, and no answer about her when it comes after."""
    page = opened(browser, probe)
    before, now = exam_of(page, probe, patient_ref="L-1"), exam_of(page, probe, patient_ref="L-2")
    keep(probe.procedure.store, 801, exam_id=before, taken_at=taken(1))
    keep(probe.procedure.store, 802, exam_id=now, taken_at=taken(2))
    open_history(page, "L-1")
    rows, exports = page.locator(".kept"), page.locator("#exports a")
    expect(rows).to_have_attribute("data-id", "m-801")
    page.locator("#history-close").click()
    late = held(page, re.compile(f"/measurements\\?.*exam_id={now}"))
    open_history(page, "L-2")
    expect(page.locator("#history-exam")).to_have_attribute("aria-pressed", "true")
    expect(rows).to_have_count(0)
    expect(exports).to_have_count(0)
    page.locator("#history-all").click()
    expect(page.locator('.kept[data-id="m-801"]')).to_be_visible()
    with page.expect_event("requestfailed"):
        late[0].abort()
    page.evaluate("async () => (await fetch('/api/v1/status')).text()")
    expect(page.locator('.kept[data-id="m-801"]')).to_be_visible()
    page.locator("#history-exam").click()
    expect(rows).to_have_attribute("data-id", "m-802")
    expect(exports.first).to_have_attribute("href", f"/api/v1/exams/{now}/report.pdf")
    page.context.close()


@pytest.mark.parametrize("language", ["en-GB", "de-DE"])
@pytest.mark.parametrize("size", SIZES[:2], ids=named)
def test_a_measurement_of_another_patient_is_moved_to_her_exam(
    browser: Browser, probe: ServedProbe, size: tuple[int, int], language: str
):
    number = 1300 + 2 * SIZES.index(size) + (language == "de-DE")
    page = opened(browser, probe, locale=language)
    right = exam_of(page, probe, patient_ref=f"RIGHT-{number}")
    wrong = exam_of(page, probe, patient_ref=f"WRONG-{number}")
    keep(probe.procedure.store, number, exam_id=wrong, taken_at=taken(1))
    open_history(page, f"WRONG-{number}")
    page.locator(".kept-open").click()
    page.locator("#act-void").click()
    page.set_viewport_size({"width": size[0], "height": size[1]})
    page.locator("#void-reasons .button").nth(2).click()
    expect(page.locator("#void-move")).to_be_focused()
    name = f"moved/{language[:2]}-{size[0]}"
    shoot(page, f"{name}-offered")
    assert wrong_in(page) == []
    page.locator("#void-move").click()
    row = page.locator("#move-exams .recent").filter(has_text=f"RIGHT-{number}")
    expect(row).to_be_visible()
    expect(page.locator("#move-exams .recent").filter(has_text=f"WRONG-{number}")).to_have_count(0)
    shoot(page, f"{name}-which")
    assert wrong_in(page) == []
    row.click()
    expect(page.locator("#move-sure")).to_contain_text(f"RIGHT-{number}")
    assert probe.procedure.store.measurement(f"m-{number}")["exam_id"] == wrong
    page.locator("#move-yes").click()
    expect(page.locator("#exam-who")).to_have_text(f"RIGHT-{number}")
    moved = probe.procedure.store.measurement(f"m-{number}")
    assert (moved["exam_id"], moved["voided"]) == (right, None)
    shoot(page, f"{name}-done")
    page.context.close()
