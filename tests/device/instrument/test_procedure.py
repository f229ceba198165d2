"""Presses one after the other, also when something breaks in the middle: every press ends, and the next may begin."""

import threading
from contextlib import ExitStack

import numpy as np
import pytest
from small_certificate import small_certificate
from stand_in_adviser import no_advice

from device.config import CameraSection, Config, PressSection
from device.errors import (
    BusyError,
    CalibrationEndsSoon,
    CameraError,
    ClockJumpError,
    DiskFullError,
    ExpiredCalibration,
    LastGoodConfigError,
    LightError,
    LightRestError,
    LoadCellError,
    ModeUnavailable,
    StaleVersion,
    StorageError,
    UnknownResource,
    ZeroShiftError,
)
from device.files.recording_file import read_recording
from device.instrument import procedure as procedure_module
from device.instrument.acquisition.light_budget import LightBudget
from device.instrument.press.probe_answers import ProbeAnswers
from device.instrument.press.states import Guidance, PressState
from device.instrument.procedure import Procedure
from device.instrument.self_test.report import CheckResult
from device.instrument.watch import progress as progress_module
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.progress import ProgressBoard
from device.instrument.watch.readiness import PartHealth
from device.measurement.calibration import Validity
from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.tactile_image import Frame
from device.measurement.recording.untouched_face import UntouchedFace
from device.records.asked_once import AskedOnce
from device.records.exams import AskedExam, ExamContent
from device.records.store import ENDED, Store

AGELESS = Validity("1970-01-01T00:00:00Z", "2069-12-07T00:00:00Z")
DARK_FACE = UntouchedFace(4.0, (0.0, 0.0, 0.0, 0.0), 0.0, 60.0, 0.6)
CONFIG = Config(camera=CameraSection(width_px=64, height_px=64), press=PressSection(mode="paper", timeout_s=5.0))
ANSWER = Estimate(
    *[UNKNOWN_QUANTITY] * 3, "not_identifiable", "A stand-in.", "standard", "m", "00", "c", True, {"total": 1.0}
)


class ObedientBench:
    """A bench whose operator does at once what the screen says. `breaks` are raised by a press frame each."""

    fault = None  # of the force, which this bench is itself

    def __init__(self):
        self.force, self.board, self.breaks, self.brightness = self, None, [], 0.5
        self.is_at_work, self.is_closed, self.zero_n = False, False, 0.0
        self.budget, self.progress, self.rests = LightBudget(), ProgressBoard(), 0

    @property
    def latest_n(self):
        told_to_press = self.board.now.guidance.code.startswith(("press", "hold"))
        return self.zero_n + (0.5 if self.is_at_work and told_to_press else 0.0)

    def reaches(self, force_n, *, timeout_s):
        threading.Event().wait(timeout_s)
        return self.latest_n >= force_n

    def rest(self):
        self.rests += 1

    def move_zero(self, read_n):
        self.zero_n -= read_n

    def retare(self):
        moved_n, self.zero_n = self.zero_n, 0.0
        return moved_n

    def light(self, ratio):
        self.ratio = ratio

    def darken_for_good(self):
        self.ratio = (0.0, 0.0, 0.0, 0.0)

    def check_lights(self):
        self.ratio = (0.0, 0.0, 0.0, 0.0)

    def take(self, role):
        if role == "press" and self.breaks:
            raise self.breaks.pop()
        light = sum(self.ratio) * self.brightness if self.latest_n > self.zero_n else 0.0
        return Frame(np.full((64, 64), 4 + round(100 * light), np.uint8), role, 0.0, self.latest_n, self.ratio)

    def range_n(self, t_s, *, around_line):
        return 0.0

    def rate_n_per_s(self, t_s):
        return 0.0

    def peak_n(self, since_s, t_s):
        return self.latest_n

    def close(self):
        self.is_closed = True


class Rig:
    """A procedure on an obedient bench, its estimator, its store and its operator, who may be away."""

    def __init__(self, folder):
        self.bench, self.store, opened = ObedientBench(), Store(folder), ExitStack()
        opened.callback(self.bench.close)
        self.estimator, self.modes_asked = lambda recording: ANSWER, []
        self.procedure = Procedure(
            CONFIG,
            self.bench,
            ProbeAnswers(("paper", "quick", "standard"), self.estimate, no_advice),
            self.store,
            calibration=CalibrationWatch(small_certificate(validity=AGELESS, untouched=DARK_FACE)),
            opened=opened,
            simulated_truth=Inclusion(10.0, 5.0, 80.0),
        )
        self.bench.board = self.board = self.procedure.board
        self.board.on_guidance(self.put_down)
        self.procedure.on_request(self.take_up)
        self.is_away, self.waiting = False, threading.Event()
        self.procedure.start()
        self.until(lambda: self.board.now.step == "ready")

    def estimate(self, recording, mode):
        self.modes_asked.append(mode)
        return self.estimator(recording)

    def take_up(self, mode=None):
        self.bench.is_at_work = not self.is_away

    def put_down(self, guidance):
        if guidance in (Guidance.DONE, Guidance.REJECTED, Guidance.FAULT):
            self.bench.is_at_work = False

    def until(self, condition):
        assert any(condition() or self.waiting.wait(0.005) for _ in range(2000)), self.board.now

    def press(self, mode=None):
        """Request a press and return its job once it has ended."""
        job = self.procedure.request(mode)
        self.until(lambda: not self.bench.is_at_work and self.board.now.press.state in ENDED)
        return self.store.press(job.id)

    def close(self):
        self.procedure.close()
        self.store.close()


