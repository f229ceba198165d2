"""Every check runs, whatever the one before found; the operator is told what to do, and is waited for."""

import threading
import types
from dataclasses import replace

import numpy as np
import pytest

from device.config import CameraSection, Config, LightSection, simulated_config
from device.errors import CameraError, LightError, LightLineError, LoadCellError
from device.hardware.interfaces import CameraFrame
from device.instrument.acquisition.bench import DARK
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press.states import Guidance
from device.instrument.self_test import run as operator_module
from device.instrument.self_test import run as run_module
from device.instrument.self_test.report import SelfTestJob
from device.instrument.self_test.run import SelfTestRun
from device.instrument.status import StatusBoard
from device.instrument.watch.progress import ProgressBoard
from device.measurement.recording.led_sides import SIDES
from device.measurement.recording.tactile_image import Frame
from device.records.store import Store

CONFIG = replace(simulated_config(), light=LightSection(ratio=(0.1, 0.2, 0.3, 0.4), enable_line=17))
ON_BLOCK = SelfTestJob("j", "2026-01-01T00:00:00Z", on_block=True, weight_n=1.0)
ON_THE_BLOCK = {*(f"LED {side}" for side in SIDES), "flat field"}
NOBODY = {Guidance.HOLD_BLOCK: 0.0, Guidance.PUT_WEIGHT: 0.0}


class PatientBench:
    """A bench whose operator does at once what the board says: `forces_n` by guidance, in N. Time does not pass.

    Each side lights its own half, a third brighter than the other. `break_at` are raised by the part that is named.
    """

    def __init__(self, board):
        self.board, self.force, self.zero_shift_n = board, self, 0.01
        self.forces_n = {Guidance.HOLD_BLOCK: 0.5, Guidance.HOLD_STILL: 0.5, Guidance.PUT_WEIGHT: 1.0}
        self.break_at, self.lights, self.now_s = {}, [], 0.0
        self.presses, self.second_press = [], 1.0
        board.on_guidance(lambda guidance: self.presses.append(guidance) if guidance == Guidance.HOLD_BLOCK else None)
        self.budget = LightBudget(clock=lambda: self.now_s)
        self.progress, self.has_shown_its_line = ProgressBoard(lambda: self.now_s), True

    def _at(self, part):
        if part in self.break_at:
            raise self.break_at[part]

    @property
    def latest_n(self):
        self._at("force")
        return self.forces_n.get(self.board.now.guidance, 0.0)

    def mean_n(self, *, window_s):
        return self.latest_n

    def range_n(self, t_s, *, window_s):
        return 0.0

    def light(self, ratio):
        self._at("light")
        self.lights.append(ratio)

    def check_lights(self):
        self._at("circuits")
        self.lights.append(DARK)

    def check_line(self):
        self._at("line")
        return self.has_shown_its_line

    def expose(self):
        self._at("camera")
        y, x = np.mgrid[-1:1:40j, -1:1:60j]
        light = sum(ratio * (1 + 0.4 * way) for ratio, way in zip(self.lights[-1], (x, y, -x, -y), strict=True))
        light = light * (self.second_press if len(self.presses) > 1 else 1.0)
        return CameraFrame(np.rint(4 + 200 * light * np.ones((40, 60))).astype(np.uint8), 0.0, 4000.0, 1.0)

    def take(self, role):
        return Frame(self.expose().counts, role, 0.0, self.latest_n, self.lights[-1])

    def pass_time(self, seconds):
        self.now_s += seconds


@pytest.fixture
def board():
    return StatusBoard()


@pytest.fixture
def bench(board, monkeypatch):
    bench = PatientBench(board)
    clock = types.SimpleNamespace(monotonic=lambda: bench.now_s, sleep=bench.pass_time)
    monkeypatch.setattr(run_module, "time", clock)
    monkeypatch.setattr(operator_module, "time", clock)
    return bench


