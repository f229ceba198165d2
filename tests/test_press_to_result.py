"""From a press of the simulated probe to a result, through the daemon as a separate process."""

from __future__ import annotations

import io
import json
import sqlite3
import urllib.request
import zipfile
from dataclasses import replace

import pytest
from daemon_process import QUICK_HAND, ROOT, WAIT_S, Daemon, wait_for
from pydantic import BaseModel

from device.assembly.answers import answers_for
from device.assembly.opened_parts import StartFailed
from device.assembly.probe import open_simulated_probe
from device.config import PressSection, simulated_config
from device.errors import StorageError
from device.files.recording_file import read_picture, read_recording
from device.measurement.mode import RAMP_FROM_N, RAMP_TO_N
from device.records.store import Store
from device.simulation.scenario import Scenario
from device.web import app as app  # its models are what answers

pytestmark = pytest.mark.real_time


@pytest.fixture(scope="module")
def job(daemon):
    return daemon.press()


@pytest.fixture(scope="module")
def measurement(daemon, job):
    return daemon.ask(f"/api/v1/measurements/{job['measurement_id']}").json


def test_a_press_ends_in_a_measurement(job):
    assert job["state"] == "done"
    assert job["progress"] == 1.0


def test_size_and_depth_are_near_the_truth_and_inside_their_intervals(measurement):
    """The default inclusion is 12 mm, 6 mm deep: well inside what the probe can see."""
    estimate, truth = measurement["estimate"], measurement["truth"]
    assert truth == {"size_mm": 12.0, "depth_mm": 6.0, "youngs_modulus_kpa": 60.0}
    for name in ("size_mm", "depth_mm"):
        assert estimate[name]["value"] == pytest.approx(truth[name], rel=0.1)
        assert estimate[name]["low"] < estimate[name]["value"] < estimate[name]["high"]
        assert estimate[name]["identifiable"]


def test_whether_the_press_determines_the_modulus_is_said(measurement):
    """Of this inclusion some presses do: one whose interval is the whole range is said not to, and why."""
    estimate = measurement["estimate"]
    modulus = estimate["youngs_modulus_kpa"]
    whole = (modulus["low"], modulus["high"]) == pytest.approx((10.0, 160.0))
    assert modulus["identifiable"] == (not whole)
    assert estimate["status"] == ("partly_identifiable" if whole else "ok")
    assert ("Young's modulus" in estimate["reason"]) == whole


def test_ten_frames_are_taken_over_the_ramp(measurement):
    assert measurement["frames"] == 10
    assert measurement["force_n"] == pytest.approx((RAMP_FROM_N + RAMP_TO_N) / 2, abs=0.05)


def test_without_a_mode_the_press_is_taken_in_that_of_the_settings(daemon, job, measurement):
    assert job["mode"] == measurement["mode"] == daemon.ask("/api/v1/device").json["default_mode"]


def test_the_recording_gives_the_same_estimate_again(daemon, measurement, tmp_path, bundle, calibration):
    """What is kept is what was measured: the zip, analysed elsewhere, has the same answer."""
    content = daemon.ask(f"/api/v1/measurements/{measurement['id']}/recording.zip").body
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        archive.extractall(tmp_path)
    recording = read_recording(tmp_path / measurement["recording_id"])
    assert [len(recording.with_role(role)) for role in ("dark", "reference", "press")] == [4, 14, 10]
    answers = answers_for(simulated_config(), bundle, calibration)
    again = json.loads(json.dumps(answers.estimator(recording, "standard").as_record()))
    assert again == measurement["estimate"]


def test_the_tactile_image_is_a_png_in_true_proportions(daemon, measurement):
    picture = daemon.ask(f"/api/v1/measurements/{measurement['id']}/image.png")
    assert picture.headers["content-type"] == "image/png"
    width, height = (int.from_bytes(picture.body[at : at + 4], "big") for at in (16, 20))
    assert width / height == pytest.approx(768 * 0.03125 / (492 * 0.03646), rel=0.01)


UNANSWERED = "/events", "/live.mjpeg", "/self-test", "/dicom.zip", "/worklist", "/pairing"
"""Streams that do not end, and what there is not: self-test, measurement in the exam, worklist, code to pair by."""


def _models_of(base):
    """Yield every model below a base, of all modules that the daemon's application imports."""
    for one in base.__subclasses__():
        yield one
        yield from _models_of(one)


