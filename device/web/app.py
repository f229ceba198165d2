"""The REST API /api/v1 and the screen. Handlers look up and answer; errors become problem+json elsewhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fastapi import FastAPI, Query, Response
from fastapi.responses import FileResponse, JSONResponse, StreamingResponse
from fastapi.staticfiles import StaticFiles
from pydantic import BaseModel, ConfigDict

from device import __version__
from device.access.known_hosts import KnownHosts
from device.instrument.procedure import Procedure
from device.instrument.self_test.report import SelfTestJob
from device.measurement.mode import Mode
from device.records.calibrations import Calibrations
from device.records.store import Store
from device.records.updates import Updates
from device.web.events import StatusFeed, snapshot, status_events
from device.web.guard import RequestGuard
from device.web.kept_files import KeptFiles
from device.web.problems import install_problems
from device.web.schema import PROBLEM, Device, PressResource, SelfTest, Status, Tare, answers
from device.web.updates import add_updates

API = "/api/v1"
STATIC = Path(__file__).parent / "static"
NEWEST = 2**63 - 1
"""Above every sequence number: the largest integer SQLite holds."""


class PressRequest(BaseModel):
    """What a client may say when it starts a press: its mode, else that of the settings. Unknown fields are refused."""

    model_config = ConfigDict(extra="forbid")
    mode: Mode | None = None


class SelfTestRequest(BaseModel):
    """What a client may say when it starts a self-test: what the operator will hold the probe on, and put on it (N)."""

    model_config = ConfigDict(extra="forbid")
    on_block: bool = False
    weight_n: float | None = None


def create_app(
    procedure: Procedure, store: Store, *, hosts: KnownHosts | None = None, updates: Updates | None = None
) -> FastAPI:
    """Return the web application of a running procedure, with what says how its updates went.

    It is asked under the names `hosts`, the machine's own unless given; every request goes through the rules of
    device/access/request_rules.py first.
    """
    app = FastAPI(
        title="TSIS probe",
        version=__version__,
        openapi_url=f"{API}/openapi.json",
        docs_url=None,
        redoc_url=None,
        responses=PROBLEM,
    )
    install_problems(app)
    app.add_middleware(RequestGuard, hosts=hosts or KnownHosts.of_machine())
    _add_state(app, procedure, store)
    _add_presses(app, procedure, store)
    _add_measurements(app, store)
    _add_self_test(app, procedure)
    _add_tare(app, procedure)
    add_updates(app, API, procedure, updates or Updates())
    app.mount("/static", StaticFiles(directory=STATIC), name="static")

    @app.get("/", include_in_schema=False)
    def screen() -> FileResponse:
        return FileResponse(STATIC / "index.html")

    return app


def _add_state(app: FastAPI, procedure: Procedure, store: Store) -> None:
    @app.get(f"{API}/device", responses=answers(200, Device))
    def device() -> dict[str, Any]:
        """Say which probe this is, how long its LEDs have been on, and what each of its modes costs and is worth."""
        config = procedure.config
        return {
            "serial": config.serial,
            "software": __version__,
            "simulated": procedure.is_simulated,
            "light_on_s": round(store.light_on_s, 1),
            "default_mode": config.press.mode,
            "modes": [offer.as_record() for offer in procedure.offers()],
        }

    @app.get(f"{API}/calibrations")
    def calibrations() -> dict[str, Any]:
        """Return the certificates there are, which is active, and which the daemon started with."""
        known = Calibrations(procedure.config.calibration)
        entries = [{"id": one.name, **one.as_record()} for one in known.all()]
        return {"active": known.active_name(), "in_use": procedure.calibration.id or None, "calibrations": entries}

    @app.get(f"{API}/health/live")
    def live() -> dict[str, str]:
        """Answer as long as the daemon runs."""
        return {"status": "live"}

    @app.get(f"{API}/health/ready")
    def ready() -> dict[str, str]:
        """Answer 200 when a press can be measured, else the fault as a problem."""
        procedure.require_ready()
        return {"status": "ready"}

    @app.get(f"{API}/status", responses=answers(200, Status))
    def status() -> dict[str, Any]:
        """Return what the event stream sends."""
        return snapshot(procedure)

    feed = StatusFeed(procedure)

    @app.get(f"{API}/events")
    async def events() -> StreamingResponse:
        """Stream the status as server-sent events, one when something has changed and at least two a second."""
        return StreamingResponse(status_events(feed), media_type="text/event-stream")


def _add_presses(app: FastAPI, procedure: Procedure, store: Store) -> None:
    @app.post(f"{API}/presses", status_code=202, responses=answers(202, PressResource))
    def start_press(request: PressRequest | None = None) -> JSONResponse:
        """Start a measurement; on the simulated probe the virtual hand takes up the probe."""
        job = procedure.request(request.mode if request else None)
        return JSONResponse(job.as_record(), status_code=202, headers={"Location": f"{API}/presses/{job.id}"})

    @app.get(f"{API}/presses/{{press_id}}", responses=answers(200, PressResource))
    def press(press_id: str) -> dict[str, Any]:
        """Return the state of a press."""
        return store.press(press_id)

    @app.delete(f"{API}/presses/{{press_id}}", status_code=202, responses=answers(202, PressResource))
    def cancel_press(press_id: str) -> dict[str, Any]:
        """Cancel the press under way."""
        procedure.cancel(press_id)
        return store.press(press_id)


def _add_measurements(app: FastAPI, store: Store) -> None:
    @app.get(f"{API}/measurements")
    def measurements(
        before_seq: int = Query(NEWEST, ge=1, le=NEWEST), limit: int = Query(20, ge=1, le=200)
    ) -> dict[str, list[dict[str, Any]]]:
        """Return measurements, newest first."""
        return {"measurements": store.measurements(before_seq=before_seq, limit=limit)}

    @app.get(f"{API}/measurements/{{measurement_id}}")
    def measurement(measurement_id: str) -> dict[str, Any]:
        """Return one measurement."""
        return store.measurement(measurement_id)

    @app.get(f"{API}/measurements/{{measurement_id}}/features")
    def features(measurement_id: str) -> dict[str, float]:
        """Return the features of one measurement."""
        return dict(store.measurement(measurement_id)["features"])

    kept = KeptFiles(store)

    @app.get(f"{API}/measurements/{{measurement_id}}/image.png")
    async def image(measurement_id: str) -> Response:
        """Return the tactile image as a picture."""
        return await kept.picture(measurement_id)

    @app.get(f"{API}/measurements/{{measurement_id}}/recording.zip")
    def recording(measurement_id: str) -> Response:
        """Return the recording that the measurement was computed from."""
        return kept.recording(measurement_id)


def _add_self_test(app: FastAPI, procedure: Procedure) -> None:
    def record(job: SelfTestJob) -> dict[str, Any]:
        return {"simulated": procedure.is_simulated, **job.as_record()}

    @app.post(f"{API}/self-test", status_code=202, responses=answers(202, SelfTest))
    def start_self_test(request: SelfTestRequest | None = None) -> JSONResponse:
        """Start a self-test; what the operator has to do for it is in the status' guidance."""
        request = request or SelfTestRequest()
        job = procedure.request_self_test(on_block=request.on_block, weight_n=request.weight_n)
        return JSONResponse(record(job), status_code=202, headers={"Location": f"{API}/self-test"})

    @app.get(f"{API}/self-test", responses=answers(200, SelfTest))
    def self_test() -> dict[str, Any]:
        """Return the self-test under way, or the last one."""
        return record(procedure.self_test)


def _add_tare(app: FastAPI, procedure: Procedure) -> None:
    @app.post(f"{API}/tare", responses=answers(200, Tare))
    def tare() -> dict[str, float]:
        """Take the load cell's tare anew, with the probe held free; refused when it is held, pressed or at fault."""
        moved_n = procedure.tare()
        return {"moved_n": round(moved_n, 4), "zero_shift_n": round(procedure.bench.force.zero_shift_n, 4)}
