"""Exams in the hospital's format over REST: made of its worklist, as files to download, and sent to its archive.

What is sent is what the client has seen (If-Match), so that no exam goes out that was corrected to another patient
meanwhile.
"""

from __future__ import annotations

from datetime import date
from typing import Annotated, Any

from fastapi import FastAPI, Response
from pydantic import BaseModel, ConfigDict, Field

from device.dicom.hospital import Hospital
from device.dicom.subject import ObjectKind
from device.records.exams import LesionFields, Person
from device.records.outbox import OutboxState
from device.web.contract import ZIP, answers, media
from device.web.exams import OnceKey, SeenVersion, asked_once, tagged, version_of
from device.web.schema import Exam, Fault, Instant


class Sending(BaseModel):
    """Who sends an exam to the archive."""

    model_config = ConfigDict(extra="forbid", strict=True)
    by: Person


class ExamObject(BaseModel):
    """An object of an exam, and how far it is on its way to the archive; `problem` is what the archive said last.

    A `rejection` tells the archive that another object is not to be used any more: a measurement that is void, was
    moved, or whose exam was corrected after it was sent.
    """

    model_config = ConfigDict(extra="allow")
    uid: str
    kind: ObjectKind
    study_uid: str
    measurement_id: str
    state: OutboxState
    problem: str
    tries: int
    queued_at: Instant
    sent_at: Instant | None
    confirmed_at: Instant | None


class SentExam(BaseModel):
    """The objects of an exam that were ever to be at the archive, oldest first."""

    exam_id: str
    objects: list[ExamObject]


class MissingMeasurement(BaseModel):
    """A measurement that counts and cannot be written any more, and why: a rule has deleted its recording."""

    measurement_id: str
    why: str


class QueuedExam(SentExam):
    """An exam that is sent now, and which of its measurements never were and cannot be any more."""

    missing: list[MissingMeasurement]


class RemotePlace(BaseModel):
    """Where a program of the hospital is, and its application entity title."""

    host: str
    port: int
    title: str


class HospitalStatus(BaseModel):
    """Where archive and worklist are, null for none, and how many objects are in which state.

    `send_phantoms`: whether phantoms and simulated presses are sent, too; `fault`: why the archive has not got what it
    is to have; `next_try_at`: when it is tried again.
    """

    model_config = ConfigDict(extra="allow")
    own_title: str
    archive: RemotePlace | None
    worklist: RemotePlace | None
    send_phantoms: bool
    objects: dict[OutboxState, int]
    fault: Fault | None
    next_try_at: Instant | None


class OrderedStep(BaseModel):
    """An examination that the hospital's worklist has, with what tells the operator whose it is.

    `scheduled_at` and `patient_birth_date` are as the hospital writes them, YYYYMMDD and the time behind.
    """

    model_config = ConfigDict(extra="allow")
    id: str
    scheduled_at: str
    patient_ref: str
    patient_name: str
    patient_birth_date: str
    patient_sex: str
    patient_issuer: str
    order_number: str
    study_uid: str
    procedure_id: str
    step_id: str
    description: str


class Worklist(BaseModel):
    """Steps by their time."""

    steps: list[OrderedStep]


class ScheduledExam(LesionFields):
    """A step that was shown, by its `id`, and what the worklist does not say of the exam."""

    step: Annotated[str, Field(max_length=64)]
    operator: Person


class AnotherPlace(LesionFields):
    """Where else the patient of an exam is examined, and by whom."""

    operator: Person


