"""The hospital over REST: an exam is sent as its client has seen it, and no answer names a patient without need."""

import asyncio
import json
import types

import httpx
import pytest
from dicom_sockets import no_sockets_left as no_sockets_left
from written_exam import begin, measure

from device.config import DicomSection
from device.dicom.hospital import Hospital
from device.files.recording_file import read_picture
from device.web.app import create_app
from device.web.dicom import HospitalStatus, QueuedExam, SentExam


@pytest.fixture(params=["127.0.0.1"])
def ask(store, request):
    hospital = Hospital(DicomSection(archive_host=request.param), store, read_picture)  # never started
    app = create_app(types.SimpleNamespace(), store, hospital=hospital)

    def asking(method, path, body=None, **headers):
        async def answer():
            async with httpx.AsyncClient(transport=httpx.ASGITransport(app), base_url="http://localhost") as client:
                of_all = {"content-type": "application/json", **headers}
                return await client.request(method, f"/api/v1/{path}", headers=of_all, content=json.dumps(body))

        return asyncio.run(answer())

    return asking


@pytest.fixture
def exam(store):
    made = begin(store)
    measure(store, made)
    return made


def test_an_exam_is_queued_and_its_objects_are_told(ask, exam):
    path = f"exams/{exam['id']}/dicom"
    sent = ask("POST", path, {"by": "Ada"}, **{"if-match": '"1"'})
    assert sent.status_code == 202
    said = QueuedExam.model_validate(sent.json())
    objects = said.objects
    assert [(one.kind, one.state, one.tries) for one in objects] == [("image", "queued", 0), ("report", "queued", 0)]
    assert said.missing == []
    assert {**SentExam.model_validate(ask("GET", path).json()).model_dump(), "missing": []} == said.model_dump()
    assert "Ä-17" not in sent.text
    status = HospitalStatus.model_validate(ask("GET", "dicom").json())
    assert (status.archive.port, status.worklist, status.objects) == (104, None, {"queued": 2})


@pytest.mark.parametrize(
    ("body", "seen", "status", "code"),
    [({"by": "Ada"}, '"2"', 412, "E811"), ({"by": "Ada"}, None, 422, "E803"), ({}, '"1"', 422, "E803"),
     ({"by": 7}, '"1"', 422, "E803"), ({"by": "Ada", "to": "x"}, '"1"', 422, "E803")],
)  # fmt: skip
def test_what_was_not_seen_or_not_said_is_refused_and_nothing_queued(ask, store, exam, body, seen, status, code):
    answer = ask("POST", f"exams/{exam['id']}/dicom", body, **({"if-match": seen} if seen else {}))
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert store.outbox.counts() == {}


@pytest.mark.parametrize("ask", [None], indirect=True)
def test_without_an_archive_an_exam_can_be_fetched_but_not_sent(ask, exam):
    answer = ask("POST", f"exams/{exam['id']}/dicom", {"by": "Ada"}, **{"if-match": '"1"'})
    refusal = answer.json()
    assert (answer.status_code, refusal["code"], refusal["detail"]) == (409, "E812", "No archive is set.")
    files = ask("GET", f"exams/{exam['id']}/dicom.zip")
    assert (files.headers["content-type"], files.content[:2]) == ("application/zip", b"PK")


def test_an_exam_of_the_worklist_needs_a_step_that_was_shown_and_an_operator(ask, store):
    assert ask("GET", "worklist").json()["detail"] == "No worklist is set."
    assert ask("GET", "worklist?day=yesterday").status_code == 422
    for body, status in (
        ({"step": "2.25.1", "operator": "Ada"}, 404),
        ({"step": "2.25.1"}, 422),
        ({"step": "2.25.1", "operator": "Ada", "patient_ref": "B-18"}, 422),
        ({"step": "2.25.1", "operator": "Ada", "side": "both"}, 422),
    ):
        assert ask("POST", "worklist/exams", body).status_code == status
    assert store.exams.exams(before_seq=2**62, limit=9) == []


def test_an_exam_that_is_not_there_is_told_as_such(ask):
    for path in ("exams/none/dicom", "exams/none/dicom.zip"):
        assert ask("GET", path).status_code == 404
