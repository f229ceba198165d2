"""An association with a program of the hospital, in the clear or by TLS, and what it means when there is none.

Nothing of pynetdicom's own is logged: its log prints patients' data.
"""

from __future__ import annotations

import logging
import ssl
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import pynetdicom.association
from pydicom.dataset import Dataset
from pydicom.uid import UID
from pynetdicom import AE, evt
from pynetdicom.association import Association
from pynetdicom.dul import DULServiceProvider
from pynetdicom.pdu import A_ASSOCIATE_RJ

from device.config import DicomSection
from device.dicom.subject import IMPLEMENTATION_NAME, IMPLEMENTATION_UID
from device.errors import ArchiveUnreachable, ArchiveUntrusted
from device.sending.tls_failure import TlsProblem, tls_failure

logging.getLogger("pynetdicom").setLevel(logging.CRITICAL)

VERIFICATION, WORKLIST_FIND = UID("1.2.840.10008.1.1"), UID("1.2.840.10008.5.1.4.31")
STUDY_FIND = UID("1.2.840.10008.5.1.4.1.2.2.1")
COMMITMENT, COMMITMENT_INSTANCE = UID("1.2.840.10008.1.20.1"), UID("1.2.840.10008.1.20.1.1")
"""SOP classes of services, PS3.4; pynetdicom makes its names of them while it runs, where no check of types sees them.
"""
CONNECT_S, ANSWER_S, LOOK_S = 10.0, 30.0, 0.1
REMEDIES: dict[TlsProblem, str] = {
    "untrusted": "Let IT add the authority that signed the {what}'s certificate to the file of dicom.tls_authority.",
    "expired": "Check the probe's clock; if it is right, the {what} needs a new certificate.",
    "not_yet_valid": "Check the probe's clock: it may be behind.",
    "other_name": "Set dicom.{what}_host to a name that the {what}'s certificate is for, or have it made for this one.",
    "own_refused": "Set dicom.tls_certificate and tls_key to ones that are valid, and let the {what} trust them.",
    "no_tls": "Set dicom.{what}_port to the {what}'s port for TLS, or let IT switch TLS on there.",
    "other": "Compare the {what}'s settings of TLS with TLS 1.2 and newer, which this probe speaks.",
}
"""What IT does where TLS fails."""

OnReport = Callable[[evt.Event], tuple[int, None]]
"""What answers a report of the remote program with a status."""


class UnawaitedProvider(DULServiceProvider):
    """pynetdicom's thread that has the connection, which would keep a stop of the daemon waiting for a silent archive.

    It may be in a connect that takes ten seconds; a process ends without waiting for a daemonic thread.
    """

    def start(self) -> None:
        """Begin."""
        self.daemon = True
        super().start()


pynetdicom.association.DULServiceProvider = UnawaitedProvider  # type: ignore[attr-defined]


@dataclass(frozen=True)
class RemoteProgram:
    """A program of the hospital in DICOM's network: `what` it is in words."""

    what: str
    host: str
    port: int
    title: str

    def __str__(self) -> str:
        return f"{self.what} {self.title} at {self.host}:{self.port}"


def archive_of(settings: DicomSection) -> RemoteProgram | None:
    """Return the archive, if there is one."""
    if settings.archive_host is None:
        return None
    return RemoteProgram("archive", settings.archive_host, settings.archive_port, settings.archive_title)


def worklist_of(settings: DicomSection) -> RemoteProgram | None:
    """Return what keeps the worklist, if there is one."""
    if settings.worklist_host is None:
        return None
    return RemoteProgram("worklist", settings.worklist_host, settings.worklist_port, settings.worklist_title)


def application(settings: DicomSection) -> AE:
    """Return this probe as a program in DICOM's network."""
    own = AE(ae_title=settings.own_title)
    own.implementation_class_uid, own.implementation_version_name = IMPLEMENTATION_UID, IMPLEMENTATION_NAME
    own.connection_timeout = own.acse_timeout = CONNECT_S
    own.dimse_timeout = own.network_timeout = ANSWER_S
    return own


