"""Presses over REST: ask for one, follow it, finish or cancel it, and list them."""

from __future__ import annotations

from typing import Annotated, Any

from fastapi import FastAPI, Query
from fastapi.responses import JSONResponse
from pydantic import BaseModel, ConfigDict, WithJsonSchema

from device.errors import InvalidRequest
from device.instrument.procedure import Procedure
from device.measurement.mode import Mode
from device.measurement.wanted_accuracy import UNTIL_BOUNDS, WITHIN_BOUND, WantedAccuracy
from device.records.exams import AskedExam, ExamId
from device.records.store import Store
from device.web.contract import answers
from device.web.exams import OnceKey, SeenExam, asked_once, version_of
from device.web.paging import PressQuery, page_of
from device.web.schema import PressList, PressResource

NOTHING = {"type": "null"}
HALF_WIDTHS = {
    name: {"type": "number", "exclusiveMinimum": bound.low, "maximum": bound.high}
    for name, bound in UNTIL_BOUNDS.items()
}
UNTIL = {
    "anyOf": [{"type": "object", "properties": HALF_WIDTHS, "additionalProperties": False}, NOTHING],
    "description": f"Half of the 90 % interval by unknown: {', '.join(f'{n} {b}' for n, b in UNTIL_BOUNDS.items())}.",
}
WITHIN = {
    "anyOf": [{"type": "number", "minimum": WITHIN_BOUND.low, "maximum": WITHIN_BOUND.high}, NOTHING],
    "description": f"Seconds from the first contact with the lesion: {WITHIN_BOUND}.",
}


class PressRequest(BaseModel):
    """What a client may say when it starts a press: its mode, else that of the settings. Unknown fields are refused.

    Of a scan also how sure it is to be and in how many seconds; these numbers are refused by `WantedAccuracy`.
    """

    model_config = ConfigDict(extra="forbid")
    mode: Mode | None = None
    until: Annotated[dict[str, Any] | None, WithJsonSchema(UNTIL)] = None
    within_s: Annotated[Any, WithJsonSchema(WITHIN)] = None
    exam_id: ExamId | None = None

    @property
    def wanted(self) -> WantedAccuracy:
        """How sure a scan is to be; raises `InvalidQuantity` for what nothing can be."""
        return WantedAccuracy(self.until or {}, self.within_s)

    @property
    def in_one_form(self) -> PressRequest:
        """The same for all requests that ask for the same, as of 30 and 30.0 s; raises as `wanted`."""
        wanted = self.wanted
        until = {name: float(value) for name, value in wanted.until.items()} or None
        within_s = None if wanted.within_s is None else float(wanted.within_s)
        return self.model_copy(update={"until": until, "within_s": within_s})


def add_presses(app: FastAPI, api: str, procedure: Procedure, store: Store) -> None:
    """Add the routes below `api` of presses."""

    @app.post(f"{api}/presses", status_code=202, responses=answers(202, PressResource, "Location"), tags=["presses"])
    def start_press(
        request: PressRequest | None = None, idempotency_key: OnceKey = None, if_match: SeenExam = None
    ) -> JSONResponse:
        """Start a measurement, of an exam or of none; on the simulated probe the virtual hand takes up the probe.

        With an Idempotency-Key it is started once, however often this is sent, and the first answer given again. With
        If-Match it is refused when the exam was changed since the client has shown it.
        """
        request = request or PressRequest()
        if if_match and request.exam_id is None:
            raise InvalidRequest("If-Match is an exam's version, but there is no exam_id.", "Send both, or neither.")
        exam = AskedExam(request.exam_id, version_of(if_match) if if_match else None) if request.exam_id else None
        if idempotency_key is None:
            job = procedure.request(request.mode, request.wanted, exam=exam).as_record()
        else:
            once = asked_once(idempotency_key, f"POST {api}/presses", request.in_one_form)
            job = procedure.request_once(once, request.mode, request.wanted, exam=exam)
        return JSONResponse(job, status_code=202, headers={"Location": f"{api}/presses/{job['id']}"})

    @app.get(f"{api}/presses", responses=answers(200, PressList, "ETag"), tags=["presses"])
    def list_presses(asked: Annotated[PressQuery, Query()]) -> dict[str, Any]:
        """Return presses, the one under way and then the newest first, also those that ended without a measurement."""
        return page_of("presses", store.listing.presses(asked.wanted, before=asked.before, limit=asked.limit))

    @app.get(f"{api}/presses/{{press_id}}", responses=answers(200, PressResource), tags=["presses"])
    def get_press(press_id: str) -> dict[str, Any]:
        """Return the state of a press."""
        return store.press(press_id)

    @app.post(
        f"{api}/presses/{{press_id}}/finish", status_code=202, responses=answers(202, PressResource), tags=["presses"]
    )
    def finish_scan(press_id: str) -> dict[str, Any]:
        """Answer the scan under way with the presses on the lesion that are complete."""
        procedure.finish(press_id)
        return store.press(press_id)

    @app.delete(f"{api}/presses/{{press_id}}", status_code=202, responses=answers(202, PressResource), tags=["presses"])
    def cancel_press(press_id: str) -> dict[str, Any]:
        """Cancel the press under way."""
        procedure.cancel(press_id)
        return store.press(press_id)