@pytest.fixture
def rig(tmp_path, monkeypatch):
    monkeypatch.setattr(procedure_module, "AFTER_FAULT_S", 0.02)
    monkeypatch.setattr(procedure_module, "LOOK_EVERY_S", 0.002)
    rig = Rig(tmp_path)
    yield rig
    rig.close()


def test_a_press_goes_through_its_steps_and_its_measurement_is_kept(rig):
    told = []
    rig.board.on_guidance(told.append)
    job = rig.press()
    assert (job["state"], job["progress"]) == ("done", 1.0)
    kept = rig.store.measurement(job["measurement_id"])
    assert (kept["frames"], kept["force_n"]) == (10, 0.5)
    assert kept["truth"] == {"size_mm": 10.0, "depth_mm": 5.0, "youngs_modulus_kpa": 80.0}
    assert kept["estimate"]["reason"] == "A stand-in."
    assert rig.store.recording_path(kept["recording_id"]).is_file()
    steps = [Guidance.HOLD_STILL, Guidance.LIFT, Guidance.PRESS_LESION, Guidance.HOLD_STILL, Guidance.LIFT]
    assert [guidance for guidance in told if guidance is not Guidance.PRESS_BESIDE][:6] == [*steps, Guidance.DONE]


def test_the_camera_rests_when_nobody_has_pressed_for_a_while_and_only_then(rig, monkeypatch):
    rig.press()
    assert rig.bench.rests == 0
    monkeypatch.setattr(procedure_module, "REST_AFTER_S", 0.0)
    rig.until(lambda: rig.bench.rests > 0)
    assert rig.press()["state"] == "done"


def test_a_press_that_is_done_tells_how_long_its_answer_took(rig):
    assert {offer.cost.mode: offer.answer_presses for offer in rig.procedure.offers()} == dict.fromkeys(
        ("paper", "quick", "standard"), 0
    )
    rig.press("quick")
    rig.until(lambda: [offer.answer_presses for offer in rig.procedure.offers()] == [0, 1, 0])


def test_the_board_tells_the_state_of_the_press_until_the_next_one(rig):
    states = []
    rig.estimator = lambda recording: states.append(rig.board.now.state) or ANSWER
    assert rig.board.now.state is PressState.IDLE
    rig.press()
    assert (states, rig.board.now.state) == ([PressState.RELEASING], PressState.DONE)
    rig.is_away = True
    job = rig.procedure.request()
    rig.until(lambda: rig.board.now.state is PressState.APPROACH)
    rig.procedure.cancel(job.id)
    rig.until(lambda: rig.board.now.state is PressState.REJECTED)
    assert rig.board.now.frames_taken == 0


def test_a_fault_ends_the_press_in_whatever_state_it_is_and_the_next_finds_an_idle_probe(rig):
    seen = []
    rig.board.on_guidance(lambda guidance: guidance is Guidance.FAULT and seen.append(rig.board.now.state))
    rig.bench.breaks = [CameraError("No frame came.", "Check the ribbon cable.")]
    rig.press()
    assert seen == [PressState.REJECTED]
    rig.until(lambda: rig.board.now.step == "ready")
    assert rig.board.now.state is PressState.IDLE


def test_the_light_is_off_while_the_result_is_computed(rig):
    light = []
    rig.estimator = lambda recording: light.append(rig.bench.ratio) or ANSWER
    rig.press()
    assert light == [(0.0, 0.0, 0.0, 0.0)]


def test_a_light_that_cannot_be_switched_off_costs_no_measurement(rig, monkeypatch):
    set_light, failing = rig.bench.light, []

    def light(ratio):
        if failing and not any(ratio):
            raise failing.pop()
        set_light(ratio)

    monkeypatch.setattr(rig.bench, "light", light)
    rig.board.on_guidance(
        lambda guidance: guidance is Guidance.PRESS_LESION and failing.append(LightError("No answer.", "Mend it."))
    )
    assert rig.press()["state"] == "done"
    assert failing == []


def test_a_fault_darkens_the_probe_at_once(rig, monkeypatch):
    """Not only in the next round, which begins after 30 s here."""
    monkeypatch.setattr(procedure_module, "AFTER_FAULT_S", 30.0)
    rig.bench.breaks = [CameraError("No frame came.", "Check the ribbon cable.")]
    rig.press()
    rig.until(lambda: rig.bench.ratio == (0.0, 0.0, 0.0, 0.0))
    assert rig.board.now.fault.code == "E101"