def test_every_answer_is_as_the_committed_document_says(daemon, job, measurement):
    """Media type and fields; what is null or absent there must be allowed to be."""
    exam = daemon.ask("/api/v1/exams", "POST", {"kind": "phantom", "operator": "Ada"}).json
    document = json.loads((ROOT / "docs" / "openapi.json").read_text(encoding="utf-8"))
    models = {one.__name__: one for one in _models_of(BaseModel) if one.__module__.startswith("device.web")}
    asked = 0
    for path, methods in document["paths"].items():
        if "get" not in methods or path.endswith(UNANSWERED):
            continue
        answer = daemon.ask(path.format(press_id=job["id"], measurement_id=measurement["id"], exam_id=exam["id"]))
        [(media_type, content)] = methods["get"]["responses"]["200"]["content"].items()
        assert (answer.status, answer.headers["content-type"].partition(";")[0]) == (200, media_type), path
        if media_type == "application/json":
            model = models[content["schema"]["$ref"].rpartition("/")[2]]
            said = model.model_validate_json(answer.body)
            assert json.loads(said.model_dump_json(exclude_unset=True)) == answer.json, path
        asked += 1
    assert asked > 10


def test_the_event_stream_tells_the_status(daemon):
    with urllib.request.urlopen(daemon.url + "/api/v1/events", timeout=WAIT_S) as stream:
        assert stream.headers["content-type"].startswith("text/event-stream")
        assert stream.readline() == b"event: status\n"
        status = json.loads(stream.readline().removeprefix(b"data: "))
    assert status["simulated"] is True
    assert status["target_n"] == 0.5


def test_measurements_are_listed_newest_first(daemon, measurement):
    listed = daemon.ask("/api/v1/measurements").json["measurements"]
    assert listed[0]["seq"] == max(m["seq"] for m in listed)
    assert measurement["id"] in [m["id"] for m in listed]


@pytest.mark.parametrize(
    ("path", "method", "body", "status", "code"),
    [
        ("/api/v1/measurements/none", "GET", None, 404, "E802"),
        ("/api/v1/presses/none", "GET", None, 404, "E802"),
        ("/api/v1/presses/none", "DELETE", None, 404, "E802"),
        ("/api/v1/nowhere", "GET", None, 404, "E804"),
        ("/api/v1/measurements?limit=0", "GET", None, 422, "E803"),
        ("/api/v1/measurements?before_seq=99999999999999999999999", "GET", None, 422, "E803"),
        ("/api/v1/presses", "POST", {"force_newton": 3}, 422, "E803"),
        ("/api/v1/presses", "POST", {"mode": "fast"}, 422, "E803"),
    ],
)
def test_bad_requests_are_problem_documents_with_a_remedy(daemon, path, method, body, status, code):
    answer = daemon.ask(path, method, body)
    assert answer.status == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json["code"] == code
    assert answer.json["remedy"]


def test_a_second_press_or_a_tare_is_refused_while_one_is_under_way_and_a_cancelled_one_says_so(daemon):
    first = daemon.ask("/api/v1/presses", "POST", {})
    status = daemon.ask("/api/v1/status").json
    assert (status["press"]["id"], status["measurement_id"]) == (first.json["id"], None)
    second, tare = daemon.ask("/api/v1/presses", "POST", {}), daemon.ask("/api/v1/tare", "POST")
    for refused in (second, tare):
        assert (refused.status, refused.json["code"]) == (409, "E801")
        held = {"kind": "press", "id": first.json["id"], "mode": first.json["mode"], "since": first.json["asked_at"]}
        assert refused.json["holder"] == held
    assert daemon.ask(first.headers["location"], "DELETE").status == 202
    assert daemon.ended(first.headers["location"])["state"] == "cancelled"


@pytest.mark.long
def test_a_probe_that_runs_is_tared_and_presses_on(tmp_path):
    """Twenty readings of 40 counts' noise, twice: 0.1 mN. On a probe of its own: no hand is still leaving it."""
    daemon = Daemon(tmp_path, QUICK_HAND)
    try:
        tare = daemon.ask("/api/v1/tare", "POST")
        assert (tare.status, set(tare.json)) == (200, {"moved_n", "zero_shift_n"})
        assert abs(tare.json["moved_n"]) < 0.001
        assert daemon.press()["state"] == "done"
    finally:
        daemon.stop()


@pytest.mark.long
def test_a_press_interrupted_by_a_stop_is_not_lost(tmp_path):
    """SIGTERM in the middle of a press: exit 0, and the job says how it ended after the next start."""
    daemon = Daemon(tmp_path)
    location = daemon.ask("/api/v1/presses", "POST", {}).headers["location"]
    assert daemon.stop() == 0
    again = Daemon(tmp_path)
    job = again.ask(location).json
    again.stop()
    assert job["state"] == "failed"
    assert "press" in job["reason"]


def test_a_kill_loses_no_measurement(tmp_path):
    daemon = Daemon(tmp_path, QUICK_HAND)
    job = daemon.press()
    daemon.process.kill()
    daemon.stop()
    with sqlite3.connect(tmp_path / "var" / "tsis.sqlite") as db:
        [(identifier, record)] = db.execute("SELECT id, record FROM measurement").fetchall()
    db.close()
    assert identifier == job["measurement_id"]
    recording = tmp_path / "var" / "recordings" / f"{json.loads(record)['recording_id']}.zip"
    assert len(read_recording(recording).with_role("press")) == 10
    assert (read_picture(recording) or b"")[1:4] == b"PNG"


