"""The thread that brings the outbox to the archive, and goes on trying: an archive that is down costs nothing but time.

What is queued is on the disk, so neither a stop nor a kill loses any of it; the next start goes on.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from device.errors import ArchiveRefuses, DeviceError
from device.records.outbox import Outbox

if TYPE_CHECKING:
    from device.dicom.delivery import Delivery

log = logging.getLogger(__name__)

LOOK_S = 30.0
"""So often it is looked whether a correction has made anything wrong that was sent."""
BUSY_LOOK_S, STOP_S = 0.5, 0.3
FIRST_WAIT_S, LONGEST_WAIT_S = 2.0, 300.0
NEVER_SENT = timedelta(days=60)
"""Of an exam that nobody sends, too, who the patient is does not stay."""
SEND_AGAIN = "See `GET dicom` for what it says; correct that, and send the exam again."


@dataclass(frozen=True)
class SenderState:
    """Why the last turn failed, None when it did not, and when the next one is (RFC 3339)."""

    fault: DeviceError | None = None
    next_try_at: str | None = None


class Sender:
    """Sends until it is closed."""

    def __init__(
        self,
        outbox: Outbox,
        deliver: Callable[[], Delivery],
        *,
        keep_patients_days: int,
        tell: Callable[[DeviceError | None], None],
        is_busy: Callable[[], bool],
    ) -> None:
        """Take the outbox, what makes the delivery when it is first needed, and whom to tell of a fault.

        While the probe `is_busy` nothing is sent: a press has it to itself.
        """
        self._outbox, self._deliver, self._tell, self._is_busy = outbox, deliver, tell, is_busy
        self._keep_patients = timedelta(days=keep_patients_days)
        self._delivery: Delivery | None = None
        self._stopping, self._woken = threading.Event(), threading.Event()
        self.state = SenderState()
        self._failures = 0
        self._thread = threading.Thread(target=self._run, name="sender", daemon=True)

    def start(self) -> None:
        """Begin."""
        self._thread.start()

    def wake(self) -> None:
        """Send now, whatever was waited for."""
        self._woken.set()

    def close(self) -> None:
        """End after the object that is being sent; an archive that hangs is not waited for."""
        self._stopping.set()
        self.wake()
        self._thread.join(timeout=STOP_S)

    def _run(self) -> None:
        while not self._stopping.is_set():
            self._woken.wait(self._turn())
            self._woken.clear()

    def _turn(self) -> float:
        """Send what there is; return how long to wait until the next time (s)."""
        if self._is_busy():
            return BUSY_LOOK_S
        try:
            is_left = self._delivered()
            refused = self._refused()
        except DeviceError as fault:
            return self._failed(fault)
        except Exception as error:  # noqa: BLE001 - whatever an archive answers must not end the thread
            log.error("sending to the archive failed: %s", type(error).__name__)
            return self._failed(DeviceError(f"Sending failed: {type(error).__name__}.", "Report the daemon's log."))
        self._failures = self._failures + 1 if is_left else 0
        self._say(refused)
        return self._wait_s() if is_left else LOOK_S

    def _delivered(self) -> bool:
        """Return whether anything is left to send or to ask for; only when there is are DICOM's libraries loaded."""
        self._outbox.erase_patients(sent_before=_ago(self._keep_patients), made_before=_ago(NEVER_SENT))
        if self._outbox.is_idle():
            return False
        self._delivery = self._delivery or self._deliver()
        return self._delivery.turn(lambda: self._stopping.is_set() or self._is_busy())

    def _failed(self, fault: DeviceError) -> float:
        self._failures += 1
        wait_s = self._wait_s()
        if self._failures == 1:
            log.warning("%s %s", fault.code, fault)
        self._say(fault, wait_s)
        return wait_s

    def _wait_s(self) -> float:
        return min(FIRST_WAIT_S * 2.0 ** min(self._failures - 1, 10), LONGEST_WAIT_S)

    def _refused(self) -> DeviceError | None:
        refused = self._outbox.in_state("refused", limit=1)
        if not refused:
            return None
        number = self._outbox.counts()["refused"]
        return ArchiveRefuses(
            f"Objects that were refused: {number}; the first one so: {refused[0]['problem']}", SEND_AGAIN
        )

    def _say(self, fault: DeviceError | None, wait_s: float | None = None) -> None:
        next_at = datetime.now(UTC) + timedelta(seconds=wait_s or 0.0)
        self.state = SenderState(fault, next_at.isoformat(timespec="seconds") if wait_s else None)
        self._tell(fault)


def _ago(time: timedelta) -> str:
    return (datetime.now(UTC) - time).isoformat(timespec="milliseconds").replace("+00:00", "Z")