def add_dicom(app: FastAPI, api: str, hospital: Hospital) -> None:
    """Add the routes below `api` of what the hospital's programs read."""
    of_exam = f"{api}/exams/{{exam_id}}/dicom"

    @app.get(f"{api}/dicom", responses=answers(200, HospitalStatus), tags=["hospital"])
    def get_hospital() -> dict[str, Any]:
        """Say where archive and worklist are, and what the archive has not got yet."""
        return hospital.as_record()

    @app.get(
        f"{of_exam}.zip",
        response_class=Response,
        responses=media(ZIP, "An image and a report of each measurement that counts."),
        tags=["hospital"],
    )
    def get_dicom_files(exam_id: str) -> Response:
        """Return an exam as DICOM files, for a PC that fetches them itself.

        `missing.csv` among them names measurements whose recording a rule has deleted; 410 when that is so of all.
        """
        return Response(hospital.files_of(exam_id), media_type=ZIP)

    @app.get(of_exam, responses=answers(200, SentExam), tags=["hospital"])
    def get_sent_exam(exam_id: str) -> dict[str, Any]:
        """Return how far an exam is on its way to the archive."""
        return {"exam_id": exam_id, "objects": hospital.objects_of(exam_id)}

    @app.post(of_exam, status_code=202, responses=answers(202, QueuedExam), tags=["hospital"])
    def send_exam(exam_id: str, sending: Sending, if_match: SeenVersion) -> dict[str, Any]:
        """Send an exam to the archive: all of it that counts, and what was sent before not again."""
        missing = hospital.send(exam_id, version=version_of(if_match), by=sending.by)
        told = [{"measurement_id": name, "why": why} for name, why in missing.items()]
        return {"exam_id": exam_id, "objects": hospital.objects_of(exam_id), "missing": told}

    @app.get(f"{api}/worklist", responses=answers(200, Worklist), tags=["hospital"])
    def get_worklist(
        day: date | None = None, patient_ref: str | None = None, order_number: str | None = None
    ) -> dict[str, Any]:
        """Ask the hospital's worklist what is ordered, of a day, a patient or an order.

        Two ask at once; who asks beside them gets 503 with Retry-After, at once. An exam can be begun of a step for 15
        minutes.
        """
        return {"steps": hospital.scheduled(day, patient_ref, order_number)}

    @app.post(
        f"{api}/worklist/exams", status_code=201, responses=answers(201, Exam, "Location", "ETag"), tags=["hospital"]
    )
    def make_scheduled_exam(
        scheduled: ScheduledExam, response: Response, idempotency_key: OnceKey = None
    ) -> dict[str, Any]:
        """Begin an exam of a step of the worklist: patient, order and study are those that were shown.

        404 when it was not shown within 15 minutes, or a newer answer of the worklist has it no longer: ask again.
        `own_study` says that the ordered study has another patient's exam: tell the operator and the archive.
        """
        path = f"{api}/worklist/exams"
        once = None if idempotency_key is None else asked_once(idempotency_key, f"POST {path}", scheduled)
        exam = hospital.begin_exam(scheduled.step, scheduled.model_dump(exclude={"step"}), once)
        response.headers["Location"] = f"{api}/exams/{exam['id']}"
        return tagged(response, exam)

    _add_another_place(app, f"{api}/exams", hospital)


def _add_another_place(app: FastAPI, path: str, hospital: Hospital) -> None:
    @app.post(
        f"{path}/{{exam_id}}/another-place",
        status_code=201,
        responses=answers(201, Exam, "Location", "ETag"),
        tags=["exams"],
    )
    def make_exam_of_another_place(
        exam_id: str, place: AnotherPlace, if_match: SeenVersion, response: Response, idempotency_key: OnceKey = None
    ) -> dict[str, Any]:
        """Begin an exam of the same patient and order as another one; 404 when the worklist has the order no longer.

        409 when that exam is too old to go on with, 412 when it was changed since it was seen.
        """
        version = version_of(if_match)
        what = f"POST {path}/{exam_id}/another-place, version {version}"
        once = None if idempotency_key is None else asked_once(idempotency_key, what, place)
        exam = hospital.begin_another(exam_id, place.model_dump(), version=version, once=once)
        response.headers["Location"] = f"{path}/{exam['id']}"
        return tagged(response, exam)
