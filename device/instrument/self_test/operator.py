"""Waits for what the operator does in a self-test: keep the probe free, hold it on a block, put a weight on it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from contextlib import suppress

from device.errors import DeviceError
from device.instrument.force_recorder import ForceRecorder
from device.instrument.guidance import Guidance
from device.instrument.progress import ProgressBoard
from device.instrument.status import StatusBoard

POLL_S = 0.02
SETTLED_S = 0.5


class Operator:
    """Tells the operator what to do by the screen's guidance, and waits until the load cell says that it is done."""

    def __init__(
        self, board: StatusBoard, force: ForceRecorder, progress: ProgressBoard, stopping: threading.Event
    ) -> None:
        self._board, self._force, self._progress, self._stopping = board, force, progress, stopping

    def until(self, guidance: Guidance, is_done: Callable[[float], bool], timeout_s: float) -> bool:
        """Show what to do until the force (N) says that it is done; return False when that takes too long.

        Raises `LoadCellError` when the force is not known.
        """
        self._board.update(guidance=guidance)
        deadline_s = time.monotonic() + timeout_s
        while not self._stopping.is_set():
            if is_done(self._force.latest_n):
                return True
            if time.monotonic() > deadline_s:
                return False
            self._beat()
            time.sleep(POLL_S)
        return False

    def settle(self, steady_n: float, timeout_s: float) -> None:
        """Wait until the force has hardly changed (N) for half a second, or until that takes too long."""
        deadline_s = time.monotonic() + timeout_s
        while time.monotonic() < deadline_s and not self._stopping.is_set():
            self._beat()
            time.sleep(SETTLED_S)
            if self._force.range_n(time.monotonic(), window_s=SETTLED_S) <= steady_n:
                return

    def _beat(self) -> None:
        """Keep the idle parts going for the watchdog; what is wrong with one is for its own check to say."""
        with suppress(DeviceError):
            self._progress.beat()