@pytest.mark.long
def test_a_kill_loses_no_exam_no_act_and_no_entry_of_the_audit(tmp_path):
    """Each is killed as soon as it is acknowledged, and each time all is there that was."""
    said = {"kind": "patient", "patient_ref": "A-17", "operator": "Ada"}
    because, daemon = {"by": "Ada", "reason": "Mixed up"}, Daemon(tmp_path, QUICK_HAND)

    def after_a_kill():
        daemon.process.kill()
        daemon.stop()
        return Daemon(tmp_path, QUICK_HAND)

    exam = daemon.ask("/api/v1/exams", "POST", said).json
    daemon = after_a_kill()
    assert daemon.ask(f"/api/v1/exams/{exam['id']}").json == exam
    press = daemon.ask("/api/v1/presses", "POST", {"exam_id": exam["id"]}, headers={"If-Match": '"1"'})
    path = f"/api/v1/measurements/{daemon.ended(press.headers['location'])['measurement_id']}"
    daemon = after_a_kill()
    assert daemon.ask(path).json["exam_id"] == exam["id"]
    body = {"changes": {"side": "left"}, **because}
    changed = daemon.ask(f"/api/v1/exams/{exam['id']}", "PATCH", body, headers={"If-Match": '"1"'}).json
    daemon = after_a_kill()
    voided = daemon.ask(f"{path}/void", "POST", because, headers={"If-Match": '"1"'}).json
    daemon = after_a_kill()
    assert daemon.ask(f"/api/v1/exams/{exam['id']}").json == changed == exam | {
        "side": "left", "version": 2, "changed_at": changed["changed_at"]
    }  # fmt: skip
    assert daemon.ask(path).json == voided
    told = [entry["what"] for entry in daemon.ask("/api/v1/audit").json["entries"]]
    daemon.stop()
    acts = [what for what in told if what.startswith(("exam_", "measurement_"))]
    assert acts == ["measurement_voided", "exam_changed", "exam_made"]
    assert {"press_begun", "press_ended", "settings_changed"} <= set(told)
    assert "audit whole" in daemon.log_text()


def test_a_press_with_a_key_is_started_once_also_over_a_kill(tmp_path):
    daemon, key = Daemon(tmp_path), {"Idempotency-Key": "k-1"}
    first = daemon.ask("/api/v1/presses", "POST", {}, headers=key)
    again = daemon.ask("/api/v1/presses", "POST", {}, headers=key)
    other = daemon.ask("/api/v1/presses", "POST", {"mode": "quick"}, headers=key)
    daemon.process.kill()
    daemon.stop()
    daemon = Daemon(tmp_path)
    replayed = daemon.ask("/api/v1/presses", "POST", {}, headers=key)
    status, job = daemon.ask("/api/v1/status").json, daemon.ask(first.headers["location"]).json
    daemon.stop()
    answers = {(one.status, one.headers["location"], one.body) for one in (first, again, replayed)}
    assert answers == {(202, f"/api/v1/presses/{job['id']}", first.body)}
    assert (other.status, other.json["code"]) == (409, "E810")
    assert (status["press"], job["state"]) == (job, "failed")


def test_a_daemon_whose_certificate_has_expired_serves_and_refuses_presses_with_its_code(tmp_path):
    daemon = Daemon(tmp_path, '[[faults]]\nkind = "clock_jump"\nstep_s = 2e9\n')
    status = wait_for(lambda: daemon.ask("/api/v1/status").json, lambda status: status["faults"])
    press, ready = daemon.ask("/api/v1/presses", "POST", {}), daemon.ask("/api/v1/health/ready")
    known = daemon.ask("/api/v1/calibrations").json
    daemon.stop()
    assert ([fault["code"] for fault in status["faults"]], status["guidance"]["code"]) == (["E404"], "fault")
    assert [(one.status, one.json["code"]) for one in (press, ready)] == [(503, "E404")] * 2
    assert known["active"] == known["in_use"] == known["calibrations"][0]["id"]


def test_a_second_daemon_on_the_same_data_is_refused_and_ends_no_press(tmp_path):
    daemon = Daemon(tmp_path)
    location = daemon.ask("/api/v1/presses", "POST", {}).headers["location"]
    with pytest.raises(StorageError, match="in use by another daemon"):
        Store(tmp_path / "var")
    assert daemon.ask(location).json["state"] in ("waiting", "capturing")
    daemon.stop()


def test_a_force_that_the_calibration_does_not_hold_for_is_refused_at_the_start(tmp_path):
    config = replace(simulated_config(), data=tmp_path, press=PressSection(target_n=0.7))
    with pytest.raises(StartFailed, match="press.target_n is 0.7"):
        open_simulated_probe(config, Scenario())


@pytest.mark.long
def test_the_screen_keeps_saying_done_until_the_next_press(daemon):
    daemon.press()
    assert daemon.ask("/api/v1/status").json["guidance"]["code"] == "done"
