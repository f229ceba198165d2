"""Scenarios of faults at the real daemon, photographed: what the screen says of them is whole, and said once.

One of each part and severity stands for the others: each code is raised in tests/device/test_scenarios.py, and each is
on the screen in test_screen_faults.py. `make torture` shows every scenario.

A scenario with which the daemon does not start has another page (test_fallback.py).
"""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest
from daemon_process import QUICK_HAND, ROOT, Daemon
from every_case import one_of_each
from opened_screen import shoot
from playwright.sync_api import Page, expect
from screen_layout import wrong_in

from device.errors import DeviceError
from device.simulation.scenario import read_scenario

pytestmark = [pytest.mark.browser, pytest.mark.real_time, pytest.mark.long]
SCENARIOS = sorted((ROOT / "scenarios").glob("*.toml"))
NO_START = {"bundle_tampered", "calibration_foreign", "calibration_missing", "enable_busy"}
TOUCHED_BY_ITSELF = {"cell_zero_drifting"}
"""The cell soon reads a touch, which begins a press: on a busy machine before anybody has chosen an exam."""
SHORT_PRESS = "\n[settings.press]\ntimeout_s = 20.0\n"
"""A hand that never gets there is given up sooner than after a minute, beside the lesion and on it."""
ENDED = "#panel:is([data-view='result'], [data-step='fault'], [data-step='rejected']), .fault, #status-word:not(:empty)"


def kind_of(path: Path) -> str:
    """Return the part that a scenario is about, and how severe it is; without a code only the part."""
    code = read_scenario(path).expects
    if not code:
        return path.stem.split("_")[0]
    return f"{code[:2]} {DeviceError.by_code[code].severity}"


def scene_of(path: Path) -> str:
    """Return a scenario whose hand and daemon do not take their time, unless the hand is what it is about."""
    text = path.read_text(encoding="utf-8")
    text += "" if "[settings.press]" in text else SHORT_PRESS
    return text if "[hand]" in text else text + "\n" + QUICK_HAND


def begin_free_press(page: Page) -> None:
    page.locator("#exam-button").click()
    page.locator("#free-press").click()
    page.locator("#free-yes").click()
    page.locator("#press-button").click()


@pytest.mark.parametrize(
    "path", one_of_each((one for one in SCENARIOS if one.stem not in NO_START), kind_of), ids=lambda path: path.stem
)
def test_the_screen_of_a_scenario_is_whole(page: Page, tmp_path: Path, path: Path) -> None:
    tomllib.loads(scene_of(path))
    daemon = Daemon(tmp_path, scene_of(path))
    try:
        page.goto(daemon.url)
        if path.stem not in TOUCHED_BY_ITSELF:
            begin_free_press(page)
        expect(page.locator(ENDED).first).to_be_attached()
        shoot(page, f"scenarios/{path.stem}")
        assert wrong_in(page) == []
        words = page.locator("#panel").inner_text()
        for remedy in page.locator(".fault-remedy").all_inner_texts():
            assert words.count(remedy) == 1
    finally:
        page.goto("about:blank")
        daemon.stop()
