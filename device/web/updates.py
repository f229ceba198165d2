"""Releases over REST: what runs and what became of the last update, and a release file or a way back for the updater.

The body of an upload goes to the disk part by part, each written in another thread: it may have 100 MB, and neither
the memory nor a press under way may feel it. Nothing here looks into it beyond its first bytes. Who may send one, the
guard has asked before (`device.access.request_rules`).
"""

from __future__ import annotations

import asyncio
from typing import Any

from fastapi import FastAPI, Request
from fastapi.responses import JSONResponse
from starlette.requests import ClientDisconnect

from device.errors import InvalidRequest
from device.instrument.procedure import Procedure
from device.instrument.watch.readiness import health_record
from device.records.release_head import ReleaseHead
from device.records.updates import IncomingRelease, Updates
from device.web.contract import BYTES, answers
from device.web.schema import Health, UpdateResource

PART_BYTES = 1_000_000
"""So much is collected before it is written: each write changes threads."""
RELEASE_BODY = {"requestBody": {"required": True, "content": {"application/octet-stream": {"schema": BYTES}}}}


def add_updates(app: FastAPI, api: str, procedure: Procedure, updates: Updates) -> None:
    """Add the routes below `api` that tell of releases and take them."""
    location = f"{api}/updates"

    @app.get(f"{api}/health/parts", responses=answers(200, Health), tags=["health"])
    def get_parts_health() -> dict[str, Any]:
        """Say which parts were seen working within the last seconds, and which release runs; always 200."""
        return health_record(updates.running, procedure.parts())

    @app.get(location, responses=answers(200, UpdateResource), tags=["updates"])
    def get_updates() -> dict[str, Any]:
        """Return which releases there are, how far an update is, and how the last ones ended."""
        return updates.now().as_record()

    accepted = answers(202, UpdateResource, "Location")

    @app.post(location, status_code=202, responses=accepted, openapi_extra=RELEASE_BODY, tags=["updates"])
    async def upload_release(request: Request) -> JSONResponse:
        """Take a release file as body, from the probe's own screen only, and hand it to the updater."""
        incoming = await asyncio.to_thread(_begin, procedure, updates, _announced_bytes(request))
        try:
            await _take(request, incoming)
            await asyncio.to_thread(_hand_over, procedure, updates, incoming)
        finally:
            await asyncio.to_thread(incoming.discard)
        return JSONResponse(updates.now().as_record(), status_code=202, headers={"Location": location})

    @app.post(f"{location}/roll-back", status_code=202, responses=accepted, tags=["updates"])
    def roll_back() -> JSONResponse:
        """Ask for the release before this one, from the probe's own screen only."""
        with procedure.idle():
            updates.ask_to_roll_back()
        return JSONResponse(updates.now().as_record(), status_code=202, headers={"Location": location})


def _announced_bytes(request: Request) -> int | None:
    announced = request.headers.get("content-length", "")
    return int(announced) if announced.isdecimal() else None


def _begin(procedure: Procedure, updates: Updates, announced_bytes: int | None) -> IncomingRelease:
    with procedure.idle():
        return updates.receive(announced_bytes)


async def _take(request: Request, incoming: IncomingRelease) -> None:
    """Write the body; raise `InvalidRequest` as soon as it is not that of a release file, or when it ends early."""
    head, part = ReleaseHead(), bytearray()
    try:
        async for received in request.stream():
            head.see(received)
            part += received
            if len(part) >= PART_BYTES:
                await asyncio.to_thread(incoming.write, bytes(part))
                part.clear()
    except ClientDisconnect as error:
        raise InvalidRequest(f"The file ended after {incoming.bytes_taken} bytes.", "Send it again.") from error
    head.require_complete()
    await asyncio.to_thread(incoming.write, bytes(part))


def _hand_over(procedure: Procedure, updates: Updates, incoming: IncomingRelease) -> None:
    """Let the updater see the file, unless a press or another update has begun meanwhile."""
    incoming.synchronise()  # the longest part, before anybody has to wait
    with procedure.idle():
        updates.require_free()
        incoming.hand_over()