@pytest.fixture
def test_of(board, bench, tmp_path):
    """Return the results of a job by check, under settings."""
    store = Store(tmp_path)
    clock = types.SimpleNamespace(offset_s=100.0, now=lambda: "2026-01-01T00:00:00Z")

    def run(job=ON_BLOCK, config: Config = CONFIG, flat_field_ratio=0.002):
        test = SelfTestRun(config, bench, store, clock, board, threading.Event(), flat_field_ratio=flat_field_ratio)
        return {result.check: result for results in test.results(job) for result in results}

    yield run
    store.close()


def failed(results):
    return {check: result.part for check, result in results.items() if result.verdict == "failed"}


def untested(results):
    return {check for check, result in results.items() if result.verdict == "not_tested"} - {"time server"}


def test_a_sound_probe_passes_every_check_and_is_left_dark(test_of, bench):
    results = test_of()
    assert failed(results) == {}
    assert untested(results) == set()
    assert bench.lights[-1] == DARK


def test_each_side_is_lit_alone_at_its_own_brightness(test_of, bench):
    test_of()
    alone = [ratio for ratio in bench.lights if any(ratio) and not all(ratio)]
    assert alone == [(0.1, 0, 0, 0), (0, 0.2, 0, 0), (0, 0, 0.3, 0), (0, 0, 0, 0.4)]


def test_without_block_and_weight_the_operator_is_asked_for_nothing_but_to_stay_away(test_of, board):
    told = []
    board.on_guidance(told.append)
    results = test_of(replace(ON_BLOCK, on_block=False, weight_n=None))
    assert told == [Guidance.KEEP_FREE]
    assert untested(results) == {"known weight", *ON_THE_BLOCK}
    assert failed(results) == {}


def test_an_operator_who_does_not_come_leaves_checks_untested(test_of, bench):
    bench.forces_n = NOBODY
    results = test_of()
    assert untested(results) == {"known weight", *ON_THE_BLOCK}
    assert "within 30 s" in results["known weight"].remedy
    assert "within 30 s" in results["LED +x"].remedy


def test_sides_are_not_judged_at_a_force_that_tells_nothing(test_of, bench):
    """0.7 of the target, 0.35 N, it must be."""
    bench.forces_n[Guidance.HOLD_STILL] = 0.34
    assert untested(test_of()) == {f"LED {side}" for side in SIDES}


def test_a_wrong_weight_fails(test_of, bench):
    bench.forces_n[Guidance.PUT_WEIGHT] = 1.03
    results = test_of()
    assert failed(results) == {"known weight": "Load cell"}
    assert results["known weight"].value == 1.03


def test_after_a_wrong_zero_no_force_is_believed(test_of, bench):
    bench.zero_shift_n = 0.3
    results = test_of()
    assert failed(results) == {"zero since commissioning": "Load cell"}
    assert untested(results) == {"known weight", *ON_THE_BLOCK}


def test_two_presses_on_the_block_that_differ_smoothly_fail_and_say_by_how_much(test_of, bench):
    """A spot of 2 % that the second press does not have; twice 0.2 % of the light may differ."""
    y, x = np.mgrid[-1:1:40j, -1:1:60j]
    bench.second_press = 1 - 0.02 * np.exp(-((x - 0.3) ** 2 + y**2) / 0.05)
    results = test_of()
    assert failed(results) == {"flat field": "Light"}
    found = results["flat field"]
    assert (found.value > 0.4, found.bound, found.unit) == (True, "at most 0.4 %", "%")
    assert "Wipe face and block" in found.remedy


def test_the_operator_is_asked_to_press_the_block_twice_and_nobody_comes_again(test_of, bench, board):
    told = []
    board.on_guidance(told.append)
    board.on_guidance(lambda guidance: bench.forces_n.update(NOBODY) if guidance == Guidance.LIFT else None)
    results = test_of(replace(ON_BLOCK, weight_n=None))
    assert [one for one in told if one != Guidance.HOLD_STILL] == [
        Guidance.KEEP_FREE,
        Guidance.HOLD_BLOCK,
        Guidance.LIFT,
        Guidance.HOLD_BLOCK,
        Guidance.LIFT,
    ]
    assert (untested(results), "within 30 s" in results["flat field"].remedy) == ({"known weight", "flat field"}, True)


