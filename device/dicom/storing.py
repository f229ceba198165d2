"""What is queued to the archive by C-STORE: each object once a turn, and whose failure it is when one is not taken.

An object that fails keeps no other from being sent: after a lost association the next one goes in a new one. What
fails while the archive takes others counts against the object; what fails with all others is the archive's, and waits.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass

from pydicom.dataset import Dataset
from pynetdicom.association import Association

from device.config import DicomSection
from device.dicom.association import RemoteProgram, associated, status_of, unreachable
from device.dicom.outgoing import Outgoing
from device.dicom.rejection import SOP_CLASSES
from device.errors import ArchiveUnreachable, DeviceError
from device.measurement.quantities import InvalidQuantity
from device.records.outbox import Outbox
from device.records.store import StoredRecord

log = logging.getLogger(__name__)

AT_ONCE = 50
"""Objects of one association."""
FAILED_IN_A_ROW = 5
"""So many failures without an object that is taken end a turn: an archive that hangs takes half a minute for each."""
MOST_FAILED_ALONE = 10
"""So many turns an object may fail while others are taken: 13 minutes by the sender's waits."""
MOST_NOT_UNDERSTOOD = 150
"""So many turns an object may be not understood with all others: twelve hours by the waits, as of a service."""
TAKEN = (0x0000, 0xB000, 0xB006, 0xB007, 0x0111)
"""Stored; B0xx with changes by the archive (DICOM PS3.4 B.2.3); 0111, Duplicate SOP Instance (PS3.7 C.5), says that it
has that identifier already, as after an answer that was lost. Whether it keeps it is asked in any case."""
NO_ROOM = "has no room"
PASSING = {
    0x0110: "cannot process anything",
    0x0124: "does not let this probe store",
    0x0213: NO_ROOM,
}
"""Processing failure, Not authorized and Resource limitation (PS3.7 C.5) say nothing of the object, and may pass.

Others of that annex do: as 0117 Invalid object instance and 0122 SOP class not supported, they are final. So is A9xx,
Data set does not match SOP class (PS3.4 B.2.3).
"""
OUT_OF_RESOURCES, CANNOT_UNDERSTAND = 0xA7, 0xC
"""By the upper byte and the upper digit of a status, PS3.4 B.2.3. Archives answer with the latter what they cannot
parse, and whatever else fails in them: so it may be final, and may pass."""


@dataclass(frozen=True)
class _Failure:
    """An object that was not taken this time, with the status of the answer; None when the connection was lost."""

    row: StoredRecord
    status: int | None

    @property
    def why(self) -> str:
        """What the archive does, as the rest of a sentence."""
        if self.status is None:
            return "broke the connection off"
        return f"{_why_not_now(self.status)}: status {self.status:#06x}"

    @property
    def is_for_room(self) -> bool:
        """Whether that is never a fault of the object."""
        return self.status is not None and _why_not_now(self.status) == NO_ROOM

    @property
    def is_not_understood(self) -> bool:
        return self.status is not None and self.status >> 12 == CANNOT_UNDERSTAND


