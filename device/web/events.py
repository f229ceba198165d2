"""The status of the procedure as server-sent events, for the screen and for a PC."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from device import __version__
from device.errors import DeviceError, LoadCellError
from device.instrument.press.frame_choice import ramp_targets_n
from device.instrument.press.states import Guidance
from device.instrument.procedure import Procedure
from device.instrument.status import ProcedureStatus
from device.measurement.mode import FRAMES, RAMP_TO_N, Mode
from device.records.store import ENDED
from device.records.updates import RUNNING

EVENT_INTERVAL_S = 0.06


def snapshot(procedure: Procedure) -> dict[str, Any]:
    """Return the present status as a JSON object."""
    status, press = procedure.board.now, procedure.config.press
    job = status.press if status.press and status.press.state not in ENDED else None
    mode = job.mode if job else press.mode
    ramp_n = _ramp_n(mode, status) if FRAMES[mode].is_ramp else None
    faults: list[DeviceError] = [fault for fault in (status.fault, status.stall) if fault]
    step, guidance = ("fault", Guidance.FAULT) if status.stall else (status.step, status.guidance)
    try:
        force_n: float | None = round(procedure.bench.force.latest_n, 4)
    except LoadCellError as error:
        force_n = None
        faults = faults or [error]
    faults += status.warnings
    return {
        "simulated": procedure.is_simulated,
        "serial": procedure.config.serial,
        "software": __version__,
        "release": RUNNING,
        "step": step,
        "press_state": status.state.code,
        "guidance": {"code": guidance.code, "text": guidance.text},
        "force_n": force_n,
        "mode": mode,
        "kind": "ramp" if ramp_n else "hold",
        "target_n": press.target_n,
        "band_n": (ramp_n[0], ramp_n[-1]) if ramp_n else press.band_n,
        "wanted_n": status.wanted_n if job else ramp_n or (press.target_n,),
        "full_scale_n": max(1.6 * press.target_n, 1.25 * RAMP_TO_N),
        "frames_taken": status.frames_taken,
        "frames_needed": FRAMES[mode].count,
        "press": status.press.as_record() if status.press else None,
        "answer": status.answer,
        "measurement_id": status.measurement_id,
        "self_test": status.self_test.summary() if status.self_test else None,
        "faults": [fault.as_record() for fault in faults],
    }


def _ramp_n(mode: Mode, status: ProcedureStatus) -> tuple[float, ...]:
    return ramp_targets_n(FRAMES[mode].count, "reference" if status.step == "reference" else "press")


async def status_events(procedure: Procedure) -> AsyncIterator[str]:
    """Yield the status as `status` events until the client goes."""
    while True:
        yield f"event: status\ndata: {json.dumps(snapshot(procedure))}\n\n"
        await asyncio.sleep(EVENT_INTERVAL_S)
