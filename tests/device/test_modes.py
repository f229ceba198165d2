"""A press in each mode through the daemon's whole procedure on emulated chips: which recording reaches the estimator.

The estimator is a stand-in that keeps what it got. Time is simulated; hands and cameras are faster than people's, by as
much as the largest rate of a ramp is raised, so that there are fewer frames to render.
"""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from simulated_time import SimulatedTime
from simulated_time_probe import simulate_time
from stand_in_adviser import narrowing

from device.assembly import probe as assembly
from device.assembly.probe import open_simulated_probe
from device.config import CameraSection, PressSection, simulated_config
from device.errors import CameraError
from device.files.recording_file import read_recording
from device.instrument.press.cost import ModeOffer
from device.instrument.press.frame_choice import ramp_targets_n
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.press.states import Guidance, PressState
from device.instrument.procedure import Procedure
from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate
from device.measurement.mode import FRAMES, MODES, Mode, ModeWorth
from device.measurement.recording.recording import Recording
from device.measurement.scan_advice import ScanAdvice
from device.records.store import ENDED
from device.simulation import virtual_probe
from device.simulation.faults import ScriptedFault
from device.simulation.hand import HandSettings, VirtualHand
from device.simulation.scenario import Scenario
from device.web.app import create_app

HAND = HandSettings(rate_n_per_s=1.5, ramp_rate_n_per_s=0.4, reaction_s=0.05)
QUICK = Scenario(hand=HAND)
PRESS = PressSection(max_rate_n_per_s=0.6)
WORTH = {"precise": ModeWorth(0.1, 0.9, {}, {}, reachable_half_width={"size_mm": 0.8})}
RAMPS = [mode for mode in MODES if FRAMES[mode].is_ramp]
LONGEST_WAIT_S = 30.0


class Witness:
    """An estimator that answers in every mode and keeps what it is asked."""

    def __init__(self) -> None:
        self.recordings: list[Recording] = []
        self.advises: Callable[[Recording], ScanAdvice] = self.unsure

    def estimate(self, recording: Recording, mode: Mode) -> Estimate:
        self.recordings.append(recording)
        unknown = [UNKNOWN_QUANTITY] * 3
        return Estimate(*unknown, "not_identifiable", "A stand-in.", mode, "m", "00", "c", True, {})

    def advise(self, recording: Recording) -> ScanAdvice:
        """Say of a scan what the test says."""
        return self.advises(recording)

    def unsure(self, recording: Recording) -> ScanAdvice:
        """Ask for one more press, 5 mm aside, and then for none."""
        estimate = self.estimate(recording, "precise")
        return ScanAdvice(estimate, {}, 5.0 if len(recording.ramps()) == 1 else None, {})


class Device:
    """A simulated probe that runs, its witness, and every guidance it has given."""

    def __init__(self, procedure: Procedure, witness: Witness, clock: SimulatedTime) -> None:
        self.procedure, self.board, self.witness, self.told = procedure, procedure.board, witness, []
        self._clock = clock
        self.board.on_guidance(lambda guidance: self.told.append(guidance.code))

    def until(self, condition: Callable[[], bool]) -> None:
        assert self._clock.wait(condition, LONGEST_WAIT_S), (self.board.now, self.told)

    @property
    def now_s(self) -> float:
        """Return the time of its clock."""
        return self._clock.monotonic()

    def offer(self, mode: Mode) -> ModeOffer:
        """Return what it offers as a mode."""
        return next(offer for offer in self.procedure.offers() if offer.cost.mode == mode)

    def begin(self, mode: Mode) -> str:
        self.until(lambda: self.board.now.step != "starting" and self.board.now.fault is None)
        return self.procedure.request(mode).id

    def ended(self, press_id: str) -> dict[str, Any]:
        self.until(lambda: self.procedure.store.press(press_id)["state"] in ENDED)
        return self.procedure.store.press(press_id)

    def press(self, mode: Mode) -> dict[str, Any]:
        return self.ended(self.begin(mode))

    def ask(self, method: str, path: str, **content: Any) -> httpx.Response:
        """Return what its REST interface answers."""
        transport = httpx.ASGITransport(create_app(self.procedure, self.procedure.store))

        async def answer() -> httpx.Response:
            async with httpx.AsyncClient(transport=transport, base_url="http://localhost") as client:
                headers = {"content-type": "application/json"}
                return await client.request(method, f"/api/v1/{path}", headers=headers, **content)

        return asyncio.run(answer())


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    witness, clock = Witness(), simulate_time(monkeypatch)
    monkeypatch.setattr(
        assembly, "answers_of_start", lambda *parts: ProbeAnswers(MODES, witness.estimate, witness.advise, worth=WORTH)
    )
    config = replace(simulated_config(), data=tmp_path, camera=CameraSection(frame_rate_hz=60.0), press=PRESS)

    @contextmanager
    def run(scenario: Scenario = QUICK) -> Iterator[Device]:
        opened = open_simulated_probe(config, scenario)
        device = Device(opened, witness, clock)
        opened.start()
        try:
            yield device
        finally:
            opened.close()

    return run