def test_the_light_of_a_press_is_told_with_it_and_the_hours_are_kept(rig):
    """A clock that stands still but for 12.5 s in the lesion press."""
    now_s = [0.0]
    rig.bench.budget._clock = lambda: now_s[0]

    def light(guidance):
        if guidance is Guidance.PRESS_LESION:
            rig.bench.budget.note_lit()
            now_s[0] += 12.5
            rig.bench.budget.note_dark()

    rig.board.on_guidance(light)
    assert rig.press()["light_on_s"] == 12.5
    rig.until(lambda: rig.store.light_on_s == 12.5)
    assert rig.press()["light_on_s"] == 12.5
    rig.until(lambda: rig.store.light_on_s == 25.0)


def test_what_the_counter_was_not_told_yet_is_kept_at_the_end(rig):
    rig.bench.budget._before_s = 3.0
    assert rig.store.light_on_s == 0.0
    rig.procedure.close()
    assert rig.store.light_on_s == 3.0


def test_a_press_that_ran_out_of_light_fails_with_its_code_and_seconds(rig):
    light_two_seconds(rig, max_on_s=1.0)
    job = rig.press()
    assert (job["state"], job["code"], job["light_on_s"]) == ("failed", "E209", 2.0)


def light_two_seconds(rig, max_on_s):
    """Let the light of the press on the lesion be on for 2 s; return the clock of that light."""
    now_s = [0.0]
    budget = rig.bench.budget = LightBudget(max_on_s, clock=lambda: now_s[0])
    rig.procedure._book._budget = budget

    def light(guidance):
        if guidance is Guidance.PRESS_LESION:
            budget.note_lit()
            now_s[0] += 2.0
            budget.note_dark()

    rig.board.on_guidance(light)
    return now_s


def test_no_press_begins_until_the_light_has_rested_by_request_or_by_touch(rig, monkeypatch):
    """2 s of at most 2.1 s are used; the window, 3.15 s, ends after another 1.15 s and more."""
    monkeypatch.setattr(procedure_module, "AFTER_FAULT_S", 0.01)
    now_s = light_two_seconds(rig, max_on_s=2.1)
    assert rig.press()["state"] == "done"
    rig.until(lambda: rig.board.now.fault is not None)
    with pytest.raises(LightRestError, match=r"on for 2 s in the last 3 s, of at most 2.1 s. Wait 2 s"):
        rig.procedure.request()
    rig.bench.is_at_work = True
    assert rig.bench.ratio == (0.0, 0.0, 0.0, 0.0)
    last = rig.board.now.press
    rig.bench.is_at_work = False
    now_s[0] += 2.0
    rig.until(lambda: rig.board.now.fault is None)
    assert rig.board.now.press == last, "a touch has begun one"
    assert rig.press()["state"] == "done"


def test_a_recording_holds_the_frames_of_all_roles_and_where_they_come_from(rig):
    seen = []
    rig.estimator = lambda recording: seen.append(recording) or ANSWER
    rig.press()
    [recording] = seen
    assert [len(recording.with_role(role)) for role in ("dark", "reference", "press")] == [4, 14, 10]
    assert (recording.serial, recording.simulated) == ("TSIS-0000", True)
    assert recording.calibration_id == rig.procedure.calibration.id


def test_a_press_is_taken_and_estimated_in_the_mode_that_was_asked_for(rig):
    """Quick: one frame; the unloaded four and one are lit references."""
    seen = []
    rig.estimator = lambda recording: seen.append(recording) or ANSWER
    job = rig.press("quick")
    assert (job["mode"], rig.modes_asked) == ("quick", ["quick"])
    assert [len(seen[0].with_role(role)) for role in ("reference", "press")] == [5, 1]
    assert rig.store.measurement(job["measurement_id"])["mode"] == "quick"


def test_without_a_mode_that_of_the_settings_holds(rig):
    """Neither the hand that begins a press nor a request has to say one."""
    rig.take_up()
    rig.until(lambda: rig.board.now.press and rig.board.now.press.state == "done")
    assert rig.board.now.press.mode == "paper"
    assert rig.press()["mode"] == "paper"


def test_a_mode_that_this_probe_cannot_answer_in_is_refused_at_once_with_those_it_can(rig):
    with pytest.raises(ModeUnavailable, match="mode precise.*Choose one of those it has: paper, quick, standard"):
        rig.procedure.request("precise")
    assert rig.board.now.press is None
    assert rig.press()["state"] == "done"


def test_a_ramp_begins_with_another_guidance_than_a_hold(rig):
    rig.is_away, told = True, []
    rig.board.on_guidance(told.append)
    job = rig.procedure.request("standard")
    rig.until(lambda: rig.board.now.step == "reference")
    rig.procedure.cancel(job.id)
    rig.until(lambda: rig.store.press(job.id)["state"] == "cancelled")
    assert told[0] is Guidance.TOUCH_BESIDE


