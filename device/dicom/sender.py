"""The thread that brings the outbox to the archive, if there is one, and erases who patients are in time.

Times of exams are by the wall clock, which a board without a battery starts at some old date: so nothing is erased
until that has been steady for a while, and an exam is as old as since a steady clock first saw it.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

from device.errors import ArchiveRefuses, DeviceError
from device.records.audit import recorded
from device.records.outbox import Outbox
from device.sending.persistent_sender import PersistentSender

if TYPE_CHECKING:
    from device.dicom.delivery import Delivery

NEVER_SENT = timedelta(days=60)
"""Of an exam that nobody sends, too, who the patient is does not stay."""
SEND_AGAIN = "See `GET dicom` for what it says; correct that, and send the exam again."


class Sender(PersistentSender):
    """Sends until it is closed; every half minute it looks whether a correction made wrong what was sent."""

    receiver = "archive"

    def __init__(
        self,
        outbox: Outbox,
        deliver: Callable[[], Delivery] | None,
        *,
        keep_patients_days: int,
        tell: Callable[[DeviceError | None], None],
        is_busy: Callable[[], bool],
        is_clock_steady: Callable[[], bool],
    ) -> None:
        """Take the outbox, what makes the delivery when it is first needed, None without an archive, and whom to tell.

        While the probe `is_busy` nothing is sent: a press has it to itself.
        """
        super().__init__(tell, is_busy)
        self._outbox, self._deliver = outbox, deliver
        self._keep_patients, self._is_clock_steady = timedelta(days=keep_patients_days), is_clock_steady
        self._delivery: Delivery | None = None

    def close(self) -> None:
        """End after what is being sent, and hear nothing more."""
        super().close()
        if self._delivery:
            self._delivery.close()

    def _delivered(self) -> tuple[bool, DeviceError | None]:
        """Send and ask; only when there is anything to are DICOM's libraries loaded."""
        if self._is_clock_steady():
            self._outbox.erase_patients(
                sent_before=_ago(self._keep_patients),
                seen_before=_ago(NEVER_SENT),
                has_archive=self._deliver is not None,
            )
        if self._deliver is None:
            return False, None
        is_left = False
        if not self._outbox.is_idle():
            self._delivery = self._delivery or self._deliver()
            is_left = self._delivery.turn(self._is_to_pause)
        elif self._delivery:
            self._delivery.close()
        return is_left, self._refused() or (self._delivery.silence if self._delivery else None)

    def _refused(self) -> DeviceError | None:
        refused = self._outbox.in_state("refused", limit=1)
        if not refused:
            return None
        number = self._outbox.counts()["refused"]
        return ArchiveRefuses(
            f"Objects that were refused: {number}; the first one so: {refused[0]['problem']}", SEND_AGAIN
        )


def _ago(time: timedelta) -> str:
    return recorded(datetime.now(UTC) - time)
