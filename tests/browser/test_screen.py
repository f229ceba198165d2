"""The device's screen in a real headless Chromium: a new user presses the simulated probe and reads the result."""

from __future__ import annotations

import json
import math
import re
import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
import uvicorn
from daemon_process import PATIENT, QUICK_HAND, Daemon, wait_for
from opened_screen import shoot
from playwright.sync_api import Page, expect
from screen_layout import wrong_in
from small_release import tar
from stand_in_adviser import no_advice

from device.assembly import probe as assembly
from device.assembly.probe import open_simulated_probe
from device.config import CameraSection, simulated_config
from device.errors import StorageError
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.procedure import Procedure
from device.measurement.estimate import NO_NUMBERS, Estimate, Origin, Quantity, without_numbers
from device.measurement.mode import MODES, Mode, ModeWorth
from device.measurement.ramp_modes.estimate import CAUSES, REASONS
from device.measurement.ramp_modes.misfit_blocks import BLOCKS
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice, half_widths
from device.records.updates import Updates
from device.simulation import virtual_probe
from device.simulation.hand import HandSettings, VirtualHand
from device.simulation.physics.pressed_face import ProbePlacement
from device.simulation.scenario import Scenario
from device.web.app import create_app

pytestmark = [pytest.mark.browser, pytest.mark.real_time]
WAITS_AT_N = 0.3
BEGINNING = "Choose whose exam it is"


class WaitingHand(VirtualHand):
    """The default hand; its time stands still from `WAITS_AT_N` of its first press on, until it is told to go on.

    So what the screen says meanwhile is there for as long as it takes to be read.
    """

    def __init__(self, settings: HandSettings) -> None:
        super().__init__(settings)
        self._goes_on, self._waits_since_s, self._waited_s = False, math.inf, 0.0
        self._aside_mm = self._more_n = 0.0

    def _own_s(self, t_s: float) -> float:
        return t_s - self._waited_s if self._goes_on else min(t_s, self._waits_since_s)

    def go_on(self) -> None:
        self._waited_s = max(0.0, time.monotonic() - self._waits_since_s)
        self._goes_on = True

    def force_n(self, t_s: float) -> float:
        force_n = super().force_n(self._own_s(t_s))
        if force_n >= WAITS_AT_N and not self._goes_on:
            self._waits_since_s = min(t_s, self._waits_since_s)
        return force_n + (self._more_n if force_n >= WAITS_AT_N else 0.0)

    def place(self, t_s: float) -> ProbePlacement:
        return super().place(self._own_s(t_s))

    def follow(self, guidance: str, now_s: float, aside_mm: float | None = None) -> None:
        if guidance == "move_aside":
            self._aside_mm = aside_mm or 0.0
        else:
            super().follow(guidance, self._own_s(now_s))

    def go_aside(self, *, too_hard: bool = False) -> None:
        """Go on with a scan: the hand waits before it moves to another place, where it may lean on the probe."""
        self._more_n = 1.2 if too_hard else 0.0
        super().follow("move_aside", self._own_s(time.monotonic()), self._aside_mm)


@dataclass
class Served:
    """A simulated probe that is served from this process, and its hand."""

    url: str
    procedure: Procedure
    hand: WaitingHand
    updates: Path

    def updater_says(self, **progress: object) -> None:
        """Write what the updater tells of how far it is."""
        (self.updates / "progress.json").write_text(json.dumps(progress))


@pytest.fixture
def probe(page: Page, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Served]:
    """A simulated probe whose hand waits in the middle of its first ramp."""
    hands: list[WaitingHand] = []

    def waiting_hand(settings: HandSettings) -> WaitingHand:
        hands.append(WaitingHand(settings))
        return hands[-1]

    monkeypatch.setattr(virtual_probe, "VirtualHand", waiting_hand)
    config = replace(simulated_config(), data=tmp_path, camera=CameraSection(late_frames=100.0))
    procedure = open_simulated_probe(config, Scenario())
    procedure.start()
    (tmp_path / "updates" / "incoming").mkdir(parents=True)
    (tmp_path / "updates" / "state.json").write_text(json.dumps({"committed": "0.1.0+400", "previous": "0.0.9+390"}))
    app = create_app(procedure, procedure.store, updates=Updates(tmp_path / "updates", "0.1.0+400"))
    settings = uvicorn.Config(app, log_level="warning", timeout_graceful_shutdown=1, lifespan="off")
    server, listening = uvicorn.Server(settings), socket.create_server(("127.0.0.1", 0))
    serving = threading.Thread(target=server.run, kwargs={"sockets": [listening]})
    serving.start()
    yield Served(f"http://127.0.0.1:{listening.getsockname()[1]}", procedure, hands[0], tmp_path / "updates")
    page.goto("about:blank")  # an open event stream would hold the server
    server.should_exit = True
    serving.join()
    listening.close()
    procedure.close()