def test_a_device_error_in_the_middle_fails_the_press_and_the_probe_recovers(rig):
    shown = []
    rig.board.on_guidance(lambda guidance: shown.append((guidance, rig.board.now.step, rig.board.now.fault)))
    error = CameraError("No frame came.", "Check the ribbon cable.")
    rig.bench.breaks = [error]
    job = rig.press()
    assert job["state"] == "failed"
    assert job["reason"] == "No frame came. Check the ribbon cable."
    assert job["code"] == "E101"
    rig.until(lambda: rig.board.now.step == "ready")
    assert (Guidance.FAULT, "fault", error) in shown
    assert rig.board.now.fault is None
    assert rig.press()["state"] == "done"


def test_a_press_is_refused_with_the_fault_while_the_probe_is_at_fault(rig, monkeypatch):
    monkeypatch.setattr(procedure_module, "AFTER_FAULT_S", 30.0)
    rig.bench.breaks = [CameraError("No frame came.", "Check the ribbon cable.")]
    rig.press()
    rig.until(lambda: rig.board.now.fault)
    for ask in (rig.procedure.request, rig.procedure.require_ready):
        with pytest.raises(CameraError, match="No frame came"):
            ask()


def test_an_error_that_nobody_foresaw_fails_the_press_and_the_next_one_is_taken(rig, caplog):
    def stumble(recording):
        raise ZeroDivisionError("unforeseen")

    rig.estimator = stumble
    job = rig.press()
    assert job["state"] == "failed"
    assert "unforeseen" in job["reason"]
    rig.until(lambda: rig.board.now.step == "ready")
    rig.estimator = lambda recording: ANSWER
    assert rig.press()["state"] == "done"


def test_a_measurement_that_the_disk_does_not_take_fails_the_press(rig, monkeypatch):
    def full(record, recording, **how):
        raise StorageError("The disk is full.", "Free space.")

    monkeypatch.setattr(rig.store, "add_measurement", full)
    job = rig.press()
    assert (job["state"], job["measurement_id"], job["code"]) == ("failed", None, "E601")
    assert "The disk is full" in job["reason"]
    assert rig.board.now.answer is None


def test_the_answer_is_shown_before_the_disk_has_it_and_has_its_id_only_after(rig, monkeypatch):
    seen, add = [], rig.store.add_measurement

    def look_and_add(record, recording, **how):
        seen.append(rig.board.now)
        return add(record, recording, **how)

    monkeypatch.setattr(rig.store, "add_measurement", look_and_add)
    job = rig.press()
    [status] = seen
    assert (status.step, status.press.state, status.measurement_id) == ("computing", "computing", None)
    assert status.answer["estimate"] == ANSWER.as_record()
    assert rig.board.now.answer is None
    kept = rig.store.measurement(job["measurement_id"])
    assert {name: kept[name] for name in status.answer} == status.answer


def test_frames_are_encoded_before_the_answer_and_forgotten_after_it(rig):
    held = []
    rig.estimator = lambda recording: held.append((rig.procedure._encoded.held, len(recording.frames))) or ANSWER
    rig.press()
    [(encoded, kept)] = held
    assert encoded == kept == 28
    rig.until(lambda: rig.procedure._encoded.held == 0)


def test_a_store_at_fault_does_not_leave_the_press_under_way_for_ever(rig, monkeypatch):
    """From the middle of a press the store takes nothing: on the board the press still ends."""

    disk_is_full = threading.Event()

    def if_there_is_space(keep):
        def keeping(*arguments, **named):
            if disk_is_full.is_set():
                raise StorageError("The disk is full.", "Free space.")
            return keep(*arguments, **named)

        return keeping

    def fill_disk(recording):
        disk_is_full.set()
        return ANSWER

    for name in ("save_press", "add_measurement"):
        monkeypatch.setattr(rig.store, name, if_there_is_space(getattr(rig.store, name)))
    rig.estimator = fill_disk
    rig.press()
    assert rig.board.now.press.state == "failed"
    disk_is_full.clear()
    rig.estimator = lambda recording: ANSWER
    rig.until(lambda: rig.board.now.step == "ready")
    assert rig.press()["state"] == "done"


def test_one_request_sent_by_many_at_once_is_one_press(rig):
    """Whoever comes second neither starts a press nor is told that the probe is busy."""
    once, answers = AskedOnce("k-1", "POST presses"), []
    rig.is_away = True
    senders = [
        threading.Thread(target=lambda: answers.append(rig.procedure.request_once(once, "quick"))) for _ in range(8)
    ]
    for sender in senders:
        sender.start()
    for sender in senders:
        sender.join()
    assert {one["id"] for one in answers} == {rig.board.now.press.id}
    assert [one["state"] for one in answers] == ["waiting"] * 8
    rig.procedure.cancel(answers[0]["id"])
    rig.until(lambda: rig.board.now.press.state == "cancelled")
    assert rig.procedure.request_once(once, "quick")["state"] == "waiting"


