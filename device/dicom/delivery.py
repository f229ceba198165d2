"""One turn of sending: every queued object to the archive, then the question whether it keeps what it got.

The archive takes an object that it has already without keeping it twice, so what may have arrived is sent again: once a
row is queued it stays so until the archive has answered.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from device.config import DicomSection
from device.dicom.association import RemoteProgram, associated, status_of, unreachable
from device.dicom.confirmation import SentObject, confirmed_uids
from device.dicom.outgoing import Outgoing
from device.dicom.rejection import SOP_CLASSES
from device.errors import DeviceError
from device.measurement.quantities import InvalidQuantity
from device.records.store import Store, StoredRecord

log = logging.getLogger(__name__)

AT_ONCE = 50
"""Objects of one association."""
LOST_AFTER = timedelta(hours=1)
"""What the archive took and does not know of after so long is sent again."""
TAKEN = (0x0000, 0xB000, 0xB006, 0xB007)
"""Stored, the latter with changes by the archive. Source: DICOM PS3.4 B.2.3."""
NOT_NOW = 0xA700
"""Out of resources, by its upper byte."""


class Delivery:
    """Brings an outbox to an archive."""

    def __init__(self, settings: DicomSection, archive: RemoteProgram, store: Store, outgoing: Outgoing) -> None:
        """Take the archive and what there is for it."""
        self._settings, self._archive, self._store, self._outgoing = settings, archive, store, outgoing
        self.silence: DeviceError | None = None
        """That the archive has taken objects and never says that it keeps them, until it does so of any."""

    def turn(self, is_stopping: Callable[[], bool] = lambda: False) -> bool:
        """Send what is queued and ask for what was sent; return whether anything is left to ask for or to send.

        Raises `ArchiveUnreachable`; what had been sent by then stays so. Ends early when it is to stop.
        """
        self._outgoing.take_back_what_is_wrong()
        outbox = self._store.outbox
        while (rows := outbox.in_state("queued", limit=AT_ONCE)) and not is_stopping():
            self._send(rows, is_stopping)
        if not is_stopping() and (rows := outbox.in_state("sent", limit=AT_ONCE)):
            self._confirm(rows)
        return bool(outbox.in_state("sent", limit=1) or outbox.in_state("queued", limit=1))

    def _send(self, rows: list[StoredRecord], is_stopping: Callable[[], bool]) -> None:
        with associated(self._archive, self._settings, list(SOP_CLASSES.values())) as association:
            for row in rows:
                if is_stopping():
                    return
                try:
                    data = self._outgoing.written(row)
                except (DeviceError, InvalidQuantity) as error:
                    self._store.outbox.settle(row["uid"], "refused", f"It cannot be written: {error}")
                    continue
                self._store.outbox.note_try(row["uid"])
                try:
                    status = status_of(association.send_c_store(data))
                except ValueError:  # the archive has not agreed to take this kind
                    self._store.outbox.settle(row["uid"], "refused", f"It takes no {data.SOPClassUID.name}.")
                    continue
                except RuntimeError:  # the association has ended meanwhile
                    status = None
                self._settle(row["uid"], status)

    def _settle(self, uid: str, status: int | None) -> None:
        if status is None:
            raise unreachable(self._archive, "broke the connection off")
        if status & 0xFF00 == NOT_NOW:
            raise unreachable(self._archive, f"has no room: status {status:#06x}")
        log.info("archive: object %s got status %#06x", uid, status)
        problem = "" if status == 0 else f"Status {status:#06x}."
        self._store.outbox.settle(uid, "sent" if status in TAKEN else "refused", problem)

    def _confirm(self, rows: list[StoredRecord]) -> None:
        """Ask for objects that were sent; one that the archive has lost, or says nothing of, is queued again."""
        found, lost = confirmed_uids(self._archive, self._settings, [_sent(row) for row in rows])
        silent = [row["uid"] for row in rows if row["uid"] not in found | lost and _is_old(row["sent_at"])]
        for row in rows:
            uid = row["uid"]
            if uid in found:
                self._store.outbox.settle(uid, "confirmed")
            elif uid in lost:
                self._store.outbox.settle(uid, "queued", "The archive does not have it any more.")
            elif uid in silent:
                self._store.outbox.settle(uid, "queued", "The archive has not said that it keeps it.")
        if silent:
            what = f"has not said for an hour that it keeps what it took, {len(silent)} objects"
            self.silence = unreachable(self._archive, what)
        elif found:
            self.silence = None


def _sent(row: StoredRecord) -> SentObject:
    about = row["about"]
    return SentObject(row["uid"], SOP_CLASSES[about["kind"]], about["study_uid"], about["series_uid"])


def _is_old(sent_at: str) -> bool:
    return datetime.now(UTC) - datetime.fromisoformat(sent_at) > LOST_AFTER