@pytest.fixture
def same_answer_in_every_mode(monkeypatch: pytest.MonkeyPatch) -> None:
    """To be asked for before the probe."""

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        size_mm, depth_mm, modulus_kpa = (
            Quantity(value, 0.8 * value, 1.2 * value, 0.1, True) for value in (12.0, 6.0, 60.0)
        )
        answer = size_mm, replace(depth_mm, low_is_open=True), replace(modulus_kpa, high_is_open=True)
        return Estimate(*answer, "ok", "", mode, "stand-in", "00", "c", True, {})

    worth = {
        mode: ModeWorth(compute_s, 0.9, {"size_mm": size, "depth_mm": depth, "youngs_modulus_kpa": 50.0}, {})
        for mode, compute_s, size, depth in (
            ("quick", 0.0046, 4.8, 7.3),
            ("standard", 0.1, 3.3, 3.0),
            ("precise", 0.9, 3.1, 2.4),
        )
    }
    monkeypatch.setattr(
        assembly, "answers_of_start", lambda *parts: ProbeAnswers(MODES, estimate, no_advice, worth=worth)
    )


@pytest.fixture
def narrowing_scan(monkeypatch: pytest.MonkeyPatch) -> None:
    """To be asked for before the probe: each further press on the lesion makes the intervals narrower.

    No size can be surer than 0.503 mm and no depth than 0.4 mm, the size is surer than 1 mm in four inclusions of five,
    and the modulus is not known by the first press.
    """
    reachable = {"size_mm": 0.503, "depth_mm": 0.4, "youngs_modulus_kpa": 9.0}
    errors = {"size_mm": 2.0, "depth_mm": 2.2, "youngs_modulus_kpa": 19.0}
    widths = {"size_mm": (0.8,) * 16 + (5.2,) * 3, "depth_mm": (0.8,) * 19, "youngs_modulus_kpa": (9.0,) * 19}
    worth = {"precise": ModeWorth(0.4, 0.9, errors, {}, reachable, {5: widths})}

    def advise(recording: Recording) -> ScanAdvice:
        ramps = len(recording.ramps())
        of_unknowns = [
            Quantity(value, value - width / ramps, value + width / ramps, 0.1, is_known)
            for value, width, is_known in ((12.2, 2.6, True), (6.1, 1.4, True), (63.0, 33.0, ramps > 1))
        ]
        estimate = Estimate(*of_unknowns, "ok", "", "precise", "stand-in", "00", "c", True, {})
        now = half_widths(estimate)
        return ScanAdvice(estimate, now, 4.0, {name: width * ramps / (ramps + 1) for name, width in now.items()})

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        return advise(recording).estimate

    monkeypatch.setattr(assembly, "answers_of_start", lambda *parts: ProbeAnswers(MODES, estimate, advise, worth=worth))


