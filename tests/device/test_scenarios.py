"""Every fault that a scenario injects is raised by its code, or found by the self-test; after it the device is ready.

The daemon's whole procedure on emulated chips in simulated time, and in two fifths of it, for fewer frames to render:
hand and time limits are as much faster as the faults are shorter, the camera a third. A camera's process that hangs or
dies is a process: those two are in real time, and their fault ends when the test has seen what it waits for.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
from daemon_process import ROOT, wait_for
from simulated_time import SimulatedTime
from simulated_time_probe import simulate_time

from device.assembly import probe as assembly
from device.assembly.opened_parts import StartFailed
from device.assembly.probe import open_simulated_probe
from device.config import CameraSection, LightSection, PressSection, simulated_config
from device.errors import (
    CameraProcessError,
    DeviceError,
    LightBudgetError,
    LightRestError,
    MissingCalibration,
    SlowCellError,
    StalledError,
    ZeroShiftError,
)
from device.files.recording_file import read_recording
from device.files.toml_record import from_table
from device.instrument import procedure
from device.instrument.acquisition import bench, force_recorder
from device.instrument.acquisition.light_check import level_counts
from device.instrument.procedure import Procedure
from device.instrument.self_test import run as self_test_run
from device.instrument.watch import watchdog
from device.instrument.watch.restart_note import RestartNote
from device.instrument.watch.watchdog import Watchdog
from device.measurement.mode import Mode
from device.measurement.quantities import Inclusion
from device.measurement.recording.recording import Recording
from device.records.store import ENDED
from device.settings.layers import overridden
from device.simulation.faults import PARAMETERS, FaultTimeline, ScriptedFault
from device.simulation.hand import HandSettings
from device.simulation.physics.sensor import Sensor
from device.simulation.scenario import Scenario, read_scenario

FILES = [path for path in sorted((ROOT / "scenarios").glob("*.toml")) if read_scenario(path).expects]
OF_A_PROCESS = [path for path in FILES if read_scenario(path).expects == CameraProcessError.code]
SELF_TEST_FILES = [path for path in sorted((ROOT / "scenarios").glob("*.toml")) if read_scenario(path).self_test_fails]
TIME_RATIO, FROZEN_TIME_RATIO = 0.4, 0.2
"""A frozen part is waited for only: the watchdog's time and the scene's can shrink together beyond what a hand does."""
QUICK_HAND = HandSettings(rate_n_per_s=1.5, ramp_rate_n_per_s=0.4, reaction_s=0.05)
QUICK_PRESS = PressSection(max_rate_n_per_s=0.6)
LONGEST_WAIT_S = 20.0
BY_A_PRESS_ALONE = (LightBudgetError.code, LightRestError.code)


class Device:
    """A simulated probe that runs, and what it has said so far."""

    def __init__(self, procedure: Procedure, clock: SimulatedTime) -> None:
        self.procedure, self.board, self._clock = procedure, procedure.board, clock

    def codes(self) -> set[str]:
        """Codes of fault, press and warnings that are shown now."""
        status = self.board.now
        shown = [fault.code for fault in (status.fault, status.stall, *status.warnings) if fault]
        if status.press:
            shown += [warning["code"] for warning in status.press.warnings]
            shown += [status.press.code] if status.press.code else []
        return set(shown)

    def until(self, condition: Callable[[], bool]) -> None:
        assert self._clock.wait(condition, LONGEST_WAIT_S), (self.board.now, self.codes())

    def is_ready(self) -> bool:
        return self.board.now.step != "starting" and self.board.now.hindrance is None

    def has_ended(self, press_id: str) -> bool:
        press = self.board.now.press
        return press is not None and press.id == press_id and press.state in ENDED

    def failed_checks(self, weight_n: float | None = None) -> dict[str, str]:
        """Run the self-test on the block; return the checks that failed, each with its part."""
        self.procedure.request_self_test(on_block=True, weight_n=weight_n)
        self.until(lambda: not self.procedure.self_test.is_under_way)
        assert self.procedure.self_test.state == "done"
        return {one.check: one.part for one in self.procedure.self_test.results if one.verdict == "failed"}

    def press(self, mode: Mode | None = None) -> None:
        self.until(self.is_ready)
        job = self.procedure.request(mode)
        self.until(lambda: self.has_ended(job.id) or self.board.now.hindrance is not None)


class RealTimeDevice(Device):
    """The same, looked at from outside while it runs."""

    def __init__(self, procedure: Procedure) -> None:
        self.procedure, self.board = procedure, procedure.board

    def until(self, condition: Callable[[], bool]) -> None:
        wait_for(lambda: (condition(), self.board.now, self.codes()), lambda seen: seen[0])


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., object]:
    monkeypatch.setattr(bench, "FRAME_TIMEOUT_S", TIME_RATIO * bench.FRAME_TIMEOUT_S)
    monkeypatch.setattr(force_recorder, "SILENCE_S", TIME_RATIO * force_recorder.SILENCE_S)
    monkeypatch.setattr(procedure, "AFTER_FAULT_S", 0.1)
    monkeypatch.setattr(self_test_run, "FREE_TIMEOUT_S", 2.0)
    monkeypatch.chdir(ROOT)  # a scene's settings name files from there
    watchdog_s, clock = watchdog.WITHOUT_SYSTEMD_S, simulate_time(monkeypatch)
    camera = CameraSection(frame_rate_hz=40.0)
    config = replace(simulated_config(), data=tmp_path, camera=camera, press=QUICK_PRESS)

    @contextmanager
    def run(scenario: Scenario, **settings: object) -> Iterator[Device]:
        ratio = FROZEN_TIME_RATIO if scenario.expects == StalledError.code else TIME_RATIO
        monkeypatch.setattr(watchdog, "WITHOUT_SYSTEMD_S", ratio * watchdog_s)
        faults = tuple(
            replace(fault, from_s=ratio * fault.from_s, until_s=ratio * fault.until_s) for fault in scenario.faults
        )
        own = {"serial": scenario.serial, "calibration": simulated_config(scenario.serial).calibration}
        hand = replace(QUICK_HAND, tremor_n=scenario.hand.tremor_n, held_n=scenario.hand.held_n)
        quick = replace(scenario, hand=hand, faults=faults)
        opened = open_simulated_probe(overridden(replace(config, **(own | settings)), scenario.settings), quick)
        opened.start()
        watching = Watchdog(opened.progress, opened.board, RestartNote(tmp_path))
        watching.start()
        try:
            yield Device(opened, clock)
        finally:
            watching.close()
            opened.close()

    return run


@pytest.mark.parametrize("path", [one for one in FILES if one not in OF_A_PROCESS], ids=lambda path: path.stem)
def test_the_fault_of_a_scenario_is_raised_by_its_code_and_the_device_recovers(path, running):
    scenario = read_scenario(path)
    try:
        with running(scenario) as device:
            provoke(device, scenario)
            if passes(scenario):
                device.until(device.is_ready)
                device.procedure.require_ready()
    except StartFailed as refusal:
        assert [fault.code for fault in refusal.faults] == [scenario.expects]  # noqa: PT017 - else it has started


@pytest.mark.parametrize("path", OF_A_PROCESS, ids=lambda path: path.stem)
@pytest.mark.long
def test_a_camera_whose_process_hangs_or_dies_is_at_fault_until_it_does_so_no_more(path, tmp_path, monkeypatch):
    """The fault's own clock stands until its code is shown; then the fault is over."""
    fault_s, timeline = [0.0], partial(FaultTimeline, clock=lambda: fault_s[0])
    monkeypatch.setattr(assembly, "FaultTimeline", timeline)
    scenario = read_scenario(path)
    camera = CameraSection(frame_rate_hz=60.0, late_frames=100.0)
    config = replace(simulated_config(), data=tmp_path, camera=camera, press=QUICK_PRESS)
    opened = open_simulated_probe(config, replace(scenario, hand=QUICK_HAND))
    device = RealTimeDevice(opened)
    opened.start()
    try:
        device.until(device.is_ready)
        device.procedure.request()
        device.until(lambda: scenario.expects in device.codes())
        fault_s[0] = 1e3
        device.until(device.is_ready)
        device.procedure.require_ready()
    finally:
        opened.close()