def test_a_press_of_an_exam_ends_in_a_measurement_of_it_and_a_free_press_in_one_of_none(rig):
    exam = rig.store.exams.make(ExamContent(kind="patient", patient_ref="A-1", operator="Ada"))
    job = rig.procedure.request("quick", exam=AskedExam(exam["id"], version=1))
    rig.until(lambda: not rig.bench.is_at_work and rig.board.now.press.state in ENDED)
    kept = rig.store.measurement(rig.store.press(job.id)["measurement_id"])
    assert (kept["exam_id"], rig.store.press(job.id)["exam_id"]) == (exam["id"], exam["id"])
    free = rig.press("quick")
    assert rig.store.measurement(free["measurement_id"])["exam_id"] is None
    assert rig.store.measurements(before_seq=9, limit=9, exam_id=exam["id"]) == [kept]


def test_a_press_of_an_exam_that_is_not_there_or_was_changed_since_it_was_shown_does_not_begin(rig):
    """As from a tab that still shows the patient before."""
    exam = rig.store.exams.make(ExamContent(kind="patient", patient_ref="A-1", operator="Ada"))
    rig.store.exams.change(exam["id"], {"patient_ref": "B-2"}, version=1, by="Ada", reason="Another patient")
    with pytest.raises(StaleVersion):
        rig.procedure.request("quick", exam=AskedExam(exam["id"], version=1))
    with pytest.raises(UnknownResource, match="no exam none"):
        rig.procedure.request("quick", exam=AskedExam("none"))
    assert rig.board.now.press is None


def test_a_request_that_was_refused_may_be_sent_again_with_its_key(rig):
    once = AskedOnce("k-1", "POST presses")
    with pytest.raises(ModeUnavailable):
        rig.procedure.request_once(once, "precise")
    assert rig.procedure.request_once(once, "quick")["mode"] == "quick"


def test_a_request_that_the_store_does_not_take_starts_no_press(rig, monkeypatch):
    def full(record, once=None, exam=None):
        raise StorageError("The disk is full.", "Free space.")

    with monkeypatch.context() as broken:
        broken.setattr(rig.store, "save_press", full)
        with pytest.raises(StorageError):
            rig.procedure.request()
    assert rig.press()["state"] == "done"


def test_a_recording_that_cannot_be_estimated_rejects_the_press_with_the_reason(rig):
    def refuse(recording):
        raise InvalidQuantity("press frames", 0, "at least one", "press again")

    rig.estimator = refuse
    job = rig.press()
    assert job["state"] == "rejected"
    assert job["reason"] == "press frames is 0, but must be at least one: press again."
    assert rig.board.now.fault is None


def test_only_one_press_at_a_time(rig):
    held = threading.Event()
    rig.estimator = lambda recording: (held.wait(5.0), ANSWER)[1]
    job = rig.procedure.request()
    with pytest.raises(BusyError):
        rig.procedure.request()
    held.set()
    rig.until(lambda: rig.store.press(job.id)["state"] == "done")


def test_a_press_is_cancelled_by_its_own_id_only(rig):
    rig.is_away = True
    job = rig.procedure.request()
    with pytest.raises(UnknownResource, match="Press another is not under way"):
        rig.procedure.cancel("another")
    rig.procedure.cancel(job.id)
    rig.until(lambda: rig.store.press(job.id)["state"] == "cancelled")
    with pytest.raises(UnknownResource):
        rig.procedure.cancel(job.id)


def test_a_press_whose_result_is_being_computed_is_not_cancelled_any_more(rig):
    computing, held = threading.Event(), threading.Event()

    def compute(recording):
        computing.set()
        held.wait(5.0)
        return ANSWER

    rig.estimator = compute
    job = rig.procedure.request()
    assert computing.wait(5.0)
    with pytest.raises(BusyError, match="result is being computed"):
        rig.procedure.cancel(job.id)
    held.set()
    rig.until(lambda: rig.store.press(job.id)["state"] == "done")


def test_a_press_begins_by_itself_when_the_probe_touches(rig):
    """No request: the operator just presses."""
    rig.take_up()
    rig.until(lambda: rig.board.now.press and rig.board.now.press.state == "done")


def test_closing_in_the_middle_of_a_press_says_how_it_ended(tmp_path):
    rig = Rig(tmp_path)
    rig.is_away = True
    job = rig.procedure.request()
    rig.until(lambda: rig.store.press(job.id)["state"] == "capturing")
    rig.procedure.close()
    assert rig.store.press(job.id)["state"] == "failed"
    assert rig.bench.is_closed
    rig.store.close()


def test_the_settings_of_camera_and_load_cell_are_in_the_recording(rig):
    seen = []
    rig.estimator = lambda recording: seen.append(recording) or ANSWER
    rig.press()
    camera, cell = seen[0].camera, seen[0].cell
    assert (camera.width_px, camera.height_px, camera.exposure_us) == (64, 64, CONFIG.camera.exposure_us)
    assert (cell.counts_per_n, cell.tare_counts) == (CONFIG.cell.sensitivity_counts_per_n, None)


