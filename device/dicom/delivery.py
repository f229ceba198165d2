"""One turn of sending: every queued object to the archive, then the question whether it keeps what it got.

The archive takes an object that it has already without keeping it twice, so what may have arrived is sent again: once a
row is queued it stays so until the archive has answered.
"""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

from device.config import DicomSection
from device.dicom.association import RemoteProgram, unreachable
from device.dicom.confirmation import Commitments, found_uids, sent_object
from device.dicom.outgoing import Outgoing
from device.dicom.storing import StoringTurn
from device.errors import DeviceError
from device.records.audit import recorded, utc_now
from device.records.outbox import OutboxState
from device.records.store import Store, StoredRecord

AT_ONCE = 50
"""Objects that are asked for at once."""
LOST_AFTER = timedelta(hours=1)
"""What the archive took and does not know of after so long is sent again."""
COMMITTED_WITHIN = timedelta(hours=24)
"""So long the report of a storage commitment is waited for before anything is asked again: an archive may write to tape
by night."""
NOT_SENT: tuple[OutboxState, ...] = ("queued", "confirmed", "refused", "withdrawn", "recalled")
"""An object that became any of these meanwhile stays so, as one that a report has settled."""
MOST_ROUNDS = 3
"""So often an object that was taken and is not found is sent again."""


class Delivery:
    """Brings an outbox to an archive."""

    def __init__(self, settings: DicomSection, archive: RemoteProgram, store: Store, outgoing: Outgoing) -> None:
        """Take the archive and what there is for it."""
        self._settings, self._archive, self._store, self._outgoing = settings, archive, store, outgoing
        self._commitments: Commitments | None = None
        if settings.commitment_port is not None:
            self._commitments = Commitments(archive, settings, store.outbox, self._settle)
        self.silence: DeviceError | None = None
        """That the archive has taken objects and never says that it keeps them, until it does so of any."""

    def turn(self, is_stopping: Callable[[], bool] = lambda: False) -> bool:
        """Send what is queued and ask for what was sent; return whether anything is left to ask for or to send.

        Raises `ArchiveUnreachable`; what had been sent by then stays so. Ends early when it is to stop.
        """
        self._outgoing.take_back_what_is_wrong()
        fault = self._listen()
        storing = StoringTurn(self._archive, self._settings, self._store.outbox, self._outgoing, is_stopping)
        fault = storing.take() or fault
        if not is_stopping() and (rows := self._next_to_ask_for()):
            self._ask_for(rows)
        if not is_stopping():
            fault = self._listen() or fault
        if fault:
            raise fault
        return bool(self._store.outbox.in_state("queued", limit=1) or self._next_to_ask_for())

    def close(self) -> None:
        """Close the port at which reports are heard; the next turn opens it again while any is awaited."""
        if self._commitments:
            self._commitments.close()

    def _listen(self) -> DeviceError | None:
        return self._commitments.listen() if self._commitments else None

    def _next_to_ask_for(self) -> list[StoredRecord]:
        """Return objects that were sent; not those whose commitment is awaited."""
        if not self._commitments:
            return self._store.outbox.next_to_ask_for(limit=AT_ONCE)
        now = datetime.now(UTC)
        since, until = recorded(now - COMMITTED_WITHIN), recorded(now)
        return self._store.outbox.next_to_commit(limit=AT_ONCE, since=since, until=until)

    def _ask_for(self, rows: list[StoredRecord]) -> None:
        self._store.outbox.note_asked([row["uid"] for row in rows])
        if self._commitments:
            self._ask_for_commitment(self._commitments, rows)
            return
        found = found_uids(self._archive, self._settings, [sent_object(row) for row in rows])
        kept = [row for row in rows if row["uid"] in found]
        self._settle(kept, [])
        silent = [row for row in rows if row["uid"] not in found and _is_old(row["sent_at"])]
        self._note_silence(silent, "for an hour", has_found=bool(kept))

    def _ask_for_commitment(self, commitments: Commitments, rows: list[StoredRecord]) -> None:
        """Ask for objects, but for those that are sent again because no report of them has come in time."""
        silent = [row for row in rows if row["sent_at"] <= _taken_at(row) <= utc_now()]
        has_found = bool(silent) and self._store.outbox.has_confirmed(since=min(map(_taken_at, silent)))
        again = self._note_silence(silent, "within a day", has_found=has_found)
        asked = [row for row in rows if row["uid"] not in again]
        if asked:
            commitments.ask_for([sent_object(row) for row in asked])

    def _settle(self, kept: list[StoredRecord], failed: list[StoredRecord]) -> None:
        """Say of objects that the archive keeps them, and queue again those that it says it has not."""
        for row in kept:
            self._store.outbox.settle(row["uid"], "confirmed", unless=("recalled", "withdrawn"))
        for row in failed:
            if row["state"] == "sent":
                self._send_again(row, "The archive does not have it any more", has_found=bool(kept), is_silent=False)
        if kept:
            self.silence = None

    def _note_silence(self, silent: list[StoredRecord], how_long: str, *, has_found: bool) -> set[str]:
        """Queue again what the archive says nothing of; return what is not to be asked for therefore."""
        why = "The archive has not said that it keeps it"
        again = {row["uid"] for row in silent if self._send_again(row, why, has_found=has_found)}
        if silent:
            what = f"has not said {how_long} that it keeps what it took, {len(silent)} objects"
            self.silence = unreachable(self._archive, what)
        return again

    def _send_again(self, row: StoredRecord, why: str, *, has_found: bool, is_silent: bool = True) -> bool:
        """Queue an object that is not found, a few times; then it is refused, if the archive finds others.

        Return whether it is `sent` no more. An archive that finds none says nothing of this one: what it reports as
        lost goes again as ever, and what it is silent of is asked for further on.
        """
        rounds, outbox = row.get("rounds", 0), self._store.outbox
        if rounds < MOST_ROUNDS or not (is_silent or has_found):
            outbox.note(row["uid"], rounds=rounds + (is_silent or has_found))
            outbox.settle(row["uid"], "queued", f"{why}.", unless=NOT_SENT)
        elif has_found:
            said = f"{why}, after it took it {rounds + 1} times"
            where = "look for it there, as among what waits to be sorted in"
            outbox.settle(row["uid"], "refused", f"{said}: {where}.", unless=NOT_SENT)
        else:
            outbox.note(row["uid"], problem=f"{why}, after it took it {rounds + 1} times.")
            return False
        return True


def _taken_at(row: StoredRecord) -> str:
    """Return when the archive took the last request for an object that it has not answered, "" without one."""
    return max((at for at in row.get("commitments", {}).values() if at), default="")


def _is_old(sent_at: str) -> bool:
    return datetime.now(UTC) - datetime.fromisoformat(sent_at) > LOST_AFTER