def pressed_n(recording: Recording, role: str, ramp: int = 0) -> list[float]:
    frames = [frame for frame in recording.with_role(role) if frame.ramp == ramp]
    return sorted(frame.force_n for frame in frames if frame.force_n > PRESS.contact_n)


@pytest.mark.parametrize("mode", RAMPS)
def test_a_ramp_has_its_frames_spread_over_the_force_beside_the_lesion_and_on_it(running, mode):
    with running() as device:
        job = device.press(mode)
    assert (job["state"], job["warnings"]) == ("done", [])
    recording = device.witness.recordings[-1]
    for role, ramp in [("reference", 0), *(("press", ramp) for ramp in range(FRAMES[mode].fewest_ramps))]:
        targets_n = ramp_targets_n(FRAMES[mode].count, role)
        forces_n = pressed_n(recording, role, ramp)
        assert len(forces_n) == FRAMES[mode].count
        assert np.abs(np.subtract(forces_n, targets_n)).max() <= (targets_n[1] - targets_n[0]) / 2 + 1e-9
    assert {"touch_beside", "touch_lesion", "press_slowly", "hold_still", "lift", "done"} <= set(device.told)
    assert "slower" not in device.told


@pytest.mark.parametrize("mode", [mode for mode in MODES if not FRAMES[mode].is_ramp])
def test_a_hold_has_as_many_frames_as_its_mode_needs(running, mode):
    with running() as device:
        job = device.press(mode)
    assert job["state"] == "done"
    [recording] = device.witness.recordings
    for role in ("reference", "press"):
        forces_n = pressed_n(recording, role)
        assert len(forces_n) == FRAMES[mode].count
        assert all(PRESS.band_n[0] <= force_n <= PRESS.band_n[1] for force_n in forces_n)


def test_the_mode_stands_in_the_job_the_measurement_and_its_estimate(running):
    with running() as device:
        job = device.press("quick")
        measurement = device.procedure.store.measurement(job["measurement_id"])
    assert job["mode"] == measurement["mode"] == measurement["estimate"]["mode"] == "quick"


@pytest.mark.long
def test_a_hand_that_is_too_fast_is_slowed_and_gets_its_ramp(running):
    """1.1 N/s against 0.6 N/s: what it missed it fetches on the way down."""
    hand = replace(HAND, ramp_rate_n_per_s=1.1)
    with running(Scenario(hand=hand)) as device:
        job = device.press("standard")
    assert job["state"] == "done"
    assert {"slower", "press_lighter"} <= set(device.told)
    assert len(pressed_n(device.witness.recordings[0], "press")) == 10


@pytest.mark.long
def test_a_hand_that_lifts_midway_begins_again(running, monkeypatch):
    """On the lesion it lifts half a second after it was told to press slowly harder."""
    lifted_s: list[float] = []

    class LiftingHand(VirtualHand):
        def follow(self, guidance: str, now_s: float, aside_mm: float | None = None) -> None:
            super().follow(guidance, now_s, aside_mm)
            if guidance == "press_slowly" and self.place(now_s).x_mm == 0.0 and not lifted_s:
                lifted_s.append(now_s + 0.5)
                super().follow("lift", now_s + 0.5)

    monkeypatch.setattr(virtual_probe, "VirtualHand", LiftingHand)
    with running() as device:
        job = device.press("standard")
    assert job["state"] == "done"
    assert device.told.count("touch_lesion") == 2
    press = device.witness.recordings[0].with_role("press")
    assert len(press) == 10
    assert min(frame.t_s for frame in press) > lifted_s[0]