def test_a_press_that_is_never_lifted_is_not_compared_with_itself(test_of, bench):
    bench.forces_n[Guidance.LIFT] = 0.5
    found = test_of()["flat field"]
    assert (found.verdict, found.remedy) == ("not_tested", "It was not lifted within 10 s: repeat it.")


def test_a_press_far_above_the_target_is_not_compared(test_of, bench, board):
    """0.6 N is the most; the sides are judged, and the block was first held as it should be."""
    heavy = {**bench.forces_n, Guidance.HOLD_BLOCK: 0.7, Guidance.HOLD_STILL: 0.7}
    board.on_guidance(lambda guidance: bench.forces_n.update(heavy) if guidance == Guidance.LIFT else None)
    found = test_of()["flat field"]
    assert (found.verdict, "within 30 s" in found.remedy) == ("not_tested", True)


def test_there_is_no_light_before_the_block_is_pressed_and_no_more_than_the_budget_allows(test_of, bench):
    bench.forces_n |= {Guidance.HOLD_BLOCK: 0.25}
    test_of()
    assert [ratio for ratio in bench.lights if any(ratio)] == []
    bench.forces_n |= {Guidance.HOLD_BLOCK: 0.4}  # on the way, and no further
    bench.budget = LightBudget(1.0, clock=lambda: bench.now_s)
    bench.light = lambda ratio: (bench.lights.append(ratio), bench.budget.note_lit() if any(ratio) else None)
    results = test_of()
    assert (results["LED sides"].code, bench.lights[-1]) == ("E209", DARK)
    assert bench.budget.on_s < 1.2


def test_a_wrong_zero_is_what_is_said_of_the_flat_field_too(test_of, bench):
    bench.zero_shift_n = 0.3
    results = test_of()
    assert results["flat field"].remedy == results["LED +x"].remedy


def test_a_fault_in_the_second_press_fails_the_flat_field_alone_and_ends_dark(test_of, bench, board):
    def break_second(guidance):
        if len(bench.presses) == 2:
            bench.break_at = {"camera": CameraError("No frame.", "Check it.")}

    board.on_guidance(break_second)
    assert failed(test_of()) == {"flat field": "Camera"}
    assert bench.lights[-1] == DARK


def test_without_a_model_that_says_how_even_the_light_is_it_is_not_tested(test_of):
    assert test_of(flat_field_ratio=None)["flat field"].verdict == "not_tested"


@pytest.mark.parametrize(
    ("part", "error", "expected"),
    [
        ("camera", CameraError("No frame.", "Check it."), {"dark frames": "Camera", "LED sides": "Camera"}),
        ("light", LightError("No answer.", "Check it."), {"dark frames": "Light", "LED sides": "Light"}),
        ("circuits", LightError("No answer.", "Check it."), {"LED circuits": "Light"}),
        ("line", LightLineError("It is not wired.", "Wire it."), {"enable line": "Light"}),
        ("force", LoadCellError("Silent.", "Check it."), {"zero": "Load cell"}),
    ],
)
def test_a_fault_fails_what_it_hinders_under_its_own_part_and_all_else_is_tested(test_of, bench, part, error, expected):
    bench.break_at = {part: error}
    results = test_of()
    assert failed(results) == expected
    assert {results[check].code for check in expected} == {error.code}
    assert {"write and read", "model paper", "steady clock"} <= set(results)


def test_a_chip_that_does_not_measure_current_is_not_said_to_have_found_it(test_of):
    config = replace(CONFIG, light=LightSection(chip="pca9685"), camera=CameraSection(exposure_us=3932))
    results = test_of(config=config)
    assert results["LED circuits"].verdict == "not_tested"


def test_an_enable_line_that_nobody_has_seen_is_not_tested_and_what_is_missing_is_said(test_of, bench):
    bench.has_shown_its_line = False
    assert test_of()["enable line"].verdict == "not_tested"
    none = test_of(config=replace(CONFIG, light=LightSection()))["enable line"]
    assert (none.verdict, "light.enable_line" in none.remedy) == ("not_tested", True)
