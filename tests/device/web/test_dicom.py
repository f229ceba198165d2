"""The hospital over REST: an exam is sent as its client has seen it, and no answer names a patient without need."""

import asyncio
import json
import socket
import types

import anyio.to_thread
import httpx
import pytest
from dicom_sockets import no_sockets_left as no_sockets_left
from dicom_sockets import no_sockets_left_of_file as no_sockets_left_of_file
from written_exam import begin, measure

from device.config import Config, DicomSection
from device.dicom.hospital import Hospital
from device.files.recording_file import read_picture
from device.instrument.status import StatusBoard
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


class SilentWorklist:
    """Who takes connections and says nothing."""

    def __init__(self):
        self._listening, self._taken = socket.create_server(("127.0.0.1", 0)), []
        self.settings = DicomSection(worklist_host="127.0.0.1", worklist_port=self._listening.getsockname()[1])

    async def is_asked(self, count):
        """Wait until so many more queries wait for an answer."""
        self._listening.setblocking(False)
        for _ in range(count):
            self._taken.append((await asyncio.get_running_loop().sock_accept(self._listening))[0])

    def break_off(self):
        while self._taken:
            self._taken.pop().close()

    def close(self):
        self.break_off()
        self._listening.close()


@pytest.fixture
def silent():
    worklist = SilentWorklist()
    yield worklist
    worklist.close()


def idle_probe():
    cell = types.SimpleNamespace(force=types.SimpleNamespace(latest_n=0.0))
    more = {"mode": "paper", "modes": ("paper",), "is_simulated": True, "bench": cell}
    return types.SimpleNamespace(config=Config(), board=StatusBoard(), cancel=lambda press_id: None, **more)


def test_beside_two_queries_of_a_silent_worklist_a_third_is_refused_at_once_and_the_rest_is_answered(store, silent):
    """Three worker threads are all there are: one that waited for the worklist, too, would leave none for the rest."""
    app = create_app(idle_probe(), store, hospital=Hospital(silent.settings, store, read_picture))
    at = {"base_url": "http://localhost/api/v1", "headers": {"content-type": "application/json"}}

    async def story():
        anyio.to_thread.current_default_thread_limiter().total_tokens = 3
        async with httpx.AsyncClient(transport=httpx.ASGITransport(app), **at) as client:
            two = [asyncio.create_task(client.get("worklist")) for _ in range(2)]
            await silent.is_asked(2)
            more = await asyncio.gather(*(client.get("worklist?day=2026-11-23") for _ in range(5)))
            for refused in more:
                assert (refused.status_code, refused.headers["retry-after"]) == (503, "10")
                assert refused.headers["content-type"] == "application/problem+json"
                body = refused.json()
                assert (body["code"], body["status"]) == ("E814", 503)
                assert body["remedy"] == "Ask again in 10 s, or begin the exam without the worklist."
            assert (await client.get("status")).json()["press_state"] == "idle"
            assert (await client.delete("presses/x")).status_code == 404
            assert (await client.post("worklist/exams", json={"step": "2.25.1", "operator": "Ada"})).status_code == 404
            assert [one.done() for one in two] == [False, False]
            silent.break_off()
            assert [one.json()["code"] for one in await asyncio.gather(*two)] == ["E030", "E030"]
            again = asyncio.create_task(client.get("worklist"))
            await silent.is_asked(1)  # their places are free
            silent.break_off()
            assert (await again).json()["code"] == "E030"

    asyncio.run(story())


def test_an_exam_that_is_not_there_is_told_as_such(ask):
    for path in ("exams/none/dicom", "exams/none/dicom.zip"):
        assert ask("GET", path).status_code == 404