class StoringTurn:
    """Sends every queued object once."""

    def __init__(
        self,
        archive: RemoteProgram,
        settings: DicomSection,
        outbox: Outbox,
        outgoing: Outgoing,
        is_stopping: Callable[[], bool],
    ) -> None:
        """Take the archive, what there is for it, and whether to end early."""
        self._archive, self._settings, self._outbox, self._outgoing = archive, settings, outbox, outgoing
        self._is_stopping = is_stopping
        self._failures: dict[str, _Failure] = {}
        self._last_taken: StoredRecord | None = None
        self._failed_in_a_row = 0

    def take(self) -> ArchiveUnreachable | None:
        """Send; return why the archive as a whole does not take what it is to, if that is so.

        Raises `ArchiveUnreachable` when it cannot be reached, and then nothing counts against any object.
        """
        while not self._is_to_end() and (rows := self._next()):
            self._send(rows)
        if not self._failures or self._is_stopping():
            return None
        is_well = self._is_archive_well()
        for failure in self._failures.values():
            self._count(failure, is_alone=is_well and not failure.is_for_room)
        of_archive = [one for one in self._failures.values() if one.is_for_room or not is_well]
        return unreachable(self._archive, of_archive[-1].why) if of_archive else None

    def _is_to_end(self) -> bool:
        return self._failed_in_a_row >= FAILED_IN_A_ROW or self._is_stopping()

    def _next(self) -> list[StoredRecord]:
        rows = self._outbox.next_to_send(limit=AT_ONCE + len(self._failures))
        return [row for row in rows if row["uid"] not in self._failures][:AT_ONCE]

    def _send(self, rows: list[StoredRecord]) -> None:
        """Send until the association is lost; what is left then is sent in the next one."""
        with associated(self._archive, self._settings, list(SOP_CLASSES.values())) as association:
            for row in rows:
                if self._is_to_end():
                    return
                if row is not rows[0] and not association.is_established:
                    return  # it ended behind the object before
                if self._is_over(association, row):
                    return

    def _is_over(self, association: Association, row: StoredRecord) -> bool:
        """Send an object and say what became of it; return whether the association is lost."""
        data = self._written(row)
        if data is None:
            return False
        try:
            status = self._answer(association, row, data)
        except ValueError:  # the archive has not agreed to take this kind
            self._outbox.settle(row["uid"], "refused", f"It takes no {data.SOPClassUID.name}.")
            return False
        if status is None or _why_not_now(status):
            self._failures[row["uid"]] = _Failure(row, status)
            self._failed_in_a_row += 1
            return status is None
        self._settle(row, status)
        return False

    def _written(self, row: StoredRecord) -> Dataset | None:
        """Return the object of a row, None when it cannot be written and that is said of it."""
        try:
            return self._outgoing.written(row)
        except (DeviceError, InvalidQuantity) as error:
            self._outbox.settle(row["uid"], "refused", f"It cannot be written: {error}")
            return None

    def _answer(self, association: Association, row: StoredRecord, data: Dataset) -> int | None:
        """Return the status of the archive's answer to an object, None when the association is lost."""
        self._outbox.note_try(row["uid"])
        try:
            return status_of(association.send_c_store(data))
        except RuntimeError:  # the association has ended meanwhile
            return None

    def _settle(self, row: StoredRecord, status: int) -> None:
        log.info("archive: object %s got status %#06x", row["uid"], status)
        problem = "" if status == 0 else f"Status {status:#06x}."
        self._outbox.settle(row["uid"], "sent" if status in TAKEN else "refused", problem)
        if status in TAKEN:
            self._last_taken, self._failed_in_a_row = row, 0

    def _is_archive_well(self) -> bool:
        """Return whether what failed did so of itself: the archive has taken others meanwhile.

        Where only what failed alone before was left, nothing says that it is the archive now. Where all that failed
        did so behind the last one that was taken, the archive may have gone down: then that one is sent once more.
        """
        if self._last_taken is None:
            return all(one.row.get("failed_alone", 0) for one in self._failures.values())
        return not self._failed_in_a_row or self._is_taken_again(self._last_taken)

    def _is_taken_again(self, row: StoredRecord) -> bool:
        data = self._outgoing.written(row)
        with associated(self._archive, self._settings, list(SOP_CLASSES.values())) as association:
            return self._answer(association, row, data) in TAKEN

    def _count(self, failure: _Failure, *, is_alone: bool) -> None:
        row = failure.row
        uid, kind = row["uid"], row["about"]["kind"]
        failed_alone = row.get("failed_alone", 0) + is_alone
        not_understood = row.get("not_understood", 0) + failure.is_not_understood
        said = f"The archive {failure.why}, at the {kind} {uid}"
        if is_alone:
            said += f", in {failed_alone} of {MOST_FAILED_ALONE} turns in which it took others"
        self._outbox.note(uid, problem=f"{said}.", failed_alone=failed_alone, not_understood=not_understood)
        if failed_alone >= MOST_FAILED_ALONE:
            self._outbox.settle(uid, "refused", f"{said}.")
        elif not_understood >= MOST_NOT_UNDERSTOOD:
            self._outbox.settle(uid, "refused", f"{said}, {not_understood} times.")


def _why_not_now(status: int) -> str:
    """Return what a status that may pass says of the archive, "" for any other."""
    if status >> 8 == OUT_OF_RESOURCES:
        return NO_ROOM
    if status >> 12 == CANNOT_UNDERSTAND:
        return "does not understand what it gets"
    return PASSING.get(status, "")