def provoke(device: Device, scenario: Scenario) -> None:
    """Press as often as the scenario needs, while nothing hinders it, until its code is shown."""
    at_least = 1 if scenario.expects in BY_A_PRESS_ALONE else 0
    for _ in range(max((fault.from_press for fault in scenario.faults), default=at_least)):
        device.until(lambda: device.is_ready() or scenario.expects in device.codes())
        if device.is_ready():
            device.press()
    device.until(lambda: scenario.expects in device.codes())


def passes(scenario: Scenario) -> bool:
    """Return whether the probe is ready after it: a warning hinders nothing, a hand that holds it lifts."""
    if DeviceError.by_code[scenario.expects].severity == "warning" or scenario.hand.held_n:
        return True
    ends = all(fault.until_s < float("inf") for fault in scenario.faults)
    return ends and scenario.expects not in (MissingCalibration.code, ZeroShiftError.code, SlowCellError.code)


@pytest.mark.parametrize("path", SELF_TEST_FILES, ids=lambda path: path.stem)
def test_the_self_test_names_the_part_that_a_scenario_breaks_and_no_other(path, running):
    scenario = read_scenario(path)
    with running(scenario) as device:
        if any(fault.from_press for fault in scenario.faults):
            device.press()
        failed = device.failed_checks()
    assert scenario.self_test_fails in failed
    assert len(set(failed.values())) == 1


