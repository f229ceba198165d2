"""The REST API /api/v1 and the screen. Handlers look up and answer; errors become problem+json elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import FastAPI, Response
from fastapi.responses import FileResponse, JSONResponse, StreamingResponse
from fastapi.staticfiles import StaticFiles
from pydantic import BaseModel, ConfigDict, Field

from device import __version__
from device.access.known_hosts import KnownHosts
from device.instrument.procedure import Procedure
from device.instrument.self_test.report import SelfTestJob
from device.measurement.mode import Mode
from device.measurement.wanted_accuracy import UNTIL_BOUNDS, WITHIN_BOUND, WantedAccuracy
from device.records.calibrations import Calibrations
from device.records.exams import AskedExam, ExamId
from device.records.store import Store
from device.records.updates import Updates
from device.web.contract import EVENTS, PNG, PROBLEM, TAGS, ZIP, answers, install_contract, media
from device.web.door import Door
from device.web.events import StatusFeed, snapshot, status_events
from device.web.exams import (
    NEWEST,
    BeforeSeq,
    OnceKey,
    PageLimit,
    SeenExam,
    add_exams,
    asked_once,
    tagged,
    version_of,
)
from device.web.guard import RequestGuard, StrictRoute
from device.web.kept_files import KeptFiles
from device.web.network import ServedNetwork
from device.web.open_answers import OpenAnswers
from device.web.pairing import add_pairing
from device.web.problems import install_problems
from device.web.schema import (
    CalibrationList,
    Device,
    Liveness,
    MeasuredFeatures,
    Measurement,
    MeasurementList,
    PressResource,
    Readiness,
    SelfTest,
    Status,
    Tare,
)
from device.web.updates import add_updates

API = "/api/v1"
STATIC = Path(__file__).parent / "static"


class PressRequest(BaseModel):
    """What a client may say when it starts a press: its mode, else that of the settings. Unknown fields are refused.

    Of a scan also how sure it is to be and in how many seconds; these numbers are refused by `WantedAccuracy`.
    """

    model_config = ConfigDict(extra="forbid")
    mode: Mode | None = None
    until: dict[str, Any] | None = Field(
        default=None,
        description=f"Half of the 90 % interval by unknown: {', '.join(f'{n} {b}' for n, b in UNTIL_BOUNDS.items())}.",
    )
    within_s: Any = Field(default=None, description=f"Seconds from the first contact with the lesion: {WITHIN_BOUND}.")
    exam_id: ExamId | None = None

    @property
    def wanted(self) -> WantedAccuracy:
        """How sure a scan is to be; raises `InvalidQuantity` for what nothing can be."""
        return WantedAccuracy(self.until or {}, self.within_s)


class SelfTestRequest(BaseModel):
    """What a client may say when it starts a self-test: what the operator will hold the probe on, and put on it (N)."""

    model_config = ConfigDict(extra="forbid", strict=True)
    on_block: bool = False
    weight_n: float | None = None


def create_app(
    procedure: Procedure,
    store: Store,
    *,
    hosts: KnownHosts | None = None,
    updates: Updates | None = None,
    door: Door | None = None,
    answers: OpenAnswers | None = None,
    network: ServedNetwork | None = None,
) -> FastAPI:
    """Return the web application of a running procedure, with what says how its updates went.

    It is asked under the names `hosts`, the machine's own unless given; every request goes through the rules of
    device/access/request_rules.py first. Unless a `door` says otherwise, the own screen alone is let in; `answers` can
    be ended, and `network` is how other machines reach the probe.
    """
    door = door or Door()
    app = FastAPI(
        title="TSIS probe",
        version=__version__,
        openapi_url=f"{API}/openapi.json",
        docs_url=None,
        redoc_url=None,
        responses=PROBLEM,
        openapi_tags=TAGS,
        servers=[{"url": "/", "description": "This probe"}],
        generate_unique_id_function=lambda route: route.name,
    )
    app.router.route_class = StrictRoute
    install_contract(app)
    install_problems(app)
    guarding = {"hosts": hosts or KnownHosts.of_machine(), "door": door, "answers": answers, "network": network}
    app.add_middleware(RequestGuard, **guarding)  # type: ignore[arg-type]
    _add_state(app, procedure, store, network)
    _add_presses(app, procedure, store)
    _add_measurements(app, store)
    _add_self_test(app, procedure)
    _add_tare(app, procedure)
    add_exams(app, API, store)
    add_updates(app, API, procedure, updates or Updates())
    add_pairing(app, door, network)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")

    @app.get("/", include_in_schema=False)
    def screen() -> FileResponse:
        return FileResponse(STATIC / "index.html")

    return app


def _add_state(app: FastAPI, procedure: Procedure, store: Store, network: ServedNetwork | None) -> None:
    @app.get(f"{API}/device", responses=answers(200, Device), tags=["device"])
    def get_device() -> dict[str, Any]:
        """Say which probe this is, how long its LEDs have been on, and what each of its modes costs and is worth."""
        config = procedure.config
        return {
            "serial": config.serial,
            "software": __version__,
            "simulated": procedure.is_simulated,
            "light_on_s": round(store.light_on_s, 1),
            "default_mode": config.press.mode,
            "modes": [offer.as_record() for offer in procedure.offers()],
            "network": network and network.as_record(),
        }

    @app.get(f"{API}/calibrations", responses=answers(200, CalibrationList), tags=["device"])
    def list_calibrations() -> dict[str, Any]:
        """Return the certificates there are, which is active, and which the daemon started with."""
        known = Calibrations(procedure.config.calibration)
        entries = [{"id": one.name, **one.as_record()} for one in known.all()]
        return {"active": known.active_name(), "in_use": procedure.calibration.id or None, "calibrations": entries}

    @app.get(f"{API}/health/live", responses=answers(200, Liveness), tags=["health"])
    def get_liveness() -> dict[str, str]:
        """Answer as long as the daemon runs."""
        return {"status": "live"}

    @app.get(f"{API}/health/ready", responses=answers(200, Readiness), tags=["health"])
    def get_readiness() -> dict[str, str]:
        """Answer 200 when a press can be measured, else the fault as a problem."""
        procedure.require_ready()
        return {"status": "ready"}

    @app.get(f"{API}/status", responses=answers(200, Status), tags=["status"])
    def get_status() -> dict[str, Any]:
        """Return what the event stream sends."""
        return snapshot(procedure)

    feed = StatusFeed(procedure)

    @app.get(
        f"{API}/events",
        response_class=StreamingResponse,
        responses=media(EVENTS, "`status` events, each with a Status as its data."),
        tags=["status"],
    )
    async def stream_events() -> StreamingResponse:
        """Stream the status as server-sent events, one when something has changed and at least two a second."""
        return StreamingResponse(status_events(feed), media_type=EVENTS)


def _add_presses(app: FastAPI, procedure: Procedure, store: Store) -> None:
    @app.post(f"{API}/presses", status_code=202, responses=answers(202, PressResource, "Location"), tags=["presses"])
    def start_press(
        request: PressRequest | None = None, idempotency_key: OnceKey = None, if_match: SeenExam = None
    ) -> JSONResponse:
        """Start a measurement, of an exam or of none; on the simulated probe the virtual hand takes up the probe.

        With an Idempotency-Key it is started once, however often this is sent, and the first answer given again. With
        If-Match it is refused when the exam was changed since the client has shown it.
        """
        request = request or PressRequest()
        exam = AskedExam(request.exam_id, version_of(if_match) if if_match else None) if request.exam_id else None
        if idempotency_key is None:
            job = procedure.request(request.mode, request.wanted, exam=exam).as_record()
        else:
            once = asked_once(idempotency_key, f"POST {API}/presses", request)
            job = procedure.request_once(once, request.mode, request.wanted, exam=exam)
        return JSONResponse(job, status_code=202, headers={"Location": f"{API}/presses/{job['id']}"})

    @app.get(f"{API}/presses/{{press_id}}", responses=answers(200, PressResource), tags=["presses"])
    def get_press(press_id: str) -> dict[str, Any]:
        """Return the state of a press."""
        return store.press(press_id)

    @app.post(
        f"{API}/presses/{{press_id}}/finish", status_code=202, responses=answers(202, PressResource), tags=["presses"]
    )
    def finish_scan(press_id: str) -> dict[str, Any]:
        """Answer the scan under way with the presses on the lesion that are complete."""
        procedure.finish(press_id)
        return store.press(press_id)

    @app.delete(f"{API}/presses/{{press_id}}", status_code=202, responses=answers(202, PressResource), tags=["presses"])
    def cancel_press(press_id: str) -> dict[str, Any]:
        """Cancel the press under way."""
        procedure.cancel(press_id)
        return store.press(press_id)


def _add_measurements(app: FastAPI, store: Store) -> None:
    @app.get(f"{API}/measurements", responses=answers(200, MeasurementList), tags=["measurements"])
    def list_measurements(
        before_seq: BeforeSeq = NEWEST, limit: PageLimit = 20, exam_id: ExamId | None = None
    ) -> dict[str, list[dict[str, Any]]]:
        """Return measurements, newest first, all or those of an exam."""
        return {"measurements": store.measurements(before_seq=before_seq, limit=limit, exam_id=exam_id)}

    one = f"{API}/measurements/{{measurement_id}}"

    @app.get(one, responses=answers(200, Measurement, "ETag"), tags=["measurements"])
    def get_measurement(measurement_id: str, response: Response) -> dict[str, Any]:
        """Return one measurement."""
        return tagged(response, store.measurement(measurement_id))

    @app.get(
        f"{one}/features",
        responses=answers(200, MeasuredFeatures),
        tags=["measurements"],
    )
    def get_features(measurement_id: str) -> dict[str, float]:
        """Return the features of one measurement."""
        return dict(store.measurement(measurement_id)["features"])

    kept = KeptFiles(store)

    @app.get(
        f"{one}/image.png",
        response_class=Response,
        responses=media(PNG, "A grey picture."),
        tags=["measurements"],
    )
    async def get_image(measurement_id: str) -> Response:
        """Return the tactile image as a picture."""
        return await kept.picture(measurement_id)

    @app.get(
        f"{one}/recording.zip",
        response_class=Response,
        responses=media(ZIP, "A `tsis.recording`."),
        tags=["measurements"],
    )
    def get_recording(measurement_id: str) -> Response:
        """Return the recording that the measurement was computed from."""
        return kept.recording(measurement_id)


def _add_self_test(app: FastAPI, procedure: Procedure) -> None:
    def record(job: SelfTestJob) -> dict[str, Any]:
        return {"simulated": procedure.is_simulated, **job.as_record()}

    @app.post(f"{API}/self-test", status_code=202, responses=answers(202, SelfTest, "Location"), tags=["self-test"])
    def start_self_test(request: SelfTestRequest | None = None) -> JSONResponse:
        """Start a self-test; what the operator has to do for it is in the status' guidance."""
        request = request or SelfTestRequest()
        job = procedure.request_self_test(on_block=request.on_block, weight_n=request.weight_n)
        return JSONResponse(record(job), status_code=202, headers={"Location": f"{API}/self-test"})

    @app.get(f"{API}/self-test", responses=answers(200, SelfTest), tags=["self-test"])
    def get_self_test() -> dict[str, Any]:
        """Return the self-test under way, or the last one."""
        return record(procedure.self_test)


def _add_tare(app: FastAPI, procedure: Procedure) -> None:
    @app.post(f"{API}/tare", responses=answers(200, Tare), tags=["device"])
    def take_tare() -> dict[str, float]:
        """Take the load cell's tare anew, with the probe held free; refused when it is held, pressed or at fault."""
        moved_n = procedure.tare()
        return {"moved_n": round(moved_n, 4), "zero_shift_n": round(procedure.bench.force.zero_shift_n, 4)}
