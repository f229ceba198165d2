"""The status of the procedure and changes of what is kept as server-sent events, for the screen and for a PC.

Sixteen times a second it is looked whether there is anything new, which costs next to nothing while nobody presses.
Many streams share what one look costs each: fifty are told four times a second, and other requests do not wait.
"""

from __future__ import annotations

import asyncio
import json
import math
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from typing import Any

from fastapi.sse import ServerSentEvent

from device import __version__
from device.errors import DeviceError, LoadCellError, StorageError
from device.instrument.press.frame_choice import ramp_targets_n
from device.instrument.press.states import Guidance, PressState, before_contact, spoken
from device.instrument.procedure import Procedure
from device.instrument.status import ProcedureStatus
from device.measurement.mode import FRAMES, RAMP_TO_N, Mode
from device.records.store import ENDED
from device.records.updates import RUNNING
from device.web.streams.changes import ChangeFeed

EVENT_INTERVAL_S, SHARE_S, LONGEST_INTERVAL_S = 0.06, 0.005, 0.4
"""How often each of a few streams is looked after; so long for each of many; and never more seldom, to be no older than
a client awaits. An event costs half a millisecond of the loop that answers everybody."""
RETRY_MS = 1000
"""So long a browser that was cut off waits before it comes back."""
ALIVE_S = 0.5
"""A status is never older: a client that hears none for 2 s takes the probe for gone: static/base/probe.js."""
STILL_N = 0.002
"""A force that has changed by less, some times the cell's noise, is the one that was told: the screen shows 0.01 N."""


def snapshot(procedure: Procedure) -> dict[str, Any]:
    """Return the present status as a JSON object."""
    press, (force_n, silent) = procedure.config.press, _latest(procedure)
    is_touched = force_n is not None and force_n >= press.contact_n
    status = _since_asked(procedure.board.now, is_touched=is_touched)
    job = status.press if status.press and status.press.state not in ENDED else None
    mode = job.mode if job else procedure.mode
    ramp_n = _ramp_n(mode, status) if FRAMES[mode].is_ramp else None
    faults: list[DeviceError] = [fault for fault in (status.fault, status.stall) if fault]
    step, guidance = ("fault", Guidance.FAULT) if status.stall else (status.step, status.guidance)
    if silent:
        faults = faults or [silent]
    faults += [*status.warnings, *status.of_network]
    aside_mm = status.scan.next_offset_mm if status.scan else None
    return {
        "simulated": procedure.is_simulated,
        "serial": procedure.config.serial,
        "software": __version__,
        "release": RUNNING,
        "step": step,
        "press_state": status.state.code,
        "guidance": {"code": guidance.code, "text": spoken(guidance, aside_mm)},
        "force_n": None if force_n is None else round(force_n, 4),
        "mode": mode,
        "kind": "ramp" if ramp_n else "hold",
        "target_n": press.target_n,
        "band_n": (ramp_n[0], ramp_n[-1]) if ramp_n else press.band_n,
        "wanted_n": status.wanted_n if job else ramp_n or (press.target_n,),
        "full_scale_n": max(1.6 * press.target_n, 1.25 * RAMP_TO_N),
        "frames_taken": status.frames_taken,
        "frames_needed": FRAMES[mode].count,
        "press": status.press.as_record() if status.press else None,
        "scan": status.scan.as_record() if status.scan and job else None,
        "answer": status.answer,
        "measurement_id": status.measurement_id,
        "self_test": status.self_test.summary() if status.self_test else None,
        "faults": [fault.as_record() for fault in faults],
    }


def _since_asked(status: ProcedureStatus, *, is_touched: bool) -> ProcedureStatus:
    """Return the status without how the press before ended, once another is asked for and has not begun.

    It begins when the probe is free: whoever still holds it from the press before is told to lift it.
    """
    job = status.press
    if not job or job.state != "waiting" or status.step not in ("result", "rejected"):
        return status
    is_over = status.guidance in (Guidance.DONE, Guidance.REJECTED)
    first = Guidance.LIFT if is_touched else before_contact("reference", job.mode)
    guidance = first if is_over else status.guidance
    return replace(status, step="ready", state=PressState.IDLE, guidance=guidance)


def _latest(procedure: Procedure) -> tuple[float | None, LoadCellError | None]:
    """Return the newest force (N), or None and why there is none."""
    try:
        return procedure.bench.force.latest_n, None
    except LoadCellError as error:
        return None, error


def _ramp_n(mode: Mode, status: ProcedureStatus) -> tuple[float, ...]:
    return ramp_targets_n(FRAMES[mode].count, "reference" if status.step == "reference" else "press")


class StatusFeed:
    """The `status` event of now, built once for all clients, and anew only when there is something to tell."""

    def __init__(self, procedure: Procedure, *, clock: Callable[[], float] = time.monotonic) -> None:
        self._procedure, self._clock = procedure, clock
        self._status: ProcedureStatus | None = None
        self._silent: LoadCellError | None = None
        self._force_n, self._until_s, self._event = math.inf, -math.inf, ServerSentEvent()
        self._streams = 0

    @contextmanager
    def stream(self) -> Iterator[None]:
        """Count a stream for as long as it is open."""
        self._streams += 1
        try:
            yield
        finally:
            self._streams -= 1

    @property
    def interval_s(self) -> float:
        """How long each stream waits before it is looked after again, s."""
        return min(max(EVENT_INTERVAL_S, SHARE_S * self._streams), LONGEST_INTERVAL_S)

    def event(self) -> ServerSentEvent:
        """Return the event; the same one as long as nothing has changed and it is not old."""
        status, (force_n, silent), now_s = self._procedure.board.now, _latest(self._procedure), self._clock()
        is_same = status is self._status and silent is self._silent
        has_moved = force_n is not None and abs(force_n - self._force_n) >= STILL_N
        if not is_same or has_moved or now_s >= self._until_s:
            self._status, self._silent, self._until_s = status, silent, now_s + ALIVE_S
            self._force_n = math.inf if force_n is None else force_n
            self._event = ServerSentEvent(event="status", raw_data=json.dumps(snapshot(self._procedure)))
        return self._event


async def status_events(feed: StatusFeed, changes: ChangeFeed) -> AsyncIterator[ServerSentEvent]:
    """Yield each new `status` event, and each `measurement` and `exam` that was made or changed, until the client goes.

    The first event has the id that a client without any other is to come back with.
    """
    with feed.stream():
        sent, begun = feed.event(), dict[str, Any](retry=RETRY_MS)
        with suppress(StorageError):  # the status says what is wrong with the disk
            begun["id"] = await changes.begin()
        yield sent.model_copy(update=begun)
        while True:
            with suppress(StorageError):
                async for change in changes.new():
                    yield change
            event = feed.event()
            if event is not sent:
                sent = event
                yield event
            await asyncio.sleep(feed.interval_s)
