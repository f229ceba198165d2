"""Requests for a press, and touches of the probe, to the one press that may be under way.

Clients ask and cancel from any thread; the procedure's own takes what they ask for, and says on the board what became
of it. Without a request a press begins in the mode of the settings.
"""

from __future__ import annotations

import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

from device.errors import BusyError, DeviceError, ModeUnavailable, UnknownResource
from device.instrument.press.states import before_contact
from device.instrument.status import PressJob, StatusBoard
from device.measurement.mode import Mode
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
        called_away: threading.Event,
    ) -> None:
        """Take `modes`, those that the probe has, `mode`, that of a press unless asked otherwise, and what ends one.

        None begins while something else is to be done first: `called_away`.
        """
        self._board, self._store, self._modes, self._mode = board, store, modes, mode
        self._cancelled, self._called_away = cancelled, called_away
        self._waiting: PressJob | None = None
        self._listeners: list[Callable[[Mode], None]] = []
        self._lock = threading.Lock()

    def on_request(self, listener: Callable[[Mode], None]) -> None:
        """Call `listener` with the mode whenever a press is requested."""
        self._listeners.append(listener)

    def ask(self, mode: Mode | None) -> PressJob:
        """Ask for a press in a mode, that of the settings unless given.

        Raises `ModeUnavailable`, `BusyError` when a press or the self-test is under way, or the `DeviceError` that
        the probe is at fault by.
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
            job = self._new_job(mode)
            self._store.save_press(job.as_record())
            self._waiting = job
        for listener in self._listeners:
            listener(mode)
        return job

    def cancel(self, press_id: str) -> None:
        """Cancel the press that waits or is under way; raise `UnknownResource` when it is not that one."""
        with self._lock:
            job = self._waiting or self._board.now.press
            if job is None or job.id != press_id or job.state in ENDED:
                raise UnknownResource(f"Press {press_id} is not under way.", "Only a running press can be cancelled.")
            if job.state == "computing":
                raise BusyError("The frames are taken and the result is being computed.", "Wait a second for it.")
            self._cancelled.set()

    @contextmanager
    def idle(self) -> Iterator[None]:
        """While it is held no press begins; raises `BusyError` when a press or the self-test is under way."""
        with self._lock:
            self._require_idle()
            yield

    def _require_idle(self) -> None:
        status = self._board.now
        if self._waiting or (status.press and status.press.state not in ENDED):
            raise BusyError("A press is under way.", "Wait until it has ended, or cancel it.")
        if status.self_test and status.self_test.is_under_way:
            raise BusyError("The self-test is under way.", "Wait until it has ended.")

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
            job, self._waiting = self._waiting or self._new_job(self._mode), None
            guidance = before_contact("reference", job.mode)
            self._board.update(press=job, guidance=guidance, warnings=self._warnings_since_last_press())
            return job

    def withdraw(self) -> PressJob | None:
        """Return the press that waits and forget it: it will not begin."""
        with self._lock:
            job, self._waiting = self._waiting, None
            return job

    def _new_job(self, mode: Mode) -> PressJob:
        self._cancelled.clear()  # here and not when the job begins: it may be cancelled before that
        return PressJob(id=str(uuid.uuid4()), mode=mode)

    def _warnings_since_last_press(self) -> tuple[DeviceError, ...]:
        last = self._board.now.press
        told = last.warnings if last else ()
        return tuple(one for one in self._board.now.warnings if one.is_lasting or one.as_record() not in told)
