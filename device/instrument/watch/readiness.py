"""Which parts of the probe work, as seen: what an update is judged by, and a PC that keeps an eye on probes.

A part is ready only if it did what it was asked for within the last few seconds; nothing is done to find out, so that
asking never disturbs a press. Between presses each part is used once a second anyway (`progress`).
A fault of the hand or of the place, such as a probe that is held while it starts, is told and leaves a part ready.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from device.errors import DeviceError
from device.instrument.status import ProcedureStatus
from device.instrument.watch.progress import Part, ProgressBoard

HealthPart = Literal["camera", "light", "force", "answers", "store"]
FRESH_S = 5.0
"""Some times what lies between two uses: a second, longer while another part is at fault."""
BELIEVED_S = 30.0
"""While a part's loop is in another one it is believed for so long: to start a camera anew takes 25 s."""

KINDS: dict[HealthPart, tuple[Part, tuple[str, ...]]] = {
    "camera": ("camera", ("E1",)),
    "light": ("light", ("E2",)),
    "force": ("force", ("E3",)),
    "answers": ("inference", ("E401",)),
    "store": ("storage", ("E6",)),
}
"""Whose progress tells of each, and how the codes of its faults begin. A certificate is no matter of the software."""
ELSEWHERE = {"E205", "E209", "E305", "E306", "E308", "E310"}
"""Foreign light, light for too long, too much load, a moved zero, an unsteady tare, a slow amplifier: the part that
tells it works."""


@dataclass(frozen=True)
class PartHealth:
    """Whether a part was seen working just now, and the code of what it tells, if anything."""

    ready: bool
    code: str | None


def parts_health(
    status: ProcedureStatus, progress: ProgressBoard, force_fault: DeviceError | None
) -> dict[HealthPart, PartHealth]:
    """Return the health of every part. `force_fault` is what the load cell is at fault by, which no step waits for."""
    faults = [fault for fault in (status.fault, force_fault) if fault]
    return {name: _health(name, faults, status.stall, progress) for name in KINDS}


def _health(
    name: HealthPart, faults: list[DeviceError], stall: DeviceError | None, progress: ProgressBoard
) -> PartHealth:
    part, codes = KINDS[name]
    seen = progress.last_seen(part)
    is_fresh = seen.idle_s <= FRESH_S and seen.ago_s <= BELIEVED_S
    told = [fault.code for fault in ([seen.error] if seen.error else []) + faults if fault.code.startswith(codes)]
    if stall and not is_fresh:
        told.append(stall.code)
    hindering = [code for code in told if code not in ELSEWHERE]
    return PartHealth(is_fresh and not hindering, next(iter([*hindering, *told]), None))


def health_record(release: str, parts: dict[HealthPart, PartHealth]) -> dict[str, Any]:
    """Return the JSON object of a release's parts."""
    return {"release": release, "parts": {name: asdict(health) for name, health in parts.items()}}
