"""Requests for a self-test: clients ask from any thread, the procedure's own thread runs it between presses."""

from __future__ import annotations

import logging
import threading
import uuid
from collections.abc import Callable
from dataclasses import replace

from device.errors import BusyError, UnknownResource
from device.instrument.press.states import Guidance
from device.instrument.self_test.report import SelfTestJob, SelfTestState
from device.instrument.self_test.run import SelfTestRun
from device.instrument.status import StatusBoard

log = logging.getLogger(__name__)


class SelfTestRequests:
    """At most one self-test at a time; the last one is kept until the daemon ends."""

    def __init__(self, board: StatusBoard, test: SelfTestRun, now: Callable[[], str], asked: threading.Event) -> None:
        """Take what sets `asked` for: it calls the procedure's thread away from waiting for a press."""
        self._board, self._test, self._now, self._asked = board, test, now, asked
        self._lock = threading.Lock()

    def ask(self, *, on_block: bool, weight_n: float | None) -> SelfTestJob:
        """Ask for a self-test; raise `BusyError` while one is under way."""
        with self._lock:
            last = self._board.now.self_test
            if last and last.is_under_way:
                raise BusyError("A self-test is already under way.", "Wait until it has ended.")
            job = SelfTestJob(str(uuid.uuid4()), self._now(), on_block, weight_n)
            self._board.update(self_test=job)
            self._asked.set()
        return job

    @property
    def last(self) -> SelfTestJob:
        """The self-test under way, or the last one; raises `UnknownResource` when none was asked for."""
        if job := self._board.now.self_test:
            return job
        raise UnknownResource("No self-test was run since the daemon was started.", "Start one.")

    def run_if_asked(self) -> None:
        """Run the self-test that was asked for, if there is one; on the procedure's thread."""
        job = self._board.now.self_test
        if job is None or job.state != "waiting":
            return
        self._board.update(step="self_test", guidance=Guidance.WAIT)
        job = replace(job, state="running")
        end: SelfTestState = "failed"
        try:
            for results in self._test.results(job):
                job = replace(job, results=job.results + tuple(results))
                self._board.update(self_test=job)
            end = "done"
        finally:
            # The guidance first: whoever is told that the test has ended finds the probe ready for the next thing.
            self._board.update(step="starting", guidance=Guidance.DONE)
            self._board.update(self_test=replace(job, state=end))
        log.info("self-test %s", replace(job, state="done").verdict)
