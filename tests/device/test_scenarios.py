"""Every fault that a scenario injects is raised by its code, and where the fault ends, the device is ready again.

The daemon's whole procedure on emulated chips, in two fifths of the time: hand, camera and time limits are as much
faster as the faults are shorter.
"""

from __future__ import annotations

import re
import threading
import tomllib
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest
from daemon_process import ROOT

from device import errors
from device.assembly import open_simulated_probe
from device.config import CameraSection, LightSection, PressSection, simulated_config
from device.errors import DeviceError
from device.instrument import bench, force_recorder, procedure
from device.instrument.procedure import Procedure
from device.measurement.toml_record import from_table
from device.records.store import ENDED
from device.simulation.faults import PARAMETERS, Fault
from device.simulation.hand import HandSettings
from device.simulation.scenario import Scenario, read_scenario
from device.simulation.sensor import Sensor

FILES = [path for path in sorted((ROOT / "scenarios").glob("*.toml")) if read_scenario(path).expects]
TIME_RATIO = 0.4
QUICK_HAND = HandSettings(rate_n_per_s=1.5, ramp_rate_n_per_s=0.4, reaction_s=0.05)
QUICK_PRESS = PressSection(max_rate_n_per_s=0.6)
LONGEST_WAIT_S = 20.0


class Device:
    """A simulated probe that runs, and what it has said so far."""

    def __init__(self, procedure: Procedure) -> None:
        self.procedure, self.board = procedure, procedure.board
        self._pause = threading.Event()

    def codes(self) -> set[str]:
        """Codes of fault, press and warnings that are shown now."""
        status = self.board.now
        shown = [fault.code for fault in (status.fault, *status.warnings) if fault]
        if status.press:
            shown += [warning["code"] for warning in status.press.warnings]
            shown += [status.press.code] if status.press.code else []
        return set(shown)

    def until(self, condition: Callable[[], bool]) -> None:
        tries = round(LONGEST_WAIT_S / 0.01)
        assert any(condition() or self._pause.wait(0.01) for _ in range(tries)), (self.board.now, self.codes())

    def is_ready(self) -> bool:
        return self.board.now.step != "starting" and self.board.now.fault is None

    def has_ended(self, press_id: str) -> bool:
        press = self.board.now.press
        return press is not None and press.id == press_id and press.state in ENDED

    def press(self) -> None:
        self.until(self.is_ready)
        job = self.procedure.request()
        self.until(lambda: self.has_ended(job.id) or self.board.now.fault is not None)


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., object]:
    monkeypatch.setattr(bench, "FRAME_TIMEOUT_S", TIME_RATIO * bench.FRAME_TIMEOUT_S)
    monkeypatch.setattr(force_recorder, "SILENCE_S", TIME_RATIO * force_recorder.SILENCE_S)
    monkeypatch.setattr(procedure, "AFTER_FAULT_S", 0.1)
    camera = CameraSection(frame_rate_hz=60.0)
    config = replace(simulated_config(), data=tmp_path, camera=camera, press=QUICK_PRESS)

    @contextmanager
    def run(scenario: Scenario, **settings: object) -> Iterator[Device]:
        faults = tuple(
            replace(fault, from_s=TIME_RATIO * fault.from_s, until_s=TIME_RATIO * fault.until_s)
            for fault in scenario.faults
        )
        opened = open_simulated_probe(replace(config, **settings), replace(scenario, hand=QUICK_HAND, faults=faults))
        opened.start()
        try:
            yield Device(opened)
        finally:
            opened.close()

    return run


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_fault_of_a_scenario_is_raised_by_its_code_and_the_device_recovers(path, running):
    scenario = read_scenario(path)
    with running(scenario) as device:
        for _ in range(max(fault.from_press for fault in scenario.faults)):
            device.press()
        device.until(lambda: scenario.expects in device.codes())
        if all(fault.until_s < float("inf") for fault in scenario.faults):
            device.until(lambda: device.board.now.step == "ready")
            device.procedure.require_ready()


def test_a_probe_without_a_fault_raises_none(running):
    with running(Scenario()) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_every_kind_of_fault_has_a_scenario():
    assert {fault.kind for path in FILES for fault in read_scenario(path).faults} == set(PARAMETERS)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_scenario_begins_with_a_sentence_and_expects_a_code_that_exists(path):
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# ")
    assert text.splitlines()[0].endswith(".")
    known = {kind.code for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, DeviceError)}
    assert tomllib.loads(text)["expects"] in known


def test_no_two_faults_share_a_code():
    kinds = [kind for kind in vars(errors).values() if isinstance(kind, type) and issubclass(kind, DeviceError)]
    assert len({kind.code for kind in kinds}) == len(kinds)


def test_the_document_lists_every_scenario_with_its_code():
    page = (ROOT / "docs" / "simulated_probe.md").read_text(encoding="utf-8")
    listed = re.findall(r"^\| \[`(\w+)`\]\(\.\./scenarios/\w+\.toml\) \|.*?\| (E\d+)", page, re.MULTILINE)
    assert dict(listed) == {path.stem: read_scenario(path).expects for path in FILES}


def test_the_fault_in_the_document_is_one():
    page = (ROOT / "docs" / "simulated_probe.md").read_text(encoding="utf-8")
    [example] = [text for text in re.findall(r"```toml\n(.*?)```", page, re.DOTALL) if "[[faults]]" in text]
    assert from_table(Scenario, tomllib.loads(example)).faults == (Fault("led_dead", 0.0, 4.0, 1, "+x"),)


def test_a_probe_with_the_other_led_chip_measures_without_a_fault(running):
    """Six periods of the PCA9685 are 3932 us."""
    pca9685 = {"light": LightSection(chip="pca9685"), "camera": CameraSection(frame_rate_hz=60.0, exposure_us=3932)}
    with running(Scenario(), **pca9685) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_a_probe_with_a_larger_sensor_of_ten_bits_measures_without_a_fault(running):
    """An OV9281: the middle of its 1280 x 800, scaled down to a frame."""
    camera = CameraSection(raw_format="R10", sensor_width_px=1280, sensor_height_px=800, crop_width_px=1070)
    with running(Scenario(sensor=Sensor(bits=10)), camera=camera) as device:
        device.press()
        assert device.board.now.press.state == "done"
        assert device.codes() == set()


def test_light_that_is_on_for_too_long_goes_off_with_a_fault_and_the_device_recovers(running):
    """A press of ramps lights the probe for longer than a second."""
    with running(Scenario(), light=LightSection(max_on_s=1.0)) as device:
        device.press()
        device.until(lambda: device.board.now.step == "ready")
        assert device.board.now.press.code == "E209"
        assert device.board.now.press.light_on_s >= 1.0  # to a tenth
