"""What a press's frames say is kept whole, recording and measurement, or not at all."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_certificate import small_certificate
from stand_in_adviser import advice, no_advice

from device.config import CameraSection, Config
from device.errors import DeviceError, DimLightError, StorageError
from device.files.recording_file import read_picture, read_recording
from device.instrument.press.probe_answers import Adviser, Estimator, ProbeAnswers
from device.instrument.press.record import PressAnswer, PressAnswers
from device.instrument.press.scan import ScanTaken
from device.instrument.status import PressJob
from device.instrument.watch.calibration_watch import CalibrationWatch
from device.instrument.watch.progress import ProgressBoard
from device.measurement.estimate import UNKNOWN_QUANTITY, Estimate
from device.measurement.quantities import Inclusion, InvalidQuantity
from device.measurement.recording.tactile_image import Frame
from device.records.store import Store

CONFIG = Config(camera=CameraSection(width_px=64, height_px=64))
FRAMES = [Frame(np.full((64, 64), 9, np.uint8), role, 0.0, 0.5, (0.6,) * 4) for role in ("dark", "reference", "press")]
ANSWER = Estimate(*[UNKNOWN_QUANTITY] * 3, "not_identifiable", "A stand-in.", "standard", "m", "00", "c", True, {})
STARTED_AT = "2026-01-02T03:04:05.000Z"


JOB = PressJob("p-1", "quick")


def answers(
    store: Store, estimator: Estimator, truth: Inclusion | None = None, adviser: Adviser = no_advice
) -> PressAnswers:
    watch = CalibrationWatch(small_certificate())
    answers = ProbeAnswers(("quick",), estimator, adviser)
    return PressAnswers(CONFIG, watch, answers, store, ProgressBoard(), truth)


def kept_by(probe: PressAnswers, *warnings: DeviceError) -> dict[str, Any]:
    return keep(probe, probe.answer(FRAMES, JOB, STARTED_AT, warnings), JOB)


def keep(probe: PressAnswers, answer: PressAnswer, job: PressJob) -> dict[str, Any]:
    return probe.keep(answer, replace(job, state="done", measurement_id=answer.measurement_id))


def test_a_measurement_is_kept_with_its_recording_mode_and_warnings(tmp_path: Path) -> None:
    store, warning = Store(tmp_path), DimLightError("Side +x is dim.", "Look at it.")
    kept = kept_by(answers(store, lambda recording, mode: ANSWER), warning)
    assert store.measurement(kept["id"]) == kept
    assert (kept["mode"], kept["taken_at"], kept["warnings"]) == ("quick", STARTED_AT, [warning.as_record()])
    recording = read_recording(store.recording_path(kept["recording_id"]))
    assert [frame.role for frame in recording.frames] == ["dark", "reference", "press"]
    assert recording.calibration_id == small_certificate().id
    assert recording.mode == "quick"
    store.close()


def test_a_press_ends_with_its_measurement_or_both_are_not_kept(tmp_path: Path) -> None:
    store, shown = Store(tmp_path), []
    probe = answers(store, lambda recording, mode: ANSWER)
    answer = probe.answer(FRAMES, JOB, STARTED_AT, [])
    done = replace(JOB, state="done", measurement_id=answer.measurement_id)
    store.save_press(JOB.as_record())
    store._db.execute("CREATE TRIGGER full BEFORE INSERT ON press BEGIN SELECT RAISE(ABORT, 'full'); END")
    with pytest.raises(StorageError, match="full"):
        probe.keep(answer, done, lambda: shown.append("kept"))
    assert (shown, store.press("p-1")["state"], store.measurements(before_seq=9, limit=9)) == ([], "waiting", [])
    store._db.execute("DROP TRIGGER full")
    kept = probe.keep(answer, done, lambda: shown.append("kept"))
    assert (shown, store.press("p-1")["measurement_id"]) == (["kept"], kept["id"])
    assert store.audit.entries(before_seq=99, limit=1)[0]["after"]["measurement_id"] == kept["id"]
    store.close()


def test_an_answer_is_kept_nowhere_and_has_nothing_to_ask_for_it_by(tmp_path: Path) -> None:
    store = Store(tmp_path)
    answer = answers(store, lambda recording, mode: ANSWER).answer(FRAMES, JOB, STARTED_AT, [])
    told = {"taken_at": STARTED_AT, "mode": "quick", "estimate": ANSWER.as_record(), "truth": None}
    assert answer.shown == told | {"ramps": 1, "reached": None}
    assert store.measurements(before_seq=1000, limit=10) == []
    assert list((tmp_path / "recordings").iterdir()) == []
    store.close()


def test_the_picture_is_kept_with_the_measurement_and_a_press_without_one_is_kept_all_the_same(tmp_path: Path) -> None:
    store = Store(tmp_path)
    probe = answers(store, lambda recording, mode: ANSWER)
    paths = [store.recording_path(kept_by(probe)["recording_id"])]
    untouched = [replace(frame, force_n=0.0) for frame in FRAMES]
    kept = keep(probe, probe.answer(untouched, JOB, STARTED_AT, []), JOB)
    paths.append(store.recording_path(kept["recording_id"]))
    assert [(read_picture(path) or b"")[1:4] for path in paths] == [b"PNG", b""]
    store.close()


def test_a_scan_is_kept_with_its_last_advice_what_was_asked_for_and_how_often_it_pressed(tmp_path: Path) -> None:
    """Its estimate is that of the advice: nothing is computed twice."""
    store, seen, last = Store(tmp_path), [], advice(1.5)
    frames = [*FRAMES, replace(FRAMES[-1], ramp=1), replace(FRAMES[-1], ramp=1)]
    probe = answers(store, lambda recording, mode: pytest.fail("asked"), adviser=lambda one: seen.append(one) or last)
    assert probe.advise(frames, STARTED_AT) is last
    assert {ramp: len(of_ramp) for ramp, of_ramp in seen[0].ramps().items()} == {0: 1, 1: 2}
    job = PressJob("p-2", "precise", until={"size_mm": 1.0}, within_s=30.0)
    kept = keep(probe, probe.answer(frames, job, STARTED_AT, [], ScanTaken(frames[2:], last, False, 0.0, None)), job)
    assert (kept["mode"], kept["ramps"], kept["frames"]) == ("precise", 2, 3)
    assert (kept["until"], kept["within_s"], kept["reached"]) == ({"size_mm": 1.0}, 30.0, False)
    assert kept["estimate"] == last.estimate.as_record()
    recording = read_recording(store.recording_path(kept["recording_id"]))
    assert (recording.ramps().keys(), recording.mode) == ({0, 1}, "precise")
    store.close()


def test_frames_that_an_estimator_refuses_leave_nothing_behind(tmp_path: Path) -> None:
    def refuse(recording: object, mode: object) -> Estimate:
        raise InvalidQuantity("force_n", 0.1, "at least 0.2 N", "press harder")

    store = Store(tmp_path)
    with pytest.raises(InvalidQuantity, match="press harder"):
        kept_by(answers(store, refuse))
    assert store.measurements(before_seq=1000, limit=10) == []
    store.close()


def test_a_probe_whose_truth_is_known_is_a_simulated_one(tmp_path: Path) -> None:
    store, found = Store(tmp_path), []
    for truth in (None, Inclusion(10.0, 5.0, 80.0)):
        probe = answers(store, lambda recording, mode: found.append(recording) or ANSWER, truth)
        kept_by(probe)
        assert (probe.is_simulated, found[-1].simulated, found[-1].truth) == (truth is not None,) * 2 + (truth,)
    store.close()