def test_a_press_that_is_asked_for_while_the_probe_fails_ends_with_the_fault(rig, monkeypatch):
    """The fault comes between the request and the press: nobody waits for it in vain."""
    broken = pytest.MonkeyPatch()

    def fail_when_asked(*told):
        rig.until(lambda: rig.procedure._requests._waiting)
        broken.undo()
        raise CameraError("No frame came.", "Check the ribbon cable.")

    broken.setattr(rig.procedure._capture, "unloaded", fail_when_asked)
    assert rig.press()["state"] == "done"  # its unloaded frames were taken before
    job = rig.procedure.request()
    rig.until(lambda: rig.store.press(job.id)["state"] in ENDED)
    assert rig.store.press(job.id)["code"] == "E101"
    rig.until(lambda: rig.board.now.step == "ready")


def test_a_full_disk_is_a_fault_before_a_press_and_over_when_there_is_space(rig, monkeypatch):
    def full(free_mb):
        raise DiskFullError("The disk is full.", "Free space.")

    with monkeypatch.context() as filled:
        filled.setattr(rig.store, "require_space", full)
        rig.press()
        rig.until(lambda: rig.board.now.fault and rig.board.now.fault.code == "E602")
    rig.until(lambda: rig.board.now.step == "ready")
    assert rig.press()["state"] == "done"


def test_a_warning_stays_with_the_press_and_its_measurement_and_is_gone_with_the_next(rig, monkeypatch):
    warning = ClockJumpError("The clock was set by +3600.0 s.", "Check it.")
    with monkeypatch.context() as jumped:
        jumped.setattr(rig.procedure._clock, "warning", lambda: warning if rig.bench.is_at_work else None)
        job = rig.press()
    assert job["state"] == "done"
    assert job["warnings"] == rig.store.measurement(job["measurement_id"])["warnings"] == [warning.as_record()]
    assert rig.board.now.warnings == (warning,)
    assert rig.press()["warnings"] == []


def test_a_warning_between_two_presses_is_told_once_and_with_the_next_press(rig):
    warning = ClockJumpError("The clock was set by +3600.0 s.", "Check it.")
    rig.until(lambda: rig.board.now.step == "ready")
    for _ in range(2):
        rig.procedure._book.warn(warning)
    assert rig.board.now.warnings == (warning,)
    assert rig.press()["warnings"] == [warning.as_record()]
    assert rig.press()["warnings"] == []


def test_a_warning_that_lasts_is_told_with_every_press_beside_those_of_one_press(rig):
    lasting = LastGoodConfigError("The settings files are bad.", "Correct them.")
    rig.board.update(warnings=(lasting,))
    rig.procedure._book.warn(ClockJumpError("The clock was set by +3600.0 s.", "Check it."))
    told = [[warning["code"] for warning in rig.press()["warnings"]] for _ in range(3)]
    assert told == [["E002", "E701"], ["E002"], ["E002"]]


def test_light_that_lost_a_tenth_between_two_presses_is_warned_of(rig):
    assert rig.press()["warnings"] == []
    rig.bench.brightness = 0.4
    job = rig.press()
    assert job["state"] == "done"
    assert [warning["code"] for warning in job["warnings"]] == ["E206"]


def test_a_side_that_the_loop_drives_harder_is_compared_with_the_certificate_under_its_own_light(rig, monkeypatch):
    """The press has the loop's light, its unloaded frames too; what is compared has the certificate's 0.6."""
    harder, compared, recorded = (0.9, 0.6, 0.6, 0.6), [], []
    judge = rig.procedure.calibration.require_no_drift
    monkeypatch.setattr(
        rig.procedure.calibration, "require_no_drift", lambda frames: (compared.append(frames), judge(frames))
    )
    rig.estimator = lambda recording: recorded.append(recording) or ANSWER
    rig.procedure._brightness.ratio = harder
    assert [rig.press()["state"] for _ in range(2)] == ["done", "done"]
    assert {frame.led_ratio for frame in compared[-1] if frame.role == "reference"} == {(0.6, 0.6, 0.6, 0.6)}
    assert {frame.led_ratio for frame in recorded[-1].frames if frame.role != "dark"} == {harder}
    assert rig.board.now.fault is None


@pytest.fixture
def held_self_test(rig, monkeypatch):
    """A self-test of one check, which goes on until it is let go."""
    go_on = threading.Event()

    def results(job):
        assert go_on.wait(10.0)
        yield [CheckResult("Light", "LED +x", "passed")]

    monkeypatch.setattr(rig.procedure._self_tests._test, "results", results)
    yield go_on
    go_on.set()


def test_a_self_test_runs_between_presses_which_are_refused_meanwhile(rig, held_self_test):
    rig.procedure.request_self_test()
    rig.until(lambda: rig.board.now.step == "self_test")
    with pytest.raises(BusyError, match="self-test"):
        rig.procedure.request()
    held_self_test.set()
    rig.until(lambda: rig.board.now.step == "ready")
    assert (rig.procedure.self_test.state, rig.procedure.self_test.verdict) == ("done", "passed")
    assert rig.press()["state"] == "done"