def test_a_ramp_that_goes_too_far_is_rejected_with_both_numbers(running, monkeypatch):
    """From 0.3 N on the hand leans on the probe with 1 N more."""

    class HeavyHand(VirtualHand):
        def force_n(self, t_s: float) -> float:
            force_n = super().force_n(t_s)
            return force_n if force_n < 0.3 else force_n + 1.0

    monkeypatch.setattr(virtual_probe, "VirtualHand", HeavyHand)
    with running() as device:
        job = device.press("standard")
    assert job["state"] == "rejected"
    assert "above 1.00 N" in job["reason"]
    assert device.witness.recordings == []


def test_a_hold_that_is_too_hard_is_rejected_with_both_numbers(running):
    with running(Scenario(hand=replace(HAND, aim_n=1.4))) as device:
        job = device.press("paper")
    assert job["state"] == "rejected"
    assert re.search(r"1\.\d\d N.*above 1\.00 N", job["reason"])
    assert device.witness.recordings == []


@pytest.mark.parametrize("mode", ["paper", "standard"])
def test_a_press_far_beside_the_inclusion_is_rejected_and_says_where_to_go(running, mode):
    """The probe stands 5 mm to the right of the inclusion, which shines on the left, -x: there the probe has to go."""
    with running(Scenario(hand=replace(HAND, miss_x_mm=5.0))) as device:
        job = device.press(mode)
    assert job["state"] == "rejected"
    assert re.search(r"lies [34]\.\d mm off the middle, above 2\.5 mm: move the probe towards -x\.$", job["reason"])
    assert device.board.now.state is PressState.REJECTED
    assert device.witness.recordings == []


def test_a_ramp_is_cancelled_in_the_middle(running):
    with running() as device:
        press_id = device.begin("precise")
        device.until(lambda: device.board.now.frames_taken >= 5)
        device.procedure.cancel(press_id)
        job = device.ended(press_id)
    assert job["state"] == "cancelled"
    assert device.witness.recordings == []


def test_a_client_scans_until_it_is_as_sure_as_it_asked(running):
    """Half widths of 2, 1, 0.67 mm after the presses: asked for 1 mm of the size, it ends by itself with the second."""
    with running() as device:
        device.witness.advises = narrowing(2.0)
        device.until(lambda: device.board.now.step == "ready")
        refused = device.ask("POST", "presses", json={"mode": "precise", "until": {"size_mm": 0.5}})
        assert (refused.status_code, refused.json()["code"]) == (422, "E803")
        assert refused.json()["detail"] == "until.size_mm is 0.5, but must be at least 0.8 and at most 20 mm."
        assert refused.json()["remedy"] == "the nearest that can be had is 0.8 mm"
        assert device.ask("POST", "presses", json={"mode": "quick", "until": {"size_mm": 2}}).status_code == 422
        asked = {"mode": "precise", "until": {"size_mm": 1.0}, "within_s": 60}
        job = device.ask("POST", "presses", json=asked).json()
        assert (job["until"], job["within_s"], job["ramps"]) == ({"size_mm": 1.0}, 60, 0)
        assert device.ask("POST", f"presses/{job['id']}/finish").status_code == 409
        device.until(lambda: device.board.now.scan is not None)
        scan = device.ask("GET", "status").json()["scan"]
        assert (scan["ramps"], scan["half_width"]["size_mm"], scan["next_offset_mm"]) == (1, pytest.approx(2.0), 4.0)
        ended = device.ended(job["id"])
        assert (ended["state"], ended["ramps"]) == ("done", 2)
        kept = device.ask("GET", f"measurements/{ended['measurement_id']}").json()
        assert device.ask("POST", f"presses/{job['id']}/finish").status_code == 404
    assert (kept["until"], kept["within_s"], kept["reached"], kept["ramps"]) == ({"size_mm": 1.0}, 60, True, 2)
    assert kept["estimate"]["size_mm"]["high"] == pytest.approx(13.0)
    assert device.told.count("move_aside") == 1


def test_a_client_that_has_enough_gets_the_answer_of_the_presses_that_are_complete(running):
    with running() as device:
        device.witness.advises = narrowing(3.0)
        press_id = device.begin("precise")
        device.until(lambda: device.board.now.scan is not None and device.board.now.frames_taken == 3)
        ramps = device.board.now.scan.ramps
        assert device.ask("POST", f"presses/{press_id}/finish").status_code == 202
        job = device.ended(press_id)
        kept = device.ask("GET", f"measurements/{job['measurement_id']}").json()
        recording = read_recording(device.procedure.store.recording_path(kept["recording_id"]))
    assert (job["state"], kept["ramps"], kept["frames"], kept["reached"]) == ("done", ramps, 10 * ramps, None)
    assert list(recording.ramps()) == list(range(ramps))


