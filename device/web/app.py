"""The REST API /api/v1 and the screen. Handlers look up and answer; errors become problem+json elsewhere."""

from __future__ import annotations

from collections.abc import AsyncIterator, Callable, Mapping
from pathlib import Path
from typing import Any

from fastapi import FastAPI
from fastapi.responses import JSONResponse
from fastapi.sse import EventSourceResponse, ServerSentEvent
from fastapi.staticfiles import StaticFiles
from pydantic import BaseModel, ConfigDict

from device import __version__
from device.access.known_hosts import KnownHosts
from device.config import DicomSection, PressSection
from device.dicom.hospital import Hospital
from device.instrument.press.cost import ModeOffer
from device.instrument.press.picture import kept_or_drawn
from device.instrument.procedure import Procedure
from device.instrument.self_test.report import SelfTestJob
from device.records.calibrations import Calibrations
from device.records.store import Store
from device.records.updates import Updates
from device.web.conditional import ConditionalRoute
from device.web.contract import EVENTS, PROBLEM, TAGS, answers, install_contract, media
from device.web.dicom import add_dicom
from device.web.entrance.door import Door
from device.web.entrance.network import ServedNetwork
from device.web.entrance.open_answers import OpenAnswers
from device.web.events import StatusFeed, snapshot, status_events
from device.web.exams import add_exams
from device.web.exports import add_exports
from device.web.guard import RequestGuard
from device.web.kept_files import add_retention
from device.web.measurements import add_measurements
from device.web.pairing import add_pairing
from device.web.presses import add_presses
from device.web.problems import install_problems
from device.web.schema import (
    CalibrationList,
    Device,
    Liveness,
    Readiness,
    SelfTest,
    Status,
    Tare,
)
from device.web.screen.joined_files import add_screen
from device.web.screen.kept_choices import KeptChoices, add_choices
from device.web.service.manual import add_manual
from device.web.service.metrics import add_metrics
from device.web.service.security_contact import add_security_contact
from device.web.service.webhook import add_webhook
from device.web.streams.changes import ChangeFeed, LastEventId
from device.web.streams.live_view import add_live_view
from device.web.updates import add_updates
from device.webhook.notifier import Notifier

API = "/api/v1"
STATIC = Path(__file__).parent / "static"


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
    hospital: Hospital | None = None,
    notifier: Notifier | None = None,
    choices: KeptChoices | None = None,
    certificate_ends_s: Callable[[], Mapping[str, float]] = dict,
) -> FastAPI:
    """Return the web application of a running procedure, with what tells of its updates, and what tells the hospital.

    It is asked under the names `hosts`, the machine's own unless given; every request goes through the rules of
    device/access/request_rules.py first. Unless a `door` says otherwise, the own screen alone is let in; `answers` can
    be ended, `network` is how other machines reach the probe, `choices` are kept of its own screen, and
    `certificate_ends_s` says when certificates end (s since 1970), by their settings.
    """
    door, choices = door or Door(), choices or KeptChoices()
    app = FastAPI(
        title="TSIS probe",
        version=__version__,
        openapi_url=f"{API}/openapi.json",
        docs_url=None,
        redoc_url=None,
        redirect_slashes=False,
        responses=PROBLEM,
        openapi_tags=TAGS,
        servers=[{"url": "/", "description": "This probe"}],
        generate_unique_id_function=lambda route: route.name,
    )
    app.router.route_class = ConditionalRoute
    install_contract(app)
    install_problems(app)
    guarding = {"hosts": hosts or KnownHosts.of_machine(), "door": door, "answers": answers, "network": network}
    app.add_middleware(RequestGuard, **guarding)  # type: ignore[arg-type]
    _add_state(app, procedure, store, network)
    add_presses(app, API, procedure, store)
    add_measurements(app, API, store)
    _add_self_test(app, procedure)
    _add_tare(app, procedure)
    add_metrics(app, procedure, store, certificate_ends_s)
    add_manual(app)
    add_security_contact(app, lambda: procedure.config.maker)
    add_live_view(app, API, procedure)
    add_exams(app, API, store)
    add_exports(app, API, store, lambda: procedure.config.serial, kept_or_drawn)
    add_dicom(app, API, hospital or Hospital(DicomSection(), store, kept_or_drawn))
    add_webhook(app, API, notifier)
    add_retention(app, API, lambda: procedure.config, store)
    add_updates(app, API, procedure, updates or Updates())
    add_pairing(app, door, network)
    add_choices(app, choices)
    add_screen(app, choices)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
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
            "default_mode": procedure.mode,
            "modes": [_offered(offer, config.press) for offer in procedure.offers()],
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
        response_class=EventSourceResponse,
        responses=media(EVENTS, "Events `status`, `measurement`, `exam`: a Status, Measurement or Exam each."),
        tags=["status"],
    )
    async def stream_events(last_event_id: LastEventId = None) -> AsyncIterator[ServerSentEvent]:
        """Stream the status whenever it changes and twice a second, and each measurement and exam made or changed.

        With Last-Event-ID those that were made or changed since are sent as well.
        """
        changes = ChangeFeed(store, last_event_id)
        async for event in status_events(feed, changes):
            yield event


def _offered(offer: ModeOffer, press: PressSection) -> dict[str, Any]:
    """Return a mode with the forces (N) between which its frames are wanted: of a hold a band around its force."""
    record = offer.as_record()
    band_n = (record["from_n"], record["to_n"]) if record["kind"] == "ramp" else press.band_n
    return {**record, "band_n": band_n}


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