def test_a_self_test_is_refused_during_a_press_with_the_code_of_it(rig):
    rig.is_away = True
    job = rig.procedure.request()
    with pytest.raises(BusyError) as refusal:
        rig.procedure.request_self_test()
    assert refusal.value.code == "E801"
    rig.procedure.cancel(job.id)
    rig.until(lambda: rig.store.press(job.id)["state"] in ENDED)
    with pytest.raises(UnknownResource):
        _ = rig.procedure.self_test


def test_a_self_test_runs_while_the_probe_is_at_fault(rig, held_self_test):
    rig.store.require_space = lambda free_mb: (_ for _ in ()).throw(StorageError("The disk is gone.", "Check it."))
    rig.bench.breaks = [CameraError("No frame came.", "Check the ribbon cable.")]
    rig.press()
    rig.until(lambda: rig.board.now.fault is not None)
    held_self_test.set()
    rig.procedure.request_self_test()
    rig.until(lambda: not rig.procedure.self_test.is_under_way)
    assert rig.procedure.self_test.state == "done"
    rig.until(lambda: rig.board.now.step == "fault")


def test_a_zero_that_looks_like_a_touch_is_tared_and_the_probe_takes_presses_again(rig):
    """It drifts past the contact force, 0.05 N, during a press, after which the probe waits to be lifted."""
    rig.estimator = lambda recording: (setattr(rig.bench, "zero_n", 0.06), ANSWER)[1]
    rig.press()
    rig.estimator = lambda recording: ANSWER
    assert rig.procedure.tare() == 0.06
    assert rig.press()["state"] == "done"


def test_a_zero_that_creeps_is_taken_off_before_each_press(rig):
    """By 4 mN, which would move a depth by more than its interval."""
    rig.bench.zero_n = 0.004
    rig.press()  # the unloaded frames of this one were taken before
    rig.until(lambda: rig.bench.zero_n == pytest.approx(0.002))
    rig.press()
    rig.until(lambda: rig.bench.zero_n == pytest.approx(0.0))
    job = rig.press()
    recording = read_recording(rig.store.recording_path(rig.store.measurement(job["measurement_id"])["recording_id"]))
    assert {round(frame.force_n, 9) for frame in recording.with_role("press")} == {0.5}
    assert [one.code for one in rig.board.now.warnings] == []


def test_a_zero_that_may_be_a_touch_is_told_and_left_as_it_is(rig):
    rig.bench.zero_n = 0.02
    rig.press()
    rig.until(lambda: "E309" in [one.code for one in rig.board.now.warnings])
    assert rig.bench.zero_n == 0.02
    rig.procedure.tare()
    rig.until(lambda: "E309" not in [one.code for one in rig.board.now.warnings])


def test_a_fault_of_the_cell_is_over_when_it_reads_again_though_the_probe_is_touched(rig):
    """Its cable was pulled, and is plugged in again while something rests on the face."""
    rig.bench.breaks = [LoadCellError("The load cell is silent.", "Check its cable.")]
    rig.bench.is_at_work, step_of = False, lambda: (rig.board.now.step, rig.board.now.guidance)
    rig.board.on_guidance(lambda guidance: setattr(rig.bench, "zero_n", 0.2) if guidance is Guidance.FAULT else None)
    rig.press()
    rig.until(lambda: step_of() == ("starting", Guidance.LIFT))
    assert rig.board.now.fault is None
    rig.bench.zero_n = 0.0
    rig.until(lambda: rig.board.now.step == "ready")


def test_a_tare_that_was_taken_under_a_load_is_a_fault_until_the_next(rig):
    rig.estimator = lambda recording: (setattr(rig.bench, "zero_n", -0.15), ANSWER)[1]
    rig.press()
    rig.estimator = lambda recording: ANSWER
    rig.until(lambda: rig.board.now.fault is not None)
    assert rig.board.now.fault.code == "E306"
    assert "-0.150 N: its zero was taken under a load" in str(rig.board.now.fault)
    rig.procedure.tare()
    rig.until(lambda: rig.board.now.fault is None)
    assert rig.press()["state"] == "done"


def test_a_press_that_waits_for_a_probe_that_is_never_lifted_is_cancelled_and_tared(rig):
    """Nothing touches it: its zero has come past a touch, so that it waits to be lifted for ever."""
    rig.estimator = lambda recording: (setattr(rig.bench, "zero_n", 0.06), ANSWER)[1]
    rig.press()
    job = rig.procedure.request()
    with pytest.raises(BusyError, match="A press is under way"):
        rig.procedure.tare()
    rig.procedure.cancel(job.id)
    rig.until(lambda: rig.store.press(job.id)["state"] == "cancelled")
    rig.estimator = lambda recording: ANSWER
    rig.procedure.tare()
    assert rig.press()["state"] == "done"