@pytest.fixture
def no_numbers_in_any_mode(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """To be asked for before the probe: no numbers, for every reason that there is; the parameter is the misfit's."""
    of_misfit, action = request.param

    def estimate(recording: Recording, mode: Mode) -> Estimate:
        reason = " ".join([*(REASONS | {"misfit_ratio": of_misfit}).values(), action])
        return without_numbers("outside_range", reason, Origin(mode, "stand-in", "00", "00", "c", True))

    monkeypatch.setattr(assembly, "answers_of_start", lambda *parts: ProbeAnswers(MODES, estimate, no_advice))


def _require_fits(page: Page) -> None:
    """Nothing scrolls, is cut off or too small on an 800 x 480 panel."""
    assert wrong_in(page) == []


def _press_freely(page: Page) -> None:
    """Choose a press without a patient, which is asked twice."""
    page.locator("#exam-button").click()
    page.locator("#free-press").click()
    page.locator("#free-yes").click()


def _require_whole_scan(page: Page) -> None:
    """Nothing of how sure a scan is is cut off."""
    cut = "nodes => nodes.filter(n => n.scrollHeight > n.clientHeight + 1).map(n => n.className)"
    assert page.locator("#scan, .scan-rows").evaluate_all(cut) == []


def test_a_new_user_presses_the_simulated_probe_and_reads_the_result(page: Page, probe: Served):
    page.goto(probe.url)
    expect(page.locator("#simulated-badge")).to_be_visible()
    expect(page.locator("#simulated-badge")).to_contain_text("simulated", ignore_case=True)
    _press_freely(page)
    button = page.locator("#press-button")
    expect(button).to_contain_text("simulated probe")
    expect(page.locator("#instruction")).to_have_text("Touch beside the lesion")
    shoot(page, "ready")
    button.click()
    expect(page.locator("#instruction")).to_have_text("Press slowly harder")
    shoot(page, "press-slowly-harder")
    _require_fits(page)
    probe.hand.go_on()
    expect(page.locator("#image-title")).to_have_text("Measurement 1, Standard")
    expect(page.locator("#size-value")).to_be_visible()
    shoot(page, "result")
    _require_fits(page)
    newest = probe.procedure.store.measurement(probe.procedure.board.now.measurement_id)
    size = newest["estimate"]["size_mm"]
    expect(page.locator("#size-value")).to_have_text(f"{size['value']:.1f} mm")
    expect(page.locator("#truth-size")).to_have_text("12.0 mm")
    modulus = newest["estimate"]["youngs_modulus_kpa"]
    shown = f"{modulus['value']:.0f} kPa" if modulus["identifiable"] else "not determined"
    expect(page.locator("#modulus-value")).to_have_text(shown)
    expect(page.locator("#simulated-badge")).to_be_visible()


@pytest.mark.long
@pytest.mark.usefixtures("same_answer_in_every_mode")
def test_the_operator_chooses_between_speed_and_accuracy(page: Page, probe: Served):
    """Every mode with what it costs; a slow ramp is led by its open forces, and the result says how it was taken."""
    page.goto(probe.url)
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    _press_freely(page)
    modes = page.locator("#modes label")
    expect(modes).to_have_count(4)
    expect(page.locator("#modes input:checked")).to_have_value("standard")
    expect(modes.nth(0)).to_have_text("Quickunder 1 shalf: size ±5 %, depth ±7 %answers 90 %")
    expect(modes.nth(2)).to_have_text("Preciseabout 10–19 shalf: size ±3 %, depth ±2 %answers 90 %")
    expect(modes.nth(3)).to_have_text("Paperabout 1 serror not stated")
    expect(page.locator("#force-band-text")).to_have_text("slowly from 0.08 to 0.60 N")
    modes.nth(0).click()
    expect(page.locator("#instruction")).to_have_text("Press beside the lesion")
    expect(page.locator("#force-band-text")).to_have_text("target 0.475 to 0.525 N")
    expect(page.locator("#frames")).to_have_text("0 of 1 images")
    shoot(page, "modes")
    _require_fits(page)
    modes.filter(has_text="paper").click()
    modes.filter(has_text="standard").click()
    page.locator("#press-button").click()
    expect(page.locator("#modes")).to_be_hidden()
    expect(page.locator("#instruction")).to_have_text("Press slowly harder")
    wanted = page.locator("#force-wanted span")
    expect(page.locator("#frames")).to_have_text(re.compile("[3-7] of 10 images"))
    expect(page.locator("#press-state")).to_have_text("taking images")
    assert 0 < wanted.count() < 10
    shoot(page, "ramp")
    _require_fits(page)
    probe.hand.go_on()
    expect(wanted).to_have_count(0)
    expect(page.locator("#size-value")).to_be_visible()
    expect(page.locator("#image-title")).to_have_text("Measurement 1, Standard")
    expect(page.locator("#modes input:checked")).to_have_value("standard")
    expect(modes.nth(1)).to_contain_text(re.compile(r"Standard[67]\ss"))
    expect(page.locator("#size-interval")).to_have_text("9.6 – 14.4 mm")
    expect(page.locator("#depth-interval")).to_have_text("7.2 mm or less")
    expect(page.locator("#modulus-interval")).to_have_text("48 kPa or more")
    shoot(page, "result-standard")
    _require_fits(page)


@pytest.mark.long
@pytest.mark.usefixtures("narrowing_scan")
def test_the_operator_scans_reads_how_sure_it_is_after_each_press_and_says_when_it_is_enough(page: Page, probe: Served):
    """Asked for 1 mm, content with 1.3 mm: what cannot be had is not offered, and the result says what was reached."""
    page.goto(probe.url)
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    _press_freely(page)
    expect(page.locator("#until")).to_be_hidden()
    page.locator("#modes label").filter(has_text="precise").click()
    steps = page.locator("#until label")
    expect(steps).to_have_text(["possible", "± 1 mm8 of 10", "± 0.5 mm0.51 at best", "± 0.2 mm"])
    expect(steps.nth(2).locator("input")).to_be_disabled()
    expect(steps.nth(3).locator("input")).to_be_disabled()
    expect(page.locator("#status-reason")).to_have_text(
        "A scan: one press beside the lesion, then two to five on it. Below: how many in ten get that sure."
    )
    steps.nth(1).click()
    shoot(page, "scan-asked")
    _require_fits(page)
    page.locator("#press-button").click()
    probe.hand.go_on()
    expect(page.locator("#instruction")).to_have_text("Move about 4 mm to the side, touch again")
    expect(page.locator("#scan-count")).to_have_text("1 of at most 5 presses")
    values, told = page.locator("#scan .scan-value"), page.locator("#scan .scan-told")
    expect(values).to_have_text(["12.2 ± 2.6 mm", "6.1 ± 1.4 mm", "not known yet"])
    expect(told.nth(0)).to_have_text("next press: ± 1.3 mm asked: ± 1.0 mm")
    shoot(page, "scan-after-one-press")
    _require_fits(page)
    _require_whole_scan(page)
    probe.hand.go_aside(too_hard=True)
    expect(page.locator("#status-word")).to_have_text("That press does not count.")
    expect(page.locator("#status-reason")).to_contain_text("more than 1.00 N.")
    expect(page.locator("#instruction")).to_have_text("Move about 4 mm to the side, touch again")
    shoot(page, "scan-press-that-does-not-count")
    _require_fits(page)
    _require_whole_scan(page)
    probe.hand.go_aside()
    expect(page.locator("#instruction")).to_have_text("Press slowly harder")
    expect(page.locator("#status-reason")).to_have_text(
        re.compile(r"^Press 2 on the lesion: about 4\smm from its middle")
    )
    shoot(page, "scan-second-press")
    _require_fits(page)
    expect(page.locator("#scan-count")).to_have_text("2 of at most 5 presses")
    expect(values).to_have_text(["12.2 ± 1.3 mm", "6.1 ± 0.70 mm", "63 ± 17 kPa"])
    expect(page.locator('.scan-row[data-reached="true"]')).to_have_count(1)
    expect(page.locator("#instruction")).to_have_text("Move about 4 mm to the side, touch again")
    shoot(page, "scan-after-two-presses")
    _require_whole_scan(page)
    page.locator("#enough-button").click()
    expect(page.locator("#image-title")).to_have_text("Measurement 1, Precise")
    expect(page.locator("#status-reason")).to_contain_text("2 presses on the lesion. Not as sure as asked for.")
    expect(page.locator("#enough-button")).to_be_hidden()
    shoot(page, "scan-result")
    _require_fits(page)
    kept = probe.procedure.store.measurement(probe.procedure.board.now.measurement_id)
    assert (kept["ramps"], kept["frames"], kept["reached"]) == (2, 20, False)
    assert kept["until"] == {"size_mm": 1.0, "depth_mm": 1.0}


@pytest.mark.long
@pytest.mark.usefixtures("same_answer_in_every_mode")
@pytest.mark.parametrize("is_kept", [True, False])
def test_the_answer_is_on_the_screen_before_the_disk_has_it(
    page: Page, probe: Served, monkeypatch: pytest.MonkeyPatch, is_kept: bool
):
    """It is said to be of no measurement yet; what the disk refuses is not left standing as a result.

    What may be done with it waits in its place, so that no button comes under a finger that meant another.
    """
    disk_answers, add = threading.Event(), probe.procedure.store.add_measurement

    def add_when_the_disk_answers(record: Any, recording: Recording, **how: Any) -> Any:
        disk_answers.wait()
        if not is_kept:
            raise StorageError("The disk is full.", "Free space.")
        return add(record, recording, **how)

    monkeypatch.setattr(probe.procedure.store, "add_measurement", add_when_the_disk_answers)
    page.goto(probe.url)
    _press_freely(page)
    page.locator("#press-button").click()
    probe.hand.go_on()
    expect(page.locator("#size-interval")).to_have_text("9.6 – 14.4 mm")
    expect(page.locator("#size-value")).to_be_visible()
    expect(page.locator("#image-title")).to_have_text("Being kept, Standard")
    shoot(page, "result-being-kept")
    _require_fits(page)
    acts = page.locator(".acts button").filter(visible=True).all()
    places = [act.bounding_box() for act in acts]
    for act in acts:
        expect(act).to_be_disabled()
        act.click(force=True)
    expect(page.locator("dialog[open]")).to_have_count(0)
    expect(page.locator("#size-value")).to_be_visible()
    disk_answers.set()
    if is_kept:
        expect(page.locator("#image-title")).to_have_text("Measurement 1, Standard")
        for act in acts:
            expect(act).to_be_enabled()
        assert [act.bounding_box() for act in acts] == places
        expect(page.locator("#image")).to_have_js_property("complete", value=True)
        expect(page.locator("#size-value")).to_be_visible()
    else:
        expect(page.locator(".fault-code")).to_have_text("E601")
        expect(page.locator(".fault-remedy")).to_have_text("Its figures are lost. Restart the probe, then press again.")
        expect(page.locator("#size-value")).to_be_hidden()
        shoot(page, "result-not-kept")


@pytest.mark.long
@pytest.mark.usefixtures("no_numbers_in_any_mode")
@pytest.mark.parametrize(
    ("no_numbers_in_any_mode", "words"),
    [
        ((REASONS["misfit_ratio"], NO_NUMBERS), "note it without numbers."),
        (CAUSES["contrast"], "Wipe, press a little beside it"),
        (CAUSES["reference_response"], "have the probe commissioned again. Wipe, tare, begin beside it"),
        (CAUSES["first_harmonic"], "The probe was tilted, or one side's light has changed."),
        (CAUSES["second_harmonic"], "Turn by a quarter, press again"),
    ],
    ids=["none", *BLOCKS],
    indirect=["no_numbers_in_any_mode"],
)
def test_a_press_without_numbers_says_why_and_what_to_do(page: Page, probe: Served, words: str):
    """All four reasons at once are the longest there is: they fit above the tiles, without a figure."""
    page.goto(probe.url)
    _press_freely(page)
    page.locator("#press-button").click()
    expect(page.locator("#instruction")).to_have_text("Press slowly harder")
    probe.hand.go_on()
    expect(page.locator("#size-value")).to_have_text("not determined")
    expect(page.locator("#instruction")).to_have_text("No numbers")
    expect(page.locator("#status-reason")).to_contain_text(words)
    shoot(page, "result-without-numbers")
    _require_fits(page)
    cut = "tiles => tiles.filter(t => t.scrollHeight > t.clientHeight + 1).map(t => t.id)"
    assert page.locator(".tile").evaluate_all(cut) == []
    expect(page.locator(".gauge")).to_be_hidden()


@pytest.mark.long
def test_a_warning_is_amber_with_its_code_and_leaves_the_result_readable(page: Page, tmp_path: Path):
    """The wall clock is set forward in the middle of a press: the measurement stands, the operator is told."""
    scene = '[[faults]]\nkind = "clock_jump"\nstep_s = 3600.0\nfrom_press = 1\n' + QUICK_HAND
    daemon = Daemon(tmp_path, scene)
    page.goto(daemon.url)
    _press_freely(page)
    page.locator("#press-button").click()
    warning = page.locator('.fault[data-severity="warning"]')
    expect(warning.locator(".fault-code")).to_have_text("E701")
    expect(warning.locator(".fault-title")).to_have_text("The clock was set meanwhile")
    expect(warning.locator(".fault-code")).to_have_css("background-color", "rgb(122, 77, 0)")
    expect(page.locator("#size-value")).to_be_visible()
    expect(page.locator("#size-value")).to_have_text(re.compile(r"\d+\.\d mm"))
    shoot(page, "warning")
    _require_fits(page)
    daemon.stop()


@pytest.mark.long
def test_the_screen_says_when_the_daemon_is_gone_and_recovers(page: Page, tmp_path: Path):
    daemon = Daemon(tmp_path, QUICK_HAND)
    page.goto(daemon.url)
    expect(page.locator("#simulated-badge")).to_be_visible()
    expect(page.locator("#connection-lost")).to_be_hidden()
    daemon.stop()
    expect(page.locator("#connection-lost")).to_be_visible()
    shoot(page, "connection-lost")
    again = Daemon(tmp_path, QUICK_HAND, port=int(daemon.url.rpartition(":")[2]))
    expect(page.locator("#connection-lost")).to_be_hidden()
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    again.stop()


def test_a_fault_takes_the_view_with_its_code_and_title(page: Page, tmp_path: Path):
    daemon = Daemon(tmp_path, '[[faults]]\nkind = "i2c_stuck"\nfrom_press = 1\n')
    page.goto(daemon.url)
    _press_freely(page)
    page.locator("#press-button").click()
    fault = page.locator('.fault[data-severity="fault"]')
    expect(fault.locator(".fault-code")).to_have_text("E202")
    expect(fault.locator(".fault-title")).to_have_text("The light's line is stuck")
    expect(fault.locator(".fault-remedy")).to_contain_text("Switch the probe off and on.")
    expect(page.locator("#status-line")).not_to_contain_text("bus")
    shoot(page, "fault")
    _require_fits(page)
    daemon.stop()


def test_the_operator_tares_between_presses_and_reads_what_came_of_it(page: Page, tmp_path: Path):
    daemon = Daemon(tmp_path, "[hand]\nreaction_s = 1.0\n")
    page.goto(daemon.url)
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    _press_freely(page)
    page.locator("#tare").click()
    expect(page.locator("#status-line")).to_contain_text("Tared. The zero has moved by")
    _require_fits(page)
    page.locator("#press-button").click()
    expect(page.locator("#press-button")).to_have_text("Cancel")
    expect(page.locator("#footer")).to_have_js_property("inert", value=True)
    daemon.stop()


@pytest.mark.long
def test_the_operator_runs_the_self_test_and_reads_which_part_failed(page: Page, tmp_path: Path):
    """Two swapped plugs: the page says what to do, then names both, before all that is well."""
    scene = '[[faults]]\nkind = "led_swapped"\nside = "+x"\nother_side = "-x"\n[hand]\nreaction_s = 5.0\n'
    daemon = Daemon(tmp_path, scene)
    page.goto(daemon.url)
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    page.locator("#menu-open").click()
    page.locator("#self-test-open").click()
    line = page.locator("#self-test-line")
    expect(line).to_have_text("Not run since the probe was started.")
    page.locator("#self-test-block").check()
    page.locator("#self-test-run").click()
    expect(line).to_have_text("Hold the probe on the reference block")
    expect(page.locator("#self-test-run")).to_have_attribute("aria-disabled", "true")
    expect(line).to_have_text(re.compile(r"^2 of \d+ checks failed\.$"))
    failed = page.locator('.check[data-verdict="failed"]')
    expect(failed).to_have_count(2)
    expect(failed.nth(0)).to_contain_text("The LED lights side -x. Have service swap the plugs of +x and -x.")
    failed.nth(0).get_by_role("button", name="Details").click()
    expect(page.locator("#fault-list")).to_contain_text("It lights -x: put the plugs of +x and -x where they belong.")
    page.locator("#fault-close").click()
    assert page.locator(".check").first.get_attribute("data-verdict") == "failed"
    shoot(page, "self-test")
    _require_fits(page)
    keys = page.locator("#self-test-keys")
    expect(keys).to_be_hidden()
    page.locator("#self-test-weight").click()
    for key in ("9", ".", "Erase", "9"):  # the probe's panel has no keyboard
        keys.get_by_role("button", name=key, exact=True).click()
    expect(page.locator("#self-test-weight")).to_have_value("99")
    shoot(page, "self-test-keys")
    _require_fits(page)
    page.locator("#self-test-run").click()
    expect(line).to_contain_text("Take another weight: between 0.1 and 5 N")
    page.locator("#self-test-close").click()
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    page.locator("#menu-open").click()
    page.locator("#language-de").click()
    page.locator("#menu-open").click()
    page.locator("#self-test-open").click()
    expect(line).to_have_text(re.compile(r"^2 von \d+ Prüfungen nicht bestanden\.$"))
    expect(failed.nth(0)).to_contain_text("Die LED beleuchtet Seite -x. Den Service die Stecker von +x und -x tauschen")
    said = page.locator("#self-test-results").inner_text()
    assert re.search(r"freier Platz\s+Speicher\s+bestanden\s+\d+ MB, nötig: mindestens 50 MB", said), said
    assert not re.search(r"check\.|remedy\.|unit\.|bound\.|at least|at most", said), said
    shoot(page, "self-test-de")
    _require_fits(page)
    page.evaluate("localStorage.clear()")
    daemon.stop()


def test_the_operator_reads_which_software_runs_and_gives_the_probe_a_release_from_a_stick(
    page: Page, probe: Served, tmp_path: Path
):
    """Another file is refused in words; the release is handed over whole; how far it is, is on both views."""
    page.goto(probe.url)
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    page.locator("#menu-open").click()
    page.locator("#releases-open").click()
    expect(page.locator("#release-running")).to_have_text("0.1.0+400")
    expect(page.locator("#release-previous")).to_have_text("0.0.9+390")
    holiday, release = tmp_path / "holiday.jpg", tmp_path / "tsis-0.2.0-x86_64.release"
    holiday.write_bytes(b"\xff\xd8" * 1000)
    release.write_bytes(tar({"manifest.json": b'{"product": "tsis"}'}))
    page.locator("#release-file").set_input_files(holiday)
    expect(page.locator("#releases-line")).to_contain_text("holiday.jpg is no release file")
    shoot(page, "software")
    _require_fits(page)
    page.locator("#release-file").set_input_files(release)
    handed = probe.updates / "incoming" / "update.release"
    wait_for(handed.exists, bool)
    assert handed.read_bytes() == release.read_bytes()
    expect(page.locator("#releases-line")).to_have_text("A release is being installed.")
    handed.unlink()
    probe.updater_says(state="unpacking", release="0.2.0+412", progress=0.42, step="unpacking numpy")
    expect(page.locator("#releases-line")).to_have_text("Version 0.2.0 is being installed.")
    expect(page.locator("#release-progress")).to_have_js_property("value", 0.42)
    expect(page.locator("#release-file")).to_be_disabled()
    shoot(page, "software-update")
    _require_fits(page)
    page.locator("#releases-close").click()
    expect(page.locator("#status-line")).to_have_text("Version 0.2.0 is being installed. Now: unpacking, 42 %.")
    probe.updater_says(state="rolled_back", release="0.2.0+412", progress=1.0, reason="camera gave no image")
    expect(page.locator("#status-line")).not_to_contain_text("being installed")
    page.locator("#menu-open").click()
    page.locator("#releases-open").click()
    words = "Version 0.2.0 did not work. This probe went back to 0.1.0."
    expect(page.locator("#releases-line")).to_have_text(words)
    page.locator("#release-why").click()
    expect(page.locator("#fault-list")).to_contain_text("camera gave no image")
    page.locator("#fault-close").click()
    page.locator("#release-back").click()
    wait_for((probe.updates / "incoming" / "roll_back").exists, bool)


def test_an_update_that_was_taken_back_is_a_lasting_warning_that_leaves_the_view_readable(page: Page, tmp_path: Path):
    folder = tmp_path / "updates"
    (folder / "incoming").mkdir(parents=True)
    told = {"state": "rolled_back", "release": "0.2.0+412", "reason": "camera gave no image"}
    (folder / "progress.json").write_text(json.dumps(told))
    daemon = Daemon(tmp_path, f'[settings]\nupdates = "{folder}"\n' + PATIENT)
    page.goto(daemon.url)
    expect(page.locator("#instruction")).to_have_text(BEGINNING)
    warning = page.locator('.fault[data-severity="warning"]')
    expect(warning.locator(".fault-code")).to_have_text("E013")
    expect(warning.locator(".fault-title")).to_have_text("Update taken back")
    shoot(page, "update-taken-back")
    _require_fits(page)
    assert daemon.ask("/api/v1/updates").json["outcome"].startswith("Version 0.2.0 did not work")
    (folder / "progress.json").write_text(json.dumps(told | {"state": "switching", "release": "0.3.0+420"}))
    expect(page.locator("#status-line")).to_contain_text("Version 0.3.0 is being installed")
    daemon.stop()
    expect(page.locator("#connection-lost")).to_be_visible()
    expect(page.locator("#lost-title")).to_have_text("The probe is being updated")
    shoot(page, "being-updated")
