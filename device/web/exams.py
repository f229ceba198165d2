"""Exams over REST: make, list, read and change them, and move or void measurements; what anybody changes is audited.

A change names the version that its client has seen (If-Match), so that nobody changes what somebody else has changed
meanwhile. Who it was the client says: nobody is asked for a password yet.
"""

from __future__ import annotations

import json
from typing import Annotated, Any

from fastapi import FastAPI, Header, Query, Response
from pydantic import BaseModel, ConfigDict

from device.records.asked_once import AskedOnce
from device.records.exams import ExamContent, ExamFields, ExamId, Person, Reason
from device.records.listing import Wanted
from device.records.store import Store, StoredRecord
from device.web.contract import answers
from device.web.paging import AuditQuery, ExamQuery, page_of, paged
from device.web.schema import AuditList, Exam, ExamList, Measurement

OnceKey = Annotated[
    str | None,
    Header(
        alias="Idempotency-Key",
        min_length=1,
        max_length=255,
        pattern="^[!-~]*$",
        description="What the client calls this one request, such as a UUID: sent again it does nothing more.",
    ),
]
VERSION_TAG = '^(W/)?"[1-9][0-9]{0,17}"$'
"""Also one that a proxy has weakened, as it compressed the answer: the number says the version all the same."""
SeenVersion = Annotated[
    str, Header(alias="If-Match", pattern=VERSION_TAG, description="The ETag of what the client has seen.")
]
SeenExam = Annotated[
    str | None, Header(alias="If-Match", pattern=VERSION_TAG, description="The ETag of the exam that the client shows.")
]


class Act(BaseModel):
    """Who changes something, and why."""

    model_config = ConfigDict(extra="forbid", strict=True)
    by: Person
    reason: Reason


class ExamChange(Act):
    """Which fields of an exam become what; those that are not named stay."""

    changes: ExamFields


class MeasurementMove(Act):
    """The exam that a measurement belongs to from now on, null for none."""

    exam_id: ExamId | None


def tagged(response: Response, record: StoredRecord) -> StoredRecord:
    """Return a record that is being answered with, with its version as the answer's ETag."""
    response.headers["ETag"] = f'"{record["version"]}"'
    return record


def version_of(tag: str) -> int:
    """Return the version that an ETag says."""
    return int(tag.removeprefix("W/").strip('"'))


def asked_once(key: str, what: str, request: BaseModel, *, said_alone: bool = False) -> AskedOnce:
    """Return a request with its key so that two that ask for the same are equal, whatever the order of their fields.

    `said_alone`: what is not said is something else than its default, as where the latter would change a field.
    """
    asked = request.model_dump(mode="json", exclude_unset=said_alone)
    return AskedOnce(key, f"{what} {json.dumps(asked, sort_keys=True)}")


def add_exams(app: FastAPI, api: str, store: Store) -> None:
    """Add the routes below `api` of exams, of what belongs to them, and of the audit."""
    _add_exams(app, f"{api}/exams", store)
    _add_acts(app, f"{api}/measurements/{{measurement_id}}", store)

    @app.get(f"{api}/audit", responses=answers(200, AuditList, "ETag"), tags=["exams"])
    def list_audit(asked: Annotated[AuditQuery, Query()]) -> dict[str, Any]:
        """Return what people have changed, newest first, all or of one exam or measurement."""
        entries = store.audit.entries(
            subject=asked.subject, before_seq=asked.before, limit=asked.limit + 1, **asked.times
        )
        return paged("entries", entries, asked.limit)


def _add_exams(app: FastAPI, path: str, store: Store) -> None:
    @app.post(path, status_code=201, responses=answers(201, Exam, "Location", "ETag"), tags=["exams"])
    def make_exam(content: ExamContent, response: Response, idempotency_key: OnceKey = None) -> dict[str, Any]:
        """Begin an exam of a patient or of a phantom; with an Idempotency-Key it is one, however often this is sent."""
        once = None if idempotency_key is None else asked_once(idempotency_key, f"POST {path}", content)
        exam = store.exams.make(content, once)
        response.headers["Location"] = f"{path}/{exam['id']}"
        return tagged(response, exam)

    @app.get(path, responses=answers(200, ExamList, "ETag"), tags=["exams"])
    def list_exams(asked: Annotated[ExamQuery, Query()]) -> dict[str, Any]:
        """Return the exams of patients, or those of phantoms, newest first.

        A patient is known by number and issuer: one number may be of several people, so look at `patient_issuer`.
        """
        found = store.listing.exams(
            Wanted(**asked.times),
            kind=asked.kind,
            patient_ref=asked.patient_ref,
            patient_issuer=asked.patient_issuer,
            order_number=asked.order_number,
            before=asked.before,
            limit=asked.limit,
        )
        return page_of("exams", found)

    @app.get(f"{path}/{{exam_id}}", responses=answers(200, Exam, "ETag"), tags=["exams"])
    def get_exam(exam_id: str, response: Response) -> dict[str, Any]:
        """Return one exam."""
        return tagged(response, store.exams.exam(exam_id))

    @app.patch(f"{path}/{{exam_id}}", responses=answers(200, Exam, "ETag"), tags=["exams"])
    def change_exam(
        exam_id: str, change: ExamChange, if_match: SeenVersion, response: Response, idempotency_key: OnceKey = None
    ) -> dict[str, Any]:
        """Change fields of an exam; with an Idempotency-Key once, however often this is sent."""
        act = _told(change, if_match, idempotency_key, f"PATCH {path}/{exam_id}")
        return tagged(response, store.exams.change(exam_id, change.changes.model_dump(exclude_unset=True), **act))


def _add_acts(app: FastAPI, path: str, store: Store) -> None:
    @app.post(f"{path}/move", responses=answers(200, Measurement, "ETag"), tags=["measurements"])
    def move_measurement(
        measurement_id: str,
        move: MeasurementMove,
        if_match: SeenVersion,
        response: Response,
        idempotency_key: OnceKey = None,
    ) -> dict[str, Any]:
        """Say that a measurement belongs to another exam, or to none."""
        act = _told(move, if_match, idempotency_key, f"POST {path}/move of {measurement_id}")
        store.exams.move(measurement_id, move.exam_id, **act)
        return tagged(response, store.measurement(measurement_id))

    @app.post(f"{path}/void", responses=answers(200, Measurement, "ETag"), tags=["measurements"])
    def void_measurement(
        measurement_id: str, void: Act, if_match: SeenVersion, response: Response, idempotency_key: OnceKey = None
    ) -> dict[str, Any]:
        """Say that a measurement does not count; it stays readable."""
        act = _told(void, if_match, idempotency_key, f"POST {path}/void of {measurement_id}")
        store.exams.void(measurement_id, **act)
        return tagged(response, store.measurement(measurement_id))


def _told(said: Act, tag: str, key: str | None, what: str) -> dict[str, Any]:
    """Return which version was seen, who acts and why, and the request that he knows again by its key."""
    once = None if key is None else asked_once(key, f"{what}, version {version_of(tag)}", said, said_alone=True)
    return {"version": version_of(tag), "by": said.by, "reason": said.reason, "once": once}
