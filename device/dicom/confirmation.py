"""Whether the archive keeps what it got: it is asked what it has, or commits itself to keep it.

A query (C-FIND) needs no open port here. Storage commitment (PS3.4 annex J) is answered on an association that the
archive begins, so for that a port is open while an answer is awaited, and no longer.
"""

from __future__ import annotations

import queue
import ssl
from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from uuid import uuid4

from pydicom.dataset import Dataset
from pydicom.sequence import Sequence as Items
from pynetdicom import evt

from device.config import DicomSection
from device.dicom.association import (
    COMMITMENT,
    COMMITMENT_INSTANCE,
    STUDY_FIND,
    RemoteProgram,
    application,
    associated,
    status_of,
    unreachable,
)
from device.dicom.shared_modules import reference
from device.dicom.subject import uid_of

REPORT_S = 60.0
"""So long a report of commitment is awaited; later ones are asked for anew."""
REQUEST = 1
SUCCESS, PENDING = 0x0000, (0xFF00, 0xFF01)


@dataclass(frozen=True)
class SentObject:
    """An object that the archive has taken, by what an archive finds it by."""

    uid: str
    sop_class: str
    study_uid: str
    series_uid: str


def confirmed_uids(
    archive: RemoteProgram, settings: DicomSection, objects: Sequence[SentObject]
) -> tuple[set[str], set[str]]:
    """Return which objects the archive says it keeps, and which it says it has not; of others it has said nothing.

    Raises `ArchiveUnreachable`.
    """
    if settings.commitment_port is None:
        return _found(archive, settings, objects), set()
    return _committed(archive, settings, objects)


def _found(archive: RemoteProgram, settings: DicomSection, objects: Sequence[SentObject]) -> set[str]:
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


def _committed(
    archive: RemoteProgram, settings: DicomSection, objects: Sequence[SentObject]
) -> tuple[set[str], set[str]]:
    asked = Dataset()
    asked.TransactionUID = uid_of("transaction", str(uuid4()))
    asked.ReferencedSOPSequence = Items([reference(one.sop_class, one.uid) for one in objects])
    with _reports(archive, settings) as reports:
        with associated(archive, settings, [COMMITMENT]) as association:
            answer, _ = association.send_n_action(asked, REQUEST, COMMITMENT, COMMITMENT_INSTANCE)
        if status_of(answer) != 0:
            raise unreachable(archive, "does not take a request for storage commitment")
        return _report_of(asked.TransactionUID, reports)


def _report_of(transaction_uid: str, reports: queue.Queue[Dataset]) -> tuple[set[str], set[str]]:
    """Return what the report of a transaction says, nothing when there comes none; older ones are passed over."""
    while True:
        try:
            report = reports.get(timeout=REPORT_S)
        except queue.Empty:
            return set(), set()
        if report.get("TransactionUID") == transaction_uid:
            return _uids(report, "ReferencedSOPSequence"), _uids(report, "FailedSOPSequence")


def _uids(report: Dataset, sequence: str) -> set[str]:
    return {str(item.ReferencedSOPInstanceUID) for item in report.get(sequence) or ()}


@contextmanager
def _reports(archive: RemoteProgram, settings: DicomSection) -> Iterator[queue.Queue[Dataset]]:
    """Listen for reports of the archive, and nobody else, until the block ends."""
    reports: queue.Queue[Dataset] = queue.Queue()

    def take(event: evt.Event) -> tuple[int, None]:
        reports.put(event.event_information)
        return 0x0000, None

    own = application(settings)
    own.require_calling_aet, own.require_called_aet = [archive.title], True
    own.add_supported_context(COMMITMENT, scu_role=True, scp_role=True)
    port = settings.commitment_port or 0
    try:
        server = own.start_server(
            ("", port), block=False, evt_handlers=[(evt.EVT_N_EVENT_REPORT, take)], ssl_context=_listening_tls(settings)
        )
    except OSError as error:
        raise unreachable(archive, f"is not asked, for its answer cannot be heard at port {port}: {error}") from error
    assert server is not None  # as it does not block
    try:
        yield reports
    finally:
        server.shutdown()


def _listening_tls(settings: DicomSection) -> ssl.SSLContext | None:
    if settings.tls_authority is None or settings.tls_certificate is None:
        return None
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH, cafile=settings.tls_authority)
    context.verify_mode = ssl.CERT_REQUIRED
    context.load_cert_chain(settings.tls_certificate, settings.tls_key)
    return context