def test_a_model_that_is_tampered_with_while_the_probe_runs_is_named_by_the_self_test(running):
    """What is in use was read before; the next start would be refused."""
    with running(Scenario(faults=(ScriptedFault("bundle_tampered", from_press=1),))) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.failed_checks() == {f"model {name}": "Model" for name in ("paper", "quick", "standard")}


def test_the_self_test_of_a_sound_probe_passes_and_presses_go_on(running):
    """The virtual hand holds tissue for the block and its aim, 0.5 N, for the weight."""
    with running(Scenario()) as device:
        assert device.failed_checks(weight_n=0.5) == {}
        verdicts = {result.check: result.verdict for result in device.procedure.self_test.results}
        del verdicts["time server"]  # of this machine
        assert verdicts.pop("enable line") == "not_tested"
        assert set(verdicts.values()) == {"passed"}
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_a_probe_without_a_fault_raises_none(running):
    with running(Scenario()) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_a_probe_that_was_never_calibrated_runs_and_takes_no_press(running):
    with running(read_scenario(ROOT / "scenarios" / "calibration_missing.toml")) as device:
        device.until(lambda: "E402" in device.codes())
        with pytest.raises(MissingCalibration, match="no certificate is active"):
            device.procedure.request()


def test_a_supply_that_was_low_for_half_a_second_of_a_press_is_told_by_that_press_and_its_measurement_alone(running):
    dip = Scenario(faults=(ScriptedFault("undervoltage", from_press=1, from_s=1.0, until_s=2.5),))
    with running(dip) as device:
        told = []
        for _ in range(2):
            device.press("quick")
            press = device.board.now.press
            assert press.state == "done"
            measurement = device.procedure.store.measurement(press.measurement_id)
            told.append([[one["code"] for one in record["warnings"]] for record in (vars(press), measurement)])
    assert told == [[["E015"], ["E015"]], [[], []]]


