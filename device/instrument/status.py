"""What the procedure is doing, for whoever asks: the screen, the API, the virtual hand."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from typing import Any, Literal

from device.errors import DeviceError
from device.instrument.press.states import Guidance, PressState
from device.instrument.self_test.report import SelfTestJob
from device.measurement.mode import Mode

Step = Literal["starting", "ready", "reference", "lesion", "computing", "result", "rejected", "self_test", "fault"]
JobState = Literal["waiting", "capturing", "computing", "done", "rejected", "cancelled", "failed"]


@dataclass(frozen=True)
class PressJob:
    """One press as a resource: POSTed by a client or begun by the operator's hand, in a mode.

    `code` is that of the fault that ended it; `warnings` are the records of errors that did not. `light_on_s`: how
    long the LEDs have been on in it.
    """

    id: str
    mode: Mode
    state: JobState = "waiting"
    progress: float = 0.0
    reason: str = ""
    code: str | None = None
    measurement_id: str | None = None
    warnings: tuple[dict[str, str], ...] = ()
    light_on_s: float = 0.0

    def as_record(self) -> dict[str, Any]:
        """Return the job as JSON object."""
        return asdict(self)


@dataclass(frozen=True)
class ProcedureStatus:
    """One moment of the procedure.

    `state` is that of the press under way, or how the last one ended; `wanted_n` the forces at which it still wants
    frames. `warnings`: those of the last press, or of the time since, and the lasting ones. `stall`: a part that makes
    no progress, by the watchdog's thread. `answer`: what the press says while that is being kept, without an id; from
    then on `measurement_id`.
    """

    step: Step = "starting"
    state: PressState = PressState.IDLE
    guidance: Guidance = Guidance.WAIT
    frames_taken: int = 0
    wanted_n: tuple[float, ...] = ()
    press: PressJob | None = None
    answer: dict[str, Any] | None = None
    measurement_id: str | None = None
    self_test: SelfTestJob | None = None
    fault: DeviceError | None = None
    warnings: tuple[DeviceError, ...] = ()
    stall: DeviceError | None = None

    @property
    def hindrance(self) -> DeviceError | None:
        """What keeps a press from being measured, if anything does."""
        return self.fault or self.stall


class StatusBoard:
    """Holds the present status; tells listeners when the guidance changes."""

    def __init__(self) -> None:
        self._status, self._lock = ProcedureStatus(), threading.Lock()
        self._listeners: list[Callable[[Guidance], None]] = []

    @property
    def now(self) -> ProcedureStatus:
        """Return the present status."""
        with self._lock:
            return self._status

    def on_guidance(self, listener: Callable[[Guidance], None]) -> None:
        """Call `listener` with each new guidance, from the procedure's thread."""
        self._listeners.append(listener)

    def update(self, **changes: Any) -> ProcedureStatus:
        """Replace fields of the status."""
        with self._lock:
            before, self._status = self._status, replace(self._status, **changes)
            after = self._status
        if after.guidance is not before.guidance:
            for listener in self._listeners:
                listener(after.guidance)
        return after