@contextmanager
def associated(
    remote: RemoteProgram,
    settings: DicomSection,
    sop_classes: Sequence[str],
    on_report: OnReport | None = None,
) -> Iterator[Association]:
    """Associate for some SOP classes until the block ends; raise `ArchiveUnreachable` saying why that fails.

    `on_report` answers what the remote program reports of itself meanwhile (N-EVENT-REPORT).
    """
    own, tls = application(settings), _tls(settings, remote)
    for sop_class in sop_classes:
        own.add_requested_context(sop_class)
    heard = _Heard()
    handlers: list[Any] = [(evt.EVT_CONN_OPEN, heard.connection), (evt.EVT_PDU_RECV, heard.pdu)]
    answering: list[threading.Thread] = []
    if on_report:
        handlers.append((evt.EVT_N_EVENT_REPORT, _noted(on_report, answering)))
    association = own.associate(
        remote.host,
        remote.port,
        ae_title=remote.title,
        tls_args=tls,
        evt_handlers=handlers,
    )
    if not association.is_established:
        untrusted = _untrusted(remote, tls[0]) if tls and not heard.is_refused else None
        raise untrusted or unreachable(remote, heard.why_not(settings.own_title))
    try:
        yield association
    finally:
        for thread in answering:  # an answer that comes behind the release ends the connection instead
            thread.join(ANSWER_S)
        _end(association)


def _noted(on_report: OnReport, answering: list[threading.Thread]) -> OnReport:
    """Return what answers a report and notes which thread does: pynetdicom begins one for each report."""

    def answer(event: evt.Event) -> tuple[int, None]:
        answering.append(threading.current_thread())
        return on_report(event)

    return answer


def _end(association: Association) -> None:
    """Release an association, or abort what is none any more.

    pynetdicom's `release` (3.0.4, association.py) holds its own thread and then waits until that says that it pauses.
    It waits for ever where that thread has ended, as when the remote program releases at the same moment, and where
    the thread of a report has ended since it paused, which says that it does not. A moment later it pauses, or is none.
    """
    if not association.is_established:
        association.abort(block=False)
        return
    releasing = threading.Thread(target=association.release, name="release", daemon=True)
    releasing.start()
    while releasing.is_alive():
        releasing.join(LOOK_S)
        association._is_paused = True


def unreachable(remote: RemoteProgram, why: str) -> ArchiveUnreachable:
    """Return the error of a program that does not answer."""
    remedy = "Check network and settings with `python -m device dicom echo`; what waits is sent by itself."
    return ArchiveUnreachable(f"The {remote} {why}.", remedy)


def status_of(answer: Dataset) -> int | None:
    """Return the status of an answer, None when the connection was lost before it came."""
    status = answer.get("Status")
    return None if status is None else int(status)


def echo(remote: RemoteProgram, settings: DicomSection) -> None:
    """Ask a program whether it is there (C-ECHO); raise `ArchiveUnreachable` when it does not say so."""
    with associated(remote, settings, [VERIFICATION]) as association:
        status = status_of(association.send_c_echo())
    if status != 0:
        raise unreachable(remote, "gives no answer" if status is None else f"answers with status {status:#06x}")


class _Heard:
    """What came of asking for an association, as pynetdicom's thread of the connection hears it.

    `Association.is_rejected` would say it, too, but not when the remote program closes right behind its refusal:
    pynetdicom's other thread then finds the connection gone and takes the refusal for none (one time in nine).
    """

    def __init__(self) -> None:
        self._is_connected, self._refusal = False, ""

    def connection(self, _event: evt.Event) -> None:
        self._is_connected = True

    def pdu(self, event: evt.Event) -> None:
        if isinstance(event.pdu, A_ASSOCIATE_RJ):
            self._refusal = event.pdu.reason_str

    @property
    def is_refused(self) -> bool:
        return bool(self._refusal)

    def why_not(self, own_title: str) -> str:
        if self._refusal:
            return f"rejects {own_title}: {self._refusal}"
        if self._is_connected:
            return "takes none of what this probe offers, or broke the connection off"
        return "cannot be reached"


def _tls(settings: DicomSection, remote: RemoteProgram) -> tuple[ssl.SSLContext, str] | None:
    if settings.tls_authority is None:
        return None
    try:
        context = ssl.create_default_context(cafile=settings.tls_authority)
        if settings.tls_certificate:
            context.load_cert_chain(settings.tls_certificate, settings.tls_key)
    except OSError as error:
        cause = f"The {remote} is not asked, for a certificate of the settings cannot be read: {error}."
        remedy = "Check dicom.tls_authority, tls_certificate and tls_key: PEM files that the daemon may read."
        raise ArchiveUntrusted(cause, remedy) from error
    return context, remote.host


def _untrusted(remote: RemoteProgram, context: ssl.SSLContext) -> ArchiveUntrusted | None:
    """Return why TLS is what failed, None where it is not: pynetdicom tells neither."""
    failure = tls_failure(context, remote.host, remote.port)
    if failure is None:
        return None
    remedy = REMEDIES[failure.problem].format(what=remote.what)
    return ArchiveUntrusted(f"The {remote} {failure.why}.", f"{remedy} What waits is sent by itself then.")