def test_every_kind_of_fault_has_a_scenario():
    assert {fault.kind for path in (ROOT / "scenarios").glob("*.toml") for fault in read_scenario(path).faults} == set(
        PARAMETERS
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_scenario_begins_with_a_sentence_and_expects_a_code_that_exists(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert text.splitlines()[0].endswith(".")
    assert tomllib.loads(text)["expects"] in DeviceError.by_code


def test_the_document_lists_every_scenario_with_its_code():
    page = (ROOT / "docs" / "simulated_probe.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| \[`(\w+)`\]\(\.\./scenarios/\w+\.toml\).*? \|.*?\| (E\d+)", page, re.MULTILINE)
    assert dict(listed) == {path.stem: read_scenario(path).expects for path in FILES}


def test_the_page_of_the_self_test_lists_every_scenario_that_must_fail_it():
    page = (ROOT / "docs" / "self_test.md").read_text(encoding="utf-8")
    for path in SELF_TEST_FILES:
        [row] = [line for line in page.splitlines() if line.startswith(f"| [`{path.stem}`]")]
        assert read_scenario(path).self_test_fails.partition(" after ")[0] in row.split("|")[3]


def test_the_fault_in_the_document_is_one():
    page = (ROOT / "docs" / "simulated_probe.md").read_text(encoding="utf-8")
    [example] = [text for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[faults]]" in text]
    assert from_table(Scenario, tomllib.loads(example)).faults == (ScriptedFault("led_dead", 0.0, 4.0, 1, "+x"),)


def test_a_probe_with_the_other_led_chip_measures_without_a_fault(running):
    """Six periods of the PCA9685 are 3932 us."""
    pca9685 = {"light": LightSection(chip="pca9685"), "camera": CameraSection(frame_rate_hz=60.0, exposure_us=3932)}
    with running(Scenario(), **pca9685) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_an_inclusion_that_cannot_be_seen_gets_no_number(running):
    """0.5 mm, 10 mm deep: its contrast is a thousandth of the camera's noise."""
    with running(Scenario(inclusion=Inclusion(0.5, 10.0, 80.0))) as device:
        device.press()
        estimate = device.procedure.store.measurement(device.board.now.press.measurement_id)["estimate"]
    # No contrast, or, when the two presses differ by a hundredth of the force, a contrast that no inclusion has.
    assert estimate["status"] in ("not_identifiable", "outside_range")
    assert estimate["size_mm"]["value"] is None


def test_a_hand_that_trembles_is_rejected_with_the_reason_and_no_fault(running):
    trembling = read_scenario(ROOT / "scenarios" / "hand_trembling.toml")
    with running(trembling, press=replace(QUICK_PRESS, timeout_s=3.0)) as device:
        device.press()
        press = device.board.now.press
        assert (press.state, press.code) == ("rejected", None)
        assert "was not steady" in press.reason
        assert device.codes() == set()


def test_a_probe_with_a_larger_sensor_of_ten_bits_measures_without_a_fault(running):
    """An OV9281: the middle of its 1280 x 800, scaled down to a frame."""
    camera = CameraSection(raw_format="R10", sensor_width_px=1280, sensor_height_px=800, crop_width_px=1070)
    with running(Scenario(sensor=Sensor(bits=10)), camera=camera) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_light_that_is_lost_between_two_presses_is_back_in_the_third_and_the_same_in_both_parts_of_each(running):
    """Three tenths are lost before the second press; the level is that of the first press, 61 counts."""
    dimmed = Scenario(faults=(ScriptedFault("led_dimmed", ratio=0.7, from_press=2),))
    with running(dimmed, light=LightSection(target_counts=61.0)) as device:
        presses = [recorded(device) for _ in range(3)]
        assert "E206" in device.codes()
    levels = [reference_counts(press) for press in presses]
    assert levels == pytest.approx([61.0, 0.7 * 61.0, 61.0], rel=0.03)
    lit = [{frame.led_ratio for frame in press.frames if frame.role != "dark"} for press in presses]
    assert [len(ratios) for ratios in lit] == [1, 1, 1]
    assert lit[2].pop() == pytest.approx([0.6 / 0.7] * 4, rel=0.03)


def recorded(device: Device) -> Recording:
    device.press("paper")
    store, press = device.procedure.store, device.board.now.press
    return read_recording(store.recording_path(store.measurement(press.measurement_id)["recording_id"]))


def reference_counts(press: Recording) -> float:
    """Mean counts above dark of the reference press at the target force, light taken as proportional to the force."""
    dark = level_counts(press.with_role("dark")[-1])
    held = [frame for frame in press.with_role("reference") if frame.force_n > 0.4]
    return sum((level_counts(frame) - dark) * 0.5 / frame.force_n for frame in held) / len(held)