@pytest.mark.long
def test_the_time_of_a_scans_answer_leaves_out_how_long_it_waited_for_a_further_press(running):
    """The operator says "Enough" while the probe waits for the second press."""
    with running(Scenario(hand=replace(HAND, reaction_s=1.5))) as device:
        press_id = device.begin("precise")
        device.until(lambda: device.board.now.guidance is Guidance.MOVE_ASIDE)
        moved_s = device.now_s
        device.until(lambda: device.now_s - moved_s > 1.0)
        device.procedure.finish(press_id)
        assert device.ended(press_id)["state"] == "done"
        device.until(lambda: device.offer("precise").answer_presses == 1)
        assert device.offer("precise").answer_s < 0.5


def test_a_fault_in_a_scan_is_shown_once_the_answer_of_its_presses_is_kept(running, monkeypatch):
    fault, kept = CameraError("No frame came.", "Check the ribbon cable."), []
    with running() as device:
        take, broken = device.procedure.bench.take, [fault]

        def fail(role):
            if broken and device.board.now.scan and device.board.now.guidance is Guidance.PRESS_SLOWLY:
                raise broken.pop()
            return take(role)

        def at_fault(guidance):
            if guidance is Guidance.FAULT:
                kept.extend(device.procedure.store.measurements(before_seq=100, limit=9))

        monkeypatch.setattr(device.procedure.bench, "take", fail)
        device.board.on_guidance(at_fault)
        job = device.press("precise")
        assert (job["state"], job["code"], job["ramps"]) == ("done", None, 1)
        device.until(lambda: bool(kept))
        assert (kept[0]["id"], kept[0]["ramps"]) == (job["measurement_id"], 1)
        assert device.press("quick")["state"] == "done"


def test_a_scan_that_finds_too_little_light_is_rejected_and_a_press_is_not(running):
    """15 s of at most 20 s have just been used."""
    with running() as device:
        device.until(lambda: device.board.now.step == "ready")
        budget = device.procedure.bench.budget
        budget._max_on_s = 20.0
        budget._spells.appendleft((device.now_s - 15.0, device.now_s))
        job = device.press("precise")
        assert (job["state"], job["code"]) == ("rejected", "E211")
        assert "Wait" in job["reason"]
        assert device.press("quick")["state"] == "done"


def test_a_scan_is_cancelled_with_all_of_its_presses(running):
    with running() as device:
        press_id = device.begin("precise")
        device.until(lambda: device.board.now.guidance is Guidance.MOVE_ASIDE)
        device.procedure.cancel(press_id)
        job = device.ended(press_id)
        assert (job["state"], job["ramps"]) == ("cancelled", 1)
        assert device.procedure.store.measurements(before_seq=100, limit=1) == []
        assert device.press("quick")["state"] == "done"


def test_a_wet_face_is_seen_in_a_ramp(running):
    with running(Scenario(hand=HAND, faults=(ScriptedFault("wet_face", ratio=1.0),))) as device:
        job = device.press("standard")
    assert (job["state"], job["code"]) == ("rejected", "E501")


def test_a_camera_that_tears_its_frames_is_at_fault_in_a_ramp(running):
    with running(Scenario(hand=HAND, faults=(ScriptedFault("camera_torn", from_press=1),))) as device:
        job = device.press("standard")
    assert (job["state"], job["code"]) == ("failed", "E103")


@pytest.mark.long
def test_a_light_that_lost_a_tenth_is_warned_of_after_holds_and_ramps_alike(running):
    """The first press says how bright a side is at the target force, whatever its mode."""
    with running(Scenario(hand=HAND, faults=(ScriptedFault("led_dimmed", ratio=0.9, from_press=4),))) as device:
        warned = [[w["code"] for w in device.press(mode)["warnings"]] for mode in ("standard", "quick", "precise")]
        dimmed = device.press("standard")["warnings"]
    assert warned == [[], [], []]
    assert [warning["code"] for warning in dimmed] == ["E206"]
