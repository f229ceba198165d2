"""Whether the archive keeps what it got: it is asked what it has, or commits itself to keep it.

A query (C-FIND) needs no open port here. Storage commitment (PS3.4 annex J) is answered when the archive likes, in the
association in which it was asked or in one that it begins, minutes or days later: so transactions stand in the outbox,
and a port is open as long as one is awaited.
"""

from __future__ import annotations

import logging
import ssl
import threading
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any
from uuid import uuid4

from pydicom.dataset import Dataset
from pydicom.sequence import Sequence as Items
from pynetdicom import evt

from device.config import DicomSection
from device.dicom.association import (
    COMMITMENT,
    COMMITMENT_INSTANCE,
    CONNECT_S,
    STUDY_FIND,
    RemoteProgram,
    application,
    associated,
    status_of,
    unreachable,
)
from device.dicom.rejection import SOP_CLASSES
from device.dicom.shared_modules import reference
from device.dicom.subject import uid_of
from device.errors import ArchiveUnreachable
from device.records.outbox import Outbox
from device.records.store import StoredRecord

log = logging.getLogger(__name__)

REPORT_S = 10.0
"""So long the association in which an archive was asked is kept for its report, and what is sent next waits."""
REQUEST, REPORTS = 1, (1, 2)
"""Action Type ID, and Event Type IDs of all kept and of failures: PS3.4 J.3.2 and J.3.3."""
SUCCESS, PENDING = 0x0000, (0xFF00, 0xFF01)
NO_SUCH_OBJECT, NO_SUCH_EVENT, INVALID_ARGUMENT, NO_SUCH_CLASS = 0x0112, 0x0113, 0x0115, 0x0118
"""Annex J has no statuses of its own for a report, so they are those of N-EVENT-REPORT, PS3.7 10.1.1.1.8 and annex C.

0112 is of the one instance that the service has, and a transaction is none: its UID is an argument of the event."""


@dataclass(frozen=True)
class SentObject:
    """An object that the archive has taken, by what an archive finds it by."""

    uid: str
    sop_class: str
    study_uid: str
    series_uid: str


def sent_object(row: StoredRecord) -> SentObject:
    """Return the object of a row of the outbox."""
    about = row["about"]
    return SentObject(row["uid"], SOP_CLASSES[about["kind"]], about["study_uid"], about["series_uid"])


def found_uids(archive: RemoteProgram, settings: DicomSection, objects: Sequence[SentObject]) -> set[str]:
    """Return which objects the archive finds; raise `ArchiveUnreachable`."""
    by_series: dict[tuple[str, str], list[str]] = defaultdict(list)
    for one in objects:
        by_series[one.study_uid, one.series_uid].append(one.uid)
    found: set[str] = set()
    with associated(archive, settings, [STUDY_FIND]) as association:
        for (study_uid, series_uid), uids in by_series.items():
            asked = Dataset()
            asked.QueryRetrieveLevel = "IMAGE"
            asked.StudyInstanceUID, asked.SeriesInstanceUID, asked.SOPInstanceUID = study_uid, series_uid, uids
            for answer, data in association.send_c_find(asked, STUDY_FIND):
                status = status_of(answer)
                if status is None:
                    raise unreachable(archive, "broke the connection off")
                if status not in (*PENDING, SUCCESS):
                    raise unreachable(archive, f"does not say what it keeps: status {status:#06x} of the query")
                if status in PENDING and data is not None:
                    found.add(str(data.get("SOPInstanceUID", "")))
    return found & {one.uid for one in objects}


Settle = Callable[[list[StoredRecord], list[StoredRecord]], None]
"""What is done with the rows that a report names: those that the archive keeps, and those that it does not."""


