"""An archive on loopback that takes everything, and commits itself when it is told to: late, twice or wrongly."""

from __future__ import annotations

import queue
import threading
from collections.abc import Collection
from typing import Any

from free_port import free_port
from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pynetdicom import AE, build_role, evt
from pynetdicom.association import Association
from pynetdicom.pdu import P_DATA_TF
from stand_in_archive import TITLE, StandInArchive

from device.config import DicomSection
from device.dicom.association import COMMITMENT, COMMITMENT_INSTANCE
from device.dicom.shared_modules import reference

ALL_KEPT, FAILURES = 1, 2


class CommittingArchive(StandInArchive):
    """Notes each request (`requests`) and answers it with `takes`; a report is sent by the test."""

    def __init__(self) -> None:
        super().__init__()
        self.requests: list[Dataset] = []
        self.takes = 0x0000
        self.reports_in_association = False
        self.answered_in_association: queue.Queue[int] = queue.Queue()
        self.port = free_port()
        self._server.bind(evt.EVT_N_ACTION, self._request)
        self._server.bind(evt.EVT_PDU_SENT, self._answered)

    def settings(self, **more: Any) -> DicomSection:
        port = self._server.socket.getsockname()[1]
        stated = {"archive_host": "127.0.0.1", "archive_port": port, "archive_title": TITLE}
        return DicomSection(**{**stated, "commitment_port": self.port, **more})

    def _request(self, event: evt.Event) -> tuple[int, Dataset | None]:
        self.requests.append(event.action_information)
        return self.takes, None

    def _answered(self, event: evt.Event) -> None:
        """Report right behind the answer to the request, in the association in which it came."""
        if self.reports_in_association and self.requests and isinstance(event.pdu, P_DATA_TF):
            self.reports_in_association = False
            threading.Thread(target=self._report_in, args=(event.assoc,)).start()

    def _report_in(self, association: Association) -> None:
        report = report_of(self.requests[-1])
        answer, _ = association.send_n_event_report(report, ALL_KEPT, COMMITMENT, COMMITMENT_INSTANCE)
        self.answered_in_association.put(int(answer.Status))

    def report(
        self,
        report: Dataset | None,
        *,
        title: str = TITLE,
        event_type: int = ALL_KEPT,
        sop_class: str = COMMITMENT,
        instance: str = COMMITMENT_INSTANCE,
    ) -> int | None:
        """Send a report in an association of its own; return the status of the answer, None where there is none.

        The archive is the provider of the service, though it begins the association: PS3.4 J.3.3.
        """
        own, provider = AE(ae_title=title), build_role(COMMITMENT, scu_role=True, scp_role=True)
        own.add_requested_context(COMMITMENT)
        association = own.associate("127.0.0.1", self.port, ae_title="TSIS", ext_neg=[provider])
        if not association.is_established:
            return None
        answer, _ = association.send_n_event_report(report, event_type, sop_class, instance, meta_uid=COMMITMENT)
        association.release()
        return int(answer.Status) if "Status" in answer else None


def report_of(request: Dataset, *, failed: Collection[str] = (), unsaid: Collection[str] = ()) -> Dataset:
    """Return the report that all of a request is kept, but for what has `failed` and what it says nothing of."""
    report = Dataset()
    report.TransactionUID = request.TransactionUID
    asked = [
        (str(one.ReferencedSOPClassUID), str(one.ReferencedSOPInstanceUID)) for one in request.ReferencedSOPSequence
    ]
    kept = [reference(sop_class, uid) for sop_class, uid in asked if uid not in (*failed, *unsaid)]
    lost = [reference(sop_class, uid) for sop_class, uid in asked if uid in failed]
    if kept:
        report.ReferencedSOPSequence = Sequence(kept)
    for one in lost:
        one.FailureReason = 0x0112
    if lost:
        report.FailedSOPSequence = Sequence(lost)
    return report
