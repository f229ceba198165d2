"""What the procedure is doing, for whoever asks: the screen, the API, the virtual hand."""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, Literal

from device.errors import DeviceError
from device.instrument.press.states import Guidance, PressState
from device.instrument.self_test.report import SelfTestJob
from device.measurement.mode import Mode
from device.measurement.quantities import UNKNOWNS
from device.measurement.scan_advice import ScanAdvice
from device.measurement.wanted_accuracy import WantedAccuracy

log = logging.getLogger(__name__)
Step = Literal["starting", "ready", "reference", "lesion", "computing", "result", "rejected", "self_test", "fault"]
JobState = Literal["waiting", "capturing", "computing", "done", "rejected", "cancelled", "failed"]
FAULTS = frozenset({"fault", "warnings"})
"""The fields whose changes are a line; the watchdog, and who sends to the hospital, write their own."""


@dataclass(frozen=True)
class PressJob:
    """One press as a resource: POSTed by a client or begun by the operator's hand, in a mode.

    `asked_at`: when that was, RFC 3339; of releases before it was kept, None. `exam_id`: whose it is.
    `code` is that of the fault that ended it; `warnings` are the records of errors that did not. `light_on_s`: how
    long the LEDs have been on in it. Of a scan: `ramps`, how many presses on the lesion are complete; `until` and
    `within_s`, how sure it is asked to be, as `WantedAccuracy`.
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
    ramps: int = 0
    until: dict[str, float] | None = None
    within_s: float | None = None
    asked_at: str | None = None
    exam_id: str | None = None

    @property
    def wanted(self) -> WantedAccuracy:
        """How sure a scan is asked to be."""
        return WantedAccuracy(self.until or {}, self.within_s)

    def as_record(self) -> dict[str, Any]:
        """Return the job as JSON object."""
        return asdict(self)


def kept_job(record: Mapping[str, Any] | None) -> PressJob | None:
    """Return the job of a record that was kept, also by another release; None of one that says too little."""
    names = {one.name for one in fields(PressJob)}
    if record is None or not {"id", "mode"} <= record.keys():
        return None
    said = {name: value for name, value in record.items() if name in names}
    return PressJob(**{**said, "warnings": tuple(said.get("warnings") or ())})


@dataclass(frozen=True)
class ScanProgress:
    """How far a scan is: its complete presses on the lesion, what they tell, and where the next one goes.

    `next_offset_mm`: beside the lesion's middle. `failed`: why a press since then does not count, "" when none failed.
    """

    ramps: int
    most_ramps: int
    advice: ScanAdvice
    next_offset_mm: float
    failed: str = ""

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object."""
        of_unknowns = {name: getattr(self.advice.estimate, name) for name in UNKNOWNS}
        return {
            "ramps": self.ramps,
            "most_ramps": self.most_ramps,
            "value": {name: one.value for name, one in of_unknowns.items()},
            "determined": {name: one.identifiable for name, one in of_unknowns.items()},
            "half_width": dict(self.advice.half_width),
            "expected_half_width": dict(self.advice.expected_half_width),
            "next_offset_mm": self.next_offset_mm,
            "reason": self.advice.estimate.reason,
            "failed": self.failed,
        }


@dataclass(frozen=True)
class ProcedureStatus:
    """One moment of the procedure.

    `state` is that of the press under way, or how the last one ended; `wanted_n` the forces at which it still wants
    frames. `scan`: how far a scan is, once its first press on the lesion is complete. `warnings`: those of the last
    press, or of the time since, and the lasting ones. `stall`: a part that makes no progress, by the watchdog's thread.
    `archive`, `webhook`: why the hospital's archive, or its address for notices, has not got what it is to have, by the
    threads that send. `network`: why other machines are not served, though the settings ask for it.
    `certificate`: that the one which other machines see ends, by the thread that watches it.
    `answer`: what the press says while that is being kept, without an id; from then on `measurement_id`.
    """

    step: Step = "starting"
    state: PressState = PressState.IDLE
    guidance: Guidance = Guidance.WAIT
    frames_taken: int = 0
    wanted_n: tuple[float, ...] = ()
    press: PressJob | None = None
    scan: ScanProgress | None = None
    answer: dict[str, Any] | None = None
    measurement_id: str | None = None
    self_test: SelfTestJob | None = None
    fault: DeviceError | None = None
    warnings: tuple[DeviceError, ...] = ()
    stall: DeviceError | None = None
    archive: DeviceError | None = None
    webhook: DeviceError | None = None
    network: DeviceError | None = None
    certificate: DeviceError | None = None

    @property
    def of_network(self) -> tuple[DeviceError, ...]:
        """What is wrong between the probe and other machines: it keeps no press from being measured."""
        return tuple(fault for fault in (self.network, self.archive, self.webhook, self.certificate) if fault)

    @property
    def hindrance(self) -> DeviceError | None:
        """What keeps a press from being measured, if anything does."""
        return self.fault or self.stall


class StatusBoard:
    """Holds the present status; tells listeners when the guidance changes, and the log of each fault once."""

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
        if changes.keys() & FAULTS:
            _log_faults(before, after)
        if after.guidance is not before.guidance:
            for listener in self._listeners:
                listener(after.guidance)
        return after


def _log_faults(before: ProcedureStatus, after: ProcedureStatus) -> None:
    """Write a line for each fault that came or went, by its code, with the press that was under way."""
    known, now = _wrong(before), _wrong(after)
    press = after.press.id if after.press and after.press.state in ("waiting", "capturing", "computing") else "none"
    for code, error in now.items():
        if code not in known:
            level = logging.ERROR if error.severity == "fault" else logging.WARNING
            log.log(level, "fault code=%s severity=%s press=%s cause=%r", code, error.severity, press, error.cause)
    for code in known.keys() - now.keys():
        log.info("fault over code=%s press=%s", code, press)


def _wrong(status: ProcedureStatus) -> dict[str, DeviceError]:
    told = (status.fault, *status.warnings)
    return {error.code: error for error in told if error is not None}
