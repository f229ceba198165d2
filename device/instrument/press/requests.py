"""Requests for a press, and touches of the probe, to the one press that may be under way.

Clients ask and cancel from any thread; the procedure's own takes what they ask for, and says on the board what became
of it. Without a request a press begins in the mode of the settings.
"""

from __future__ import annotations

import threading
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Literal

from device.errors import BusyError, DeviceError, ModeUnavailable, UnknownResource
from device.instrument.press.states import CANCELLED, before_contact, never_lifted
from device.instrument.self_test.report import SelfTestJob
from device.instrument.status import PressJob, StatusBoard
from device.measurement.mode import FRAMES, Mode
from device.measurement.wanted_accuracy import WantedAccuracy
from device.records.asked_once import AskedOnce
from device.records.exams import AskedExam
from device.records.store import ENDED, Store


class PressRequests:
    """At most one press that waits; none while another is under way."""

    def __init__(
        self,
        board: StatusBoard,
        store: Store,
        *,
        modes: tuple[Mode, ...],
        mode: Mode,
        cancelled: threading.Event,
        finished: threading.Event,
        called_away: threading.Event,
        now: Callable[[], str],
        is_clock_steady: Callable[[], bool],
    ) -> None:
        """Take `modes`, those that the probe has, `mode`, that of a press unless asked otherwise, and what ends one.

        `finished` ends a scan with what is there. None begins while something else is to be done first: `called_away`.
        `now` is the wall clock, RFC 3339; how old an exam is is judged while that is steady alone.
        """
        self._board, self._store, self._modes, self._mode = board, store, modes, mode
        self._cancelled, self._finished, self._called_away = cancelled, finished, called_away
        self._now, self._is_clock_steady = now, is_clock_steady
        self._waiting: PressJob | None = None
        self._before: PressJob | None = None
        self._asked_s = 0.0
        self._listeners: list[Callable[[Mode], None]] = []
        self._lock = threading.Lock()

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Call `listener` with the mode whenever a press is requested."""
        self._listeners.append(listener)

    def ask(
        self,
        mode: Mode | None,
        wanted: WantedAccuracy | None = None,
        *,
        once: AskedOnce | None = None,
        exam: AskedExam | None = None,
    ) -> PressJob:
        """Ask for a press in a mode, that of the settings unless given, and a scan to be as sure as is `wanted`.

        It is the press of the status from now on, with nothing of the one before; `once`: the request that is kept
        together with it as obeyed; `exam`: what its measurement will belong to.

        Raises `ModeUnavailable`, `BusyError` when a press or the self-test is under way, or the `DeviceError` that
        the probe is at fault by; of an exam `UnknownResource`, `StaleVersion` or `ExamTooOld`.
        """
        mode = mode or self._mode
        if mode not in self._modes:
            remedy = f"Choose one of those it has: {', '.join(self._modes)}."
            raise ModeUnavailable(f"This probe has no model for the mode {mode}.", remedy)
        with self._lock:
            status = self._board.now
            if status.hindrance:
                raise status.hindrance
            self._require_idle()
            job = replace(self._new_job(mode, wanted), exam_id=exam.id if exam else None)
            self._store.save_press(job.as_record(), once, self._judged(exam, job))
            self._waiting, self._before, self._asked_s = job, status.press, time.monotonic()
            self._board.update(press=job, measurement_id=None, answer=None, scan=None, frames_taken=0, wanted_n=())
        for listener in self._listeners:
            listener(mode)
        return job

    def _judged(self, exam: AskedExam | None, job: PressJob) -> AskedExam | None:
        """Return the exam of a press with when it is asked for, if the clock is believed."""
        return exam and replace(exam, asked_at=job.asked_at if self._is_clock_steady() else None)

    def cancel(self, press_id: str) -> None:
        """Cancel the press that waits or is under way; raise `UnknownResource` when it is not that one."""
        with self._lock:
            job = self._waiting or self._board.now.press
            if job is None or job.id != press_id or job.state in ENDED:
                raise UnknownResource(f"Press {press_id} is not under way.", "Only a running press can be cancelled.")
            if job.state == "computing":
                raise BusyError("The frames are taken and the result is being computed.", "Wait a second for it.")
            self._cancelled.set()

    def give_up_waiting(self, after_s: float) -> None:
        """End the press that waits for the probe to be lifted, if it is cancelled or has waited for so long (s).

        Whoever takes the probe up later did not ask for it.
        """
        with self._lock:
            if self._waiting and self._cancelled.is_set():
                self._end_waiting("cancelled", CANCELLED)
            elif self._waiting and time.monotonic() - self._asked_s >= after_s:
                self._end_waiting("rejected", never_lifted(after_s))

    def _end_waiting(self, state: Literal["cancelled", "rejected"], reason: str) -> None:
        """Keep and show how the press that waits has ended; the lock is held."""
        assert self._waiting
        ended = replace(self._waiting, state=state, reason=reason)
        self._store.save_press(ended.as_record())
        self._waiting = None
        step = "rejected" if self._board.now.step == "result" else self._board.now.step
        self._board.update(press=ended, step=step)

    def finish(self, press_id: str) -> None:
        """Let the scan under way be answered with the presses that are complete.

        Raises `UnknownResource` when it is not under way, `BusyError` when no press on the lesion is complete.
        """
        with self._lock:
            job = self._waiting or self._board.now.press
            if job is None or job.id != press_id or job.state in ENDED:
                raise UnknownResource(f"Press {press_id} is not under way.", "Only a running scan can be finished.")
            if not FRAMES[job.mode].is_scan:
                raise BusyError(f"A press in mode {job.mode} ends by itself.", "Wait until it has ended, or cancel it.")
            if not job.ramps:
                raise BusyError("The first press on the lesion is not complete.", "Complete it, or cancel the scan.")
            self._finished.set()

    @contextmanager
    def idle(self) -> Iterator[None]:
        """While it is held no press begins; raises `BusyError` when a press or the self-test is under way."""
        with self._lock:
            self._require_idle()
            yield

    def _require_idle(self) -> None:
        status = self._board.now
        if (holder := self._waiting or status.press) and holder.state not in ENDED:
            raise _held_by_press(holder)
        if status.self_test and status.self_test.is_under_way:
            raise _held_by_self_test(status.self_test)

    @property
    def deciding(self) -> AbstractContextManager[bool]:
        """While it is held, nobody cancels: for the step after which a press can no longer be cancelled."""
        return self._lock

    def begin(self, *, is_touched: bool) -> PressJob | None:
        """Put the press that was asked for, or that the touched probe begins, on the board and return it.

        How it begins is shown with it: whoever looks never finds it beside the `done` of the press before.
        """
        with self._lock:
            if self._called_away.is_set() or not (self._waiting or is_touched):
                return None
            if not self._waiting:
                self._before = self._board.now.press
            job, self._waiting = self._waiting or self._new_job(self._mode), None
            guidance = before_contact("reference", job.mode)
            self._board.update(press=job, guidance=guidance, warnings=self._warnings_since_last_press())
            return job

    def withdraw(self) -> PressJob | None:
        """Return the press that waits and forget it: it will not begin, and whoever withdraws it says how it ended."""
        with self._lock:
            job, self._waiting = self._waiting, None
            return job

    def _new_job(self, mode: Mode, wanted: WantedAccuracy | None = None) -> PressJob:
        self._cancelled.clear()  # here and not when the job begins: it may be cancelled before that
        self._finished.clear()
        until = dict(wanted.until) if wanted and wanted.until else None
        within_s = wanted.within_s if wanted else None
        return PressJob(str(uuid.uuid4()), mode, until=until, within_s=within_s, asked_at=self._now())

    def _warnings_since_last_press(self) -> tuple[DeviceError, ...]:
        told = self._before.warnings if self._before else ()
        return tuple(one for one in self._board.now.warnings if one.is_lasting or one.as_record() not in told)


def _held_by_press(job: PressJob) -> BusyError:
    cause = f"A press is under way: {job.id} in mode {job.mode}, {job.state}, asked for at {job.asked_at}."
    busy = BusyError(cause, "Wait until it has ended, or cancel it.")
    busy.holder = {"kind": "press", "id": job.id, "mode": job.mode, "since": job.asked_at}
    return busy


def _held_by_self_test(job: SelfTestJob) -> BusyError:
    busy = BusyError(f"The self-test is under way: {job.id}, since {job.started_at}.", "Wait until it has ended.")
    busy.holder = {"kind": "self_test", "id": job.id, "mode": None, "since": job.started_at}
    return busy