class Commitments:
    """The archive's storage commitment: what is asked for, and its reports, whenever they come."""

    def __init__(self, archive: RemoteProgram, settings: DicomSection, outbox: Outbox, settle: Settle) -> None:
        """Take the archive, where transactions are kept, and what settles a report's rows, from another thread."""
        self._archive, self._settings, self._outbox, self._settle = archive, settings, outbox, settle
        self._server: Any = None
        self._reported = threading.Condition()
        self._newest = ""

    def listen(self) -> ArchiveUnreachable | None:
        """Have the port open while a report is awaited, and closed otherwise; return why it cannot be opened."""
        if not self._outbox.awaits_commitment():
            self.close()
            return None
        try:
            self._open()
        except ArchiveUnreachable as fault:
            return fault
        return None

    def close(self) -> None:
        """Close the port; what is awaited is heard once it is open again."""
        if self._server is not None:
            self._server.shutdown()
            self._server = None

    def ask_for(self, objects: Sequence[SentObject]) -> None:
        """Ask the archive to commit itself to objects, and wait a moment for its report.

        Raises `ArchiveUnreachable` when it is not reached or does not take the request.
        """
        uids, asked = [one.uid for one in objects], Dataset()
        asked.TransactionUID = uid_of("transaction", str(uuid4()))
        asked.ReferencedSOPSequence = Items([reference(one.sop_class, one.uid) for one in objects])
        self._open()
        with associated(self._archive, self._settings, [COMMITMENT], on_report=self._take) as association:
            self._outbox.begin_transaction(asked.TransactionUID, uids)
            answer, _ = association.send_n_action(asked, REQUEST, COMMITMENT, COMMITMENT_INSTANCE)
            status = status_of(answer)
            if status is None:  # it may have been taken all the same: then its report is known
                raise unreachable(self._archive, "broke the connection off at a request for storage commitment")
            if status != SUCCESS:
                self._outbox.forget_transaction(asked.TransactionUID, uids)
                raise unreachable(
                    self._archive, f"does not take a request for storage commitment: status {status:#06x}"
                )
            self._outbox.await_transaction(asked.TransactionUID, uids)
            with self._reported:
                self._reported.wait_for(lambda: self._newest == asked.TransactionUID, timeout=REPORT_S)

    def _open(self) -> None:
        """Listen for reports of the archive, and nobody else; raise `ArchiveUnreachable` when the port is taken."""
        if self._server is not None:
            return
        own, port = application(self._settings), self._settings.commitment_port or 0
        own.require_calling_aet, own.require_called_aet = [self._archive.title], True
        own.add_supported_context(COMMITMENT, scu_role=True, scp_role=True)
        handlers: list[Any] = [(evt.EVT_N_EVENT_REPORT, self._take)]
        try:
            tls = _listening_tls(self._settings)
            self._server = own.start_server(("", port), block=False, evt_handlers=handlers, ssl_context=tls)
        except OSError as error:
            why = f"is not heard, for the port {port} of its storage commitment cannot be opened: {error}"
            raise unreachable(self._archive, why) from error

    def _take(self, event: evt.Event) -> tuple[int, None]:
        """Settle what a report names, and return the status of the answer: success only once that is kept.

        What else fails here, as a disk that is full, pynetdicom answers with 0110, Processing failure.
        """
        status = _wrong_address(event) or self._settled(event.event_information)
        if status != SUCCESS:
            log.warning("archive: a report of storage commitment is not taken: status %#06x", status)
        return status, None

    def _settled(self, report: Dataset) -> int:
        transaction_uid = str(report.get("TransactionUID") or "")
        named = [_named(report, sequence) for sequence in ("ReferencedSOPSequence", "FailedSOPSequence")]
        with self._reported:  # a report that comes twice at once counts once
            rows = [self._rows_of(transaction_uid, objects) for objects in named]
            if None in rows or not any(named) or named[0].keys() & named[1].keys():
                return INVALID_ARGUMENT
            kept, failed = ([row for row in of or () if row["commitments"][transaction_uid] is not None] for of in rows)
            self._settle(kept, failed)
            self._outbox.close_transactions([row["uid"] for row in (*kept, *failed)])
            self._newest = transaction_uid
            self._reported.notify_all()
        return SUCCESS

    def _rows_of(self, transaction_uid: str, objects: dict[str, str]) -> list[StoredRecord] | None:
        """Return the rows of objects, None unless all were asked for in this transaction, as what they are."""
        rows = self._outbox.objects(objects)
        asked = [row for row in rows if transaction_uid in row.get("commitments", ())]
        is_right = all(objects[row["uid"]] == SOP_CLASSES[row["about"]["kind"]] for row in asked)
        return asked if is_right and len(asked) == len(objects) else None


def _wrong_address(event: evt.Event) -> int:
    """Return the status for a report that is of another service, 0 for one of storage commitment."""
    request: Any = event.request
    if request.AffectedSOPClassUID != COMMITMENT:
        return NO_SUCH_CLASS
    if request.AffectedSOPInstanceUID != COMMITMENT_INSTANCE:
        return NO_SUCH_OBJECT
    return 0 if event.event_type in REPORTS else NO_SUCH_EVENT


def _named(report: Dataset, sequence: str) -> dict[str, str]:
    """Return the SOP class of each object that a sequence of a report names."""
    items = report.get(sequence) or ()
    return {str(one.get("ReferencedSOPInstanceUID")): str(one.get("ReferencedSOPClassUID")) for one in items}


class _PromptSocket(ssl.SSLSocket):
    """A connection whose handshake has an end: pynetdicom accepts no other while one is under way, nor stops."""

    def do_handshake(self, block: bool = False) -> None:
        self.settimeout(CONNECT_S)
        super().do_handshake(block)
        self.settimeout(None)


def _listening_tls(settings: DicomSection) -> ssl.SSLContext | None:
    if settings.tls_authority is None or settings.tls_certificate is None:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH, cafile=settings.tls_authority)
    context.sslsocket_class = _PromptSocket
    context.verify_mode = ssl.CERT_REQUIRED
    context.load_cert_chain(settings.tls_certificate, settings.tls_key)
    return context
