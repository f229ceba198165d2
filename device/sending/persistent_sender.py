"""A thread that sends what lies on the disk, and goes on trying: a receiver that is down costs nothing but time.

What waits is on the disk, so neither a stop nor a kill loses any of it; the next start goes on.
"""

from __future__ import annotations

import logging
import threading
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from device.errors import DeviceError

log = logging.getLogger(__name__)

BUSY_LOOK_S, STOP_S = 0.5, 0.3
FIRST_WAIT_S, LONGEST_WAIT_S = 2.0, 300.0


@dataclass(frozen=True)
class SenderState:
    """Why the last turn failed, None when it did not, and when the next one is (RFC 3339)."""

    fault: DeviceError | None = None
    next_try_at: str | None = None


def wait_s(failures: int) -> float:
    """Return how long to wait after so many failures in a row (s): 2, 4, 8 and so on, up to five minutes."""
    return min(FIRST_WAIT_S * 2.0 ** min(failures - 1, 10), LONGEST_WAIT_S)


class PersistentSender(ABC):
    """Takes turns until it is closed; a turn that fails is taken again, later and later."""

    receiver = "receiver"
    """What the log calls whom it sends to."""
    look_s = 30.0
    """So often it is looked whether there is anything."""

    def __init__(self, tell: Callable[[DeviceError | None], None], is_busy: Callable[[], bool]) -> None:
        """Take whom to tell of a fault, and of its end. While the probe `is_busy` nothing is sent."""
        self._tell, self._is_busy = tell, is_busy
        self._stopping, self._woken = threading.Event(), threading.Event()
        self.state = SenderState()
        self._failures = 0
        self._thread = threading.Thread(target=self._run, name=f"sender to {self.receiver}", daemon=True)

    @abstractmethod
    def _delivered(self) -> tuple[bool, DeviceError | None]:
        """Send what there is; return whether anything is left, and what is to be told. Raises `DeviceError`."""

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def wake(self) -> None:
        """Send now, whatever was waited for."""
        self._woken.set()

    def close(self) -> None:
        """End after what is being sent; a receiver that hangs is not waited for."""
        self._stopping.set()
        self.wake()
        if self._thread.is_alive():
            self._thread.join(timeout=STOP_S)

    def _is_to_pause(self) -> bool:
        return self._stopping.is_set() or self._is_busy()

    def _run(self) -> None:
        while not self._stopping.is_set():
            self._woken.wait(self._turn())
            self._woken.clear()

    def _turn(self) -> float:
        """Send what there is; return how long to wait until the next time (s)."""
        if self._is_busy():
            return BUSY_LOOK_S
        try:
            is_left, told = self._delivered()
        except DeviceError as fault:
            return self._failed(fault)
        except Exception as error:  # noqa: BLE001 - whatever a receiver answers must not end the thread
            log.error("sending to the %s failed: %s", self.receiver, type(error).__name__)
            return self._failed(DeviceError(f"Sending failed: {type(error).__name__}.", "Report the daemon's log."))
        self._failures = self._failures + 1 if is_left else 0
        self._say(told)
        return wait_s(self._failures) if is_left else self.look_s

    def _failed(self, fault: DeviceError) -> float:
        self._failures += 1
        if self._failures == 1:
            log.warning("%s %s", fault.code, fault)
        waiting_s = wait_s(self._failures)
        self._say(fault, waiting_s)
        return waiting_s

    def _say(self, fault: DeviceError | None, waiting_s: float | None = None) -> None:
        next_at = datetime.now(UTC) + timedelta(seconds=waiting_s or 0.0)
        told = next_at.isoformat(timespec="milliseconds").replace("+00:00", "Z")
        self.state = SenderState(fault, told if waiting_s else None)
        self._tell(fault)