def test_the_untouched_face_of_a_press_after_a_tare_is_taken_anew(rig, monkeypatch):
    """The forces of its frames would count from the zero of before."""
    taken, unloaded = [], rig.procedure._capture.unloaded
    monkeypatch.setattr(rig.procedure._capture, "unloaded", lambda *told: taken.append(unloaded(*told)) or taken[-1])
    rig.bench.zero_n = 0.02
    rig.press()
    rig.until(lambda: taken)
    rig.procedure.tare()
    job = rig.press()
    recording = read_recording(rig.store.recording_path(rig.store.measurement(job["measurement_id"])["recording_id"]))
    assert {frame.force_n for frame in recording.with_role("dark")} == {0.0}


def test_a_tare_is_refused_during_a_press_and_a_self_test(rig, held_self_test):
    rig.is_away, rig.bench.zero_n = True, 0.02
    job = rig.procedure.request()
    with pytest.raises(BusyError, match="A press is under way"):
        rig.procedure.tare()
    rig.procedure.cancel(job.id)
    rig.until(lambda: rig.store.press(job.id)["state"] in ENDED)
    rig.procedure.request_self_test()
    with pytest.raises(BusyError, match="self-test"):
        rig.procedure.tare()
    assert rig.bench.zero_n == 0.02
    held_self_test.set()


def test_a_tare_that_is_refused_by_the_cell_changes_nothing(rig, monkeypatch):
    def held():
        raise ZeroShiftError("The zero is 2 N off.", "Lift the probe.")

    monkeypatch.setattr(rig.bench, "retare", held)
    with pytest.raises(ZeroShiftError):
        rig.procedure.tare()
    assert rig.board.now.step == "ready"
    assert rig.press()["state"] == "done"


@pytest.mark.parametrize("weight_n", [0.09, 5.1, float("nan")])
def test_a_weight_that_cannot_be_measured_is_refused(rig, weight_n):
    """Contact is 0.05 N, and the cell bears 5 N."""
    with pytest.raises(InvalidQuantity, match="weight_n"):
        rig.procedure.request_self_test(weight_n=weight_n)


def test_a_probe_whose_certificate_has_expired_runs_and_says_so_and_takes_no_press(rig, monkeypatch):
    expired = ExpiredCalibration("The calibration has expired.", "Calibrate the probe.")

    def require_valid(now):
        raise expired

    with monkeypatch.context() as later:
        later.setattr(rig.procedure.calibration, "require_valid", require_valid)
        rig.press()
        rig.until(lambda: rig.board.now.fault is expired)
        with pytest.raises(ExpiredCalibration):
            rig.procedure.request()
    rig.until(lambda: rig.board.now.step == "ready")
    assert rig.press()["state"] == "done"


def test_warnings_of_the_certificate_are_told_with_every_press_until_they_are_over(rig):
    warning = CalibrationEndsSoon("The calibration expires soon.", "Calibrate the probe.")
    rig.procedure.calibration.warned = lambda others: (warning,)
    rig.press()
    assert [rig.press()["warnings"] for _ in range(2)] == [[warning.as_record()]] * 2
    rig.procedure.calibration.warned = lambda others: ()
    rig.press()
    assert rig.press()["warnings"] == []


def test_the_store_is_written_as_a_proof_between_presses_and_never_in_one(rig, monkeypatch):
    """Each second it is read; a write while frames are taken might hold them up."""
    monkeypatch.setattr(progress_module, "BEAT_S", 0.0)
    monkeypatch.setattr(procedure_module, "WRITE_EVERY_S", 0.0)
    seen = []

    def prove(*, writing):
        seen.append((rig.board.now.press is None or rig.board.now.press.state in ENDED, writing))

    monkeypatch.setattr(rig.store, "prove", prove)
    rig.until(lambda: len(seen) > 2)
    rig.press()
    assert {(True, True), (False, False)} <= set(seen)
    assert all(is_idle == writing for is_idle, writing in seen)


def test_a_store_that_cannot_be_written_is_a_fault_and_not_ready(rig, monkeypatch):
    def refuse(*, writing):
        raise StorageError("The disk is read-only.", "Check it.")

    monkeypatch.setattr(progress_module, "BEAT_S", 0.0)
    rig.until(lambda: rig.procedure.parts()["store"].ready)
    with monkeypatch.context() as failing:
        failing.setattr(rig.store, "prove", refuse)
        rig.until(lambda: rig.board.now.fault is not None)
        assert rig.procedure.parts()["store"] == PartHealth(False, "E601")
    rig.until(lambda: rig.procedure.parts()["store"].ready)


def test_a_stop_before_the_untouched_probe_was_seen_is_no_fault(rig, caplog):
    rig.procedure.stop()
    rig.procedure._thread.join()
    rig.procedure._capture._untouched_frames = lambda: []  # what a stop leaves of them
    rig.procedure._one_press()
    assert rig.board.now.fault is None
    assert not [record for record in caplog.records if record.levelname == "ERROR"]
