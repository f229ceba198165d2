"""Scans by hands in simulated time: what ends them, and that a press on the lesion that is complete is never lost."""

from __future__ import annotations

import types

import pytest
from simulated_time_bench import CAMERA, SimulatedTimeProbe
from stand_in_adviser import advice

from device.config import Config
from device.errors import CameraError, StorageError
from device.instrument.acquisition import bench as bench_module
from device.instrument.acquisition.bench import DARK, Bench
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press import capture as capture_module
from device.instrument.press import scan as scan_module
from device.instrument.press.capture import Capture, PressEnded
from device.instrument.press.scan import MAX_FAILED, USUAL_OFFSET_MM, Scan, ScanTaken
from device.instrument.press.states import PressState
from device.instrument.status import PressJob, StatusBoard
from device.measurement.mode import FRAMES
from device.measurement.quantities import InvalidQuantity
from device.simulation.hand import HandSettings

CONFIG = Config(camera=CAMERA)
COUNT = FRAMES["precise"].count


class ScanRig:
    """A hand that scans; `advises` says what to answer after so many presses, `at` what happens at a guidance.

    The keys of `at` are a guidance and how often it has come in the scan.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch, **hand: float) -> None:
        self.probe, self.board = SimulatedTimeProbe(HandSettings(**hand)), StatusBoard()
        self.told, self.noted = [], []
        clock = types.SimpleNamespace(monotonic=lambda: self.probe.now_s, sleep=self.probe.sleep)
        for module in (bench_module, capture_module, scan_module):
            monkeypatch.setattr(module, "time", clock)
        self.bench = Bench(self.probe, self.probe, self.probe, budget=LightBudget(clock=lambda: self.probe.now_s))
        self.capture, self.at, self.offsets_mm = Capture(self.bench, CONFIG, self.board), {}, []
        self.note = self.noted.append
        self.advises = lambda ramps: advice(2.0 / ramps)
        self.board.on_guidance(self._follow)

    def _follow(self, guidance) -> None:
        self.told.append(guidance.code)
        happens = self.at.get((guidance.code, self.told.count(guidance.code)))
        if happens and happens() == "ignored":
            return
        scan = self.board.now.scan
        self.probe.hand.follow(guidance.code, self.probe.now_s, scan.next_offset_mm if scan else None)

    def _advise(self, frames):
        assert self.probe._ratio == DARK, "nobody is to be lit while it is computed"
        return self.advises(len({frame.ramp for frame in frames}))

    def scan(self, **wanted) -> ScanTaken:
        """Press beside the lesion and then scan."""
        self.capture.unloaded()
        self.probe.hand.begin()
        self.capture.loaded("reference", "precise")
        self.capture.release()
        self.probe.hand.follow("lift", self.probe.now_s)
        self.capture.lifted()
        self.told.clear()
        job = PressJob("p-1", "precise", **wanted)
        darken = lambda: self.bench.light(DARK)  # noqa: E731
        scan = Scan(job, self.capture, self.board, advise=self._advise, darken=darken, note=self.note)
        self.began_s = self.probe.now_s
        return scan.lead()

    def later_heavier(self, presses: int) -> None:
        """Let the hand lean on the probe in so many of the presses that stand aside."""
        force_n = self.probe.hand.force_n

        def heavy_n(t_s):
            return force_n(t_s) + (1.2 if force_n(t_s) > 0.3 and 0 < self.told.count("move_aside") <= presses else 0.0)

        self.probe.hand.force_n = heavy_n


@pytest.fixture
def rig(monkeypatch):
    return ScanRig(monkeypatch)


def frames_by_ramp(taken: ScanTaken) -> dict[int, int]:
    ramps = [frame.ramp for frame in taken.frames]
    return {ramp: ramps.count(ramp) for ramp in sorted(set(ramps))}


def test_a_scan_presses_on_the_lesion_and_aside_until_no_further_press_tells_much(rig):
    """The second press, 4 mm off the middle, would be rejected as the only one."""
    rig.advises = lambda ramps: advice(1.0, 4.0 if ramps < 3 else None)
    places, follow = [], rig.probe.hand.follow
    rig.probe.hand.follow = lambda code, *rest: (places.append((code, rest[-1])), follow(code, *rest))
    taken = rig.scan()
    assert frames_by_ramp(taken) == {0: COUNT, 1: COUNT, 2: COUNT}
    assert {frame.role for frame in taken.frames} == {"press"}
    assert (taken.reached, taken.fault, rig.noted) == (None, None, [1, 2, 3])
    assert [code for code in rig.told if code in ("touch_lesion", "move_aside", "lift")] == [
        *("touch_lesion", "lift", "move_aside", "lift", "move_aside", "lift")
    ]
    assert [aside_mm for code, aside_mm in places if code == "move_aside"] == [4.0, 4.0]
    assert rig.capture.machine.state is PressState.RELEASING


def test_after_each_press_the_board_says_how_sure_it_is_and_where_the_next_one_goes(rig):
    seen = []
    rig.board.on_guidance(lambda guidance: guidance.code == "move_aside" and seen.append(rig.board.now.scan))
    rig.advises = lambda ramps: advice(2.0 / ramps, 5.0 if ramps == 1 else None)
    rig.scan()
    [one] = seen
    record = one.as_record()
    assert (record["ramps"], record["most_ramps"], record["next_offset_mm"], record["failed"]) == (1, 5, 5.0, "")
    assert record["half_width"] == pytest.approx({"size_mm": 2.0, "depth_mm": 2.0})
    assert record["expected_half_width"] == pytest.approx({"size_mm": 1.0, "depth_mm": 1.0})
    assert record["value"] == {"size_mm": 12.0, "depth_mm": 6.0, "youngs_modulus_kpa": None}
    assert record["determined"] == {"size_mm": True, "depth_mm": True, "youngs_modulus_kpa": False}
    assert rig.board.now.scan.ramps == 2


def test_it_takes_two_presses_at_least_the_second_a_usual_way_aside_when_nobody_knows_better(rig):
    rig.advises = lambda ramps: advice(2.0, None)
    asked = []
    rig.board.on_guidance(lambda guidance: asked.append(rig.board.now.scan.next_offset_mm) if rig.board.now.scan else 0)
    assert frames_by_ramp(rig.scan()) == {0: COUNT, 1: COUNT}
    assert set(asked) == {USUAL_OFFSET_MM}


def test_it_ends_as_soon_as_it_is_as_sure_as_was_asked_for_also_with_the_first_press(rig):
    taken = rig.scan(until={"size_mm": 2.1})
    assert (frames_by_ramp(taken), taken.reached) == ({0: COUNT}, True)


def test_it_ends_with_its_last_press_when_what_was_asked_for_is_out_of_reach(rig):
    taken = rig.scan(until={"size_mm": 3.0, "youngs_modulus_kpa": 10.0})
    assert (len(frames_by_ramp(taken)), taken.reached) == (FRAMES["precise"].most_ramps, False)


def test_whoever_says_enough_is_answered_with_the_presses_that_are_complete(rig):
    """Said in the middle of the second press, which is left out."""
    rig.at["press_slowly", 2] = rig.capture.finished.set
    taken = rig.scan()
    assert frames_by_ramp(taken) == {0: COUNT}
    assert taken.advice.half_width["size_mm"] == pytest.approx(2.0)
    assert rig.capture.machine.state is PressState.RELEASING


def test_enough_before_the_next_press_waits_for_nobody(rig):
    rig.at["move_aside", 1] = lambda: rig.capture.finished.set() or "ignored"
    assert frames_by_ramp(rig.scan()) == {0: COUNT}
    assert rig.probe.now_s - rig.began_s < CONFIG.press.timeout_s / 2


def test_the_time_counts_from_the_first_contact_and_the_press_under_way_is_finished(rig):
    """One press of this hand takes some 5 s: within 6 s the second has begun."""
    taken = rig.scan(within_s=6.0)
    assert frames_by_ramp(taken) == {0: COUNT, 1: COUNT}
    assert rig.probe.now_s - rig.began_s > 6.0


def test_when_the_time_is_over_nobody_is_waited_for(rig):
    rig.at["move_aside", 1] = lambda: "ignored"
    taken = rig.scan(within_s=20.0)
    assert frames_by_ramp(taken) == {0: COUNT}
    assert 20.0 < rig.probe.now_s - rig.began_s < 22.0
    assert 12.0 < taken.idle_s < 20.0, "the answer was there long before"


def test_a_press_that_fails_is_asked_for_again_and_says_why(rig):
    rig.later_heavier(1)
    rig.advises = lambda ramps: advice(1.0, 4.0 if ramps < 2 else None)
    failed = []
    rig.board.on_guidance(lambda guidance: rig.board.now.scan and failed.append(rig.board.now.scan.failed))
    taken = rig.scan()
    assert frames_by_ramp(taken) == {0: COUNT, 1: COUNT}
    assert rig.told.count("move_aside") == 2
    assert any("above 1.00 N" in reason for reason in failed)
    assert rig.board.now.scan.failed == ""


def test_a_scan_whose_presses_fail_again_and_again_ends_with_those_that_are_complete(rig):
    rig.later_heavier(100)
    assert frames_by_ramp(rig.scan()) == {0: COUNT}
    assert rig.told.count("move_aside") == MAX_FAILED


def test_an_operator_who_goes_away_is_answered_with_what_is_there(rig):
    rig.at["move_aside", 1] = lambda: "ignored"
    assert frames_by_ramp(rig.scan()) == {0: COUNT}
    assert rig.told.count("move_aside") == 1
    assert rig.probe.now_s - rig.began_s > CONFIG.press.timeout_s


def test_a_press_that_the_adviser_refuses_is_none(rig):
    def advises(ramps):
        if ramps == 2 and rig.told.count("move_aside") == 1:
            raise InvalidQuantity("largest press force", 0.4, "at least 0.5 N", "press again")
        return advice(1.0, None)

    rig.advises = advises
    taken = rig.scan()
    assert frames_by_ramp(taken) == {0: COUNT, 1: COUNT}
    assert rig.told.count("move_aside") == 2


def test_a_fault_in_a_later_press_leaves_the_answer_of_those_before_and_is_told(rig, monkeypatch):
    fault, take = CameraError("No frame came.", "Check the ribbon cable."), rig.bench.take

    def fail(role):
        if rig.told.count("press_slowly") == 2:
            raise fault
        return take(role)

    monkeypatch.setattr(rig.bench, "take", fail)
    taken = rig.scan()
    assert (frames_by_ramp(taken), taken.fault) == ({0: COUNT}, fault)


@pytest.mark.parametrize("presses", [1, 2])
def test_a_store_that_cannot_note_a_complete_press_ends_the_scan_with_that_press_and_what_it_tells(rig, presses):
    fault, note = StorageError("The store cannot be written.", "Free some space."), rig.noted.append

    def fail(ramps):
        note(ramps)
        if ramps == presses:
            raise fault

    rig.note = fail
    taken = rig.scan()
    assert (len(frames_by_ramp(taken)), taken.fault) == (presses, fault)
    assert taken.advice.half_width == rig.advises(presses).half_width


def test_a_fault_in_the_first_press_is_that_of_any_press(rig, monkeypatch):
    rig.at["press_slowly", 1] = lambda: monkeypatch.setattr(rig.bench, "take", fail)

    def fail(role):
        raise CameraError("No frame came.", "Check the ribbon cable.")

    with pytest.raises(CameraError):
        rig.scan()


@pytest.mark.parametrize("stop", ["cancelled", "stopping"])
def test_a_scan_that_is_cancelled_or_stopped_ends_without_an_answer(rig, stop):
    rig.at["press_slowly", 2] = getattr(rig.capture, stop).set
    with pytest.raises(PressEnded) as end:
        rig.scan()
    assert end.value.state == ("cancelled" if stop == "cancelled" else "failed")


def test_the_first_press_has_to_be_on_the_middle_of_the_lesion(monkeypatch):
    rig = ScanRig(monkeypatch, miss_x_mm=5.0)
    with pytest.raises(PressEnded, match="off the middle, above 2.5 mm"):
        rig.scan()
    assert rig.told.count("move_aside") == 0
