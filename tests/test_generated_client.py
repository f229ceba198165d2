"""A client that is generated from the committed document does a PC's whole work on a running probe, in its types."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import cv2
import numpy as np
import pytest
from daemon_process import Daemon, wait_for
from generated_client import generated_client

pytestmark = [pytest.mark.real_time, pytest.mark.long]


@pytest.fixture(scope="module")
def client(daemon: Daemon, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    with generated_client(tmp_path_factory.mktemp("client")) as made, made.Client(daemon.url) as opened:
        yield opened


def route(name: str) -> ModuleType:
    """Return the module of an operation, such as `exams.list_exams`."""
    return import_module(f"tsis_client.api.{name}")


def models() -> ModuleType:
    return import_module("tsis_client.models")


def asked(name: str, client: Any, *path: str, **query: Any) -> Any:
    """Return the typed answer of an operation, which must not be a problem."""
    answer = route(name).sync(*path, client=client, **query)
    assert answer is not None
    assert type(answer).__name__ != "Problem", answer
    return answer


@pytest.fixture(scope="module")
def exam(client: Any) -> Any:
    content = models().ExamContent.from_dict({"kind": "patient", "operator": "Ada", "patient_ref": "A-17"})
    return asked("exams.make_exam", client, body=content)


@pytest.fixture(scope="module")
def measurement(client: Any, exam: Any) -> Any:
    """Press for the exam, wait for the end, and return what was measured."""
    wait_for(lambda: type(route("health.get_readiness").sync(client=client)).__name__, lambda name: name == "Readiness")
    asking = models().PressRequest.from_dict({"mode": "quick", "exam_id": exam.id})
    press = asked("presses.start_press", client, body=asking, idempotency_key="of-this-test")
    ended = wait_for(
        lambda: asked("presses.get_press", client, press.id),
        lambda job: job.state in ("done", "rejected", "cancelled", "failed"),
    )
    assert ended.state == "done", ended
    return asked("measurements.get_measurement", client, ended.measurement_id)


def test_it_finds_the_exam_that_it_made(client, exam):
    assert [one.id for one in asked("exams.list_exams", client, patient_ref="A-17").exams] == [exam.id]


def test_the_measurement_is_the_exams_and_has_types(client, exam, measurement):
    assert measurement.exam_id == exam.id
    listed = asked("measurements.list_measurements", client, exam_id=exam.id)
    assert [one.id for one in listed.measurements] == [measurement.id]
    size = measurement.estimate.size_mm
    assert size.low <= size.value <= size.high
    assert (
        measurement.features.additional_properties
        == asked("measurements.get_features", client, measurement.id).additional_properties
    )


def test_it_downloads_the_picture_and_the_recording_as_bytes(client, measurement, tmp_path: Path):
    png = asked("measurements.get_image", client, measurement.id).payload.read()
    picture = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_UNCHANGED)
    assert picture.shape[1] == 480
    content = asked("measurements.get_recording", client, measurement.id).payload.read()
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        assert f"{measurement.recording_id}/recording.json" in archive.namelist()


def test_a_change_leaves_what_it_does_not_name(client):
    content = {"kind": "patient", "operator": "Ada", "patient_ref": "A-18", "note": "Allergic to latex."}
    exam = asked("exams.make_exam", client, body=models().ExamContent.from_dict(content))
    change = models().ExamChange("Ada", "Forgotten", models().ExamFields(side=models().ExamFieldsSideType0.LEFT))
    changed = asked("exams.change_exam", client, exam.id, body=change, if_match='"1"')
    assert (changed.side, changed.note, changed.version) == ("left", "Allergic to latex.", 2)


def test_what_takes_no_body_is_asked_for_without_one(client, measurement):
    taken = wait_for(lambda: route("device.take_tare").sync(client=client), lambda told: type(told).__name__ == "Tare")
    assert isinstance(taken.moved_n, float)
    refused = route("presses.finish_scan").sync("none", client=client)
    assert (type(refused).__name__, refused.code) == ("Problem", "E802")
    press = asked("presses.start_press", client)
    assert asked("presses.cancel_press", client, press.id).id == press.id


def test_what_is_refused_is_the_one_problem(client):
    problem = route("exams.get_exam").sync("none", client=client)
    assert (type(problem).__name__, problem.code, problem.status) == ("Problem", "E802", 404)
    assert problem.remedy


def test_it_downloads_the_measurements_as_table_arrays_and_recordings(client, exam, measurement):
    rows = asked("exports.export_table", client, exam_id=exam.id).splitlines()
    assert [row.split(",")[0] for row in rows] == ["measurement_id", measurement.id]
    arrays = asked("exports.export_arrays", client, exam_id=exam.id).payload
    with np.load(arrays, allow_pickle=False) as file:
        assert file["size_mm"] == [measurement.estimate.size_mm.value]
        assert list(file["feature_names"]) == sorted(measurement.features.additional_properties)
    recordings = asked("exports.export_recordings", client, exam_id=exam.id).payload
    with zipfile.ZipFile(recordings) as archive:
        assert f"recordings/{measurement.recording_id}.zip" in archive.namelist()


def test_it_downloads_the_exam_as_a_page_to_print(client, exam, measurement):
    page = asked("exports.get_report", client, exam.id).payload.read()
    assert (page[:5], page.rstrip()[-5:]) == (b"%PDF-", b"%%EOF")
