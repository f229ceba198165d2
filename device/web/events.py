"""The status of the procedure as server-sent events, for the screen and for a PC."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from typing import Any

from device import __version__
from device.errors import DeviceError, LoadCellError
from device.instrument.procedure import Procedure

EVENT_INTERVAL_S = 0.06


def snapshot(procedure: Procedure) -> dict[str, Any]:
    """Return the present status as a JSON object."""
    status, press = procedure.board.now, procedure.config.press
    faults: list[DeviceError] = [status.fault] if status.fault else []
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
        "step": status.step,
        "guidance": {"code": status.guidance.code, "text": status.guidance.text},
        "force_n": force_n,
        "target_n": press.target_n,
        "band_n": press.band_n,
        "full_scale_n": 1.6 * press.target_n,
        "frames_taken": status.frames_taken,
        "frames_needed": press.frames,
        "press": status.press.as_record() if status.press else None,
        "measurement_id": status.measurement_id,
        "faults": [fault.as_record() for fault in faults],
    }


async def status_events(procedure: Procedure) -> AsyncIterator[str]:
    """Yield the status as `status` events until the client goes."""
    while True:
        yield f"event: status\ndata: {json.dumps(snapshot(procedure))}\n\n"
        await asyncio.sleep(EVENT_INTERVAL_S)
