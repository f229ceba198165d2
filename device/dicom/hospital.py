"""What the daemon knows of the hospital: the one door to this room. It imports DICOM's libraries when first needed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict
from datetime import date
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from device.config import DicomSection
from device.dicom.sender import Sender
from device.dicom.subject import OrderedStudy, require_writable
from device.errors import DeviceError, NotSetUp, UnknownResource
from device.records.asked_once import AskedOnce
from device.records.exams import exam_content
from device.records.store import Store, StoredRecord

if TYPE_CHECKING:
    from device.dicom.delivery import Delivery
    from device.dicom.objects import DicomWriter
    from device.dicom.outgoing import Outgoing

MOST_SHOWN = 1000
"""Steps of the worklist that an exam can be made of: those that were shown last."""


class Hospital:
    """Exams in the hospital's formats, and the way to its archive; all methods may be called from any thread."""

    def __init__(
        self,
        settings: DicomSection,
        store: Store,
        picture_of: Callable[[Path], bytes],
        tell: Callable[[DeviceError | None], None] = lambda fault: None,
        is_busy: Callable[[], bool] = lambda: False,
        is_clock_steady: Callable[[], bool] = lambda: True,
    ) -> None:
        """Take the settings, the store, who returns the picture (a PNG) of a kept recording, and whom to tell faults.

        Nothing is sent before `start`, nor while the probe is busy with a press; names are erased by a steady clock.
        """
        self._settings, self._store, self._picture_of = settings, store, picture_of
        self._tell, self._is_busy, self._is_clock_steady = tell, is_busy, is_clock_steady
        self._shown: dict[str, OrderedStudy] = {}

    def start(self) -> None:
        """Begin to send what waits, if there is an archive, and to erase names in any case."""
        self._sender.start()

    def close(self) -> None:
        """End sending; what waits is sent after the next start."""
        self._sender.close()

    def files_of(self, exam_id: str) -> bytes:
        """Return an exam as DICOM files in one .zip; raises as `exam_zip`."""
        from device.dicom.exam_files import exam_zip

        return exam_zip(self._store, self._writer, exam_id)

    def send(self, exam_id: str, *, version: int, by: str) -> dict[str, str]:
        """Queue an exam as it was seen in a version; return and raise as `Outgoing.queue`.

        Raises `NotSetUp` when no archive is set.
        """
        if self._settings.archive_host is None:
            raise NotSetUp("No archive is set.", "Set dicom.archive_host, its port and its title.")
        missing = self._outgoing.queue(exam_id, version=version, by=by)
        self._sender.wake()
        return missing

    def objects_of(self, exam_id: str) -> list[StoredRecord]:
        """Return the objects of an exam that were ever to be at the archive, oldest first."""
        self._store.exams.exam(exam_id)
        return [_told(row) for row in self._store.outbox.of_exam(exam_id)]

    def scheduled(self, day: date | None, patient_ref: str | None, order_number: str | None) -> list[dict[str, Any]]:
        """Return what the worklist has, of a day, a patient or an order; raises as `scheduled_steps`.

        Raises `NotSetUp` when no worklist is set.
        """
        if self._settings.worklist_host is None:
            raise NotSetUp("No worklist is set.", "Set dicom.worklist_host, its port and its title.")
        from device.dicom.association import worklist_of
        from device.dicom.worklist import WorklistQuery, scheduled_steps

        remote = worklist_of(self._settings)
        assert remote is not None  # as its host is set
        steps = scheduled_steps(remote, self._settings, WorklistQuery(day, patient_ref, order_number))
        self._shown = {**self._shown, **{step.id: step.order for step in steps}}
        self._shown = dict(list(self._shown.items())[-MOST_SHOWN:])
        return [step.as_record() for step in steps]

    def begin_exam(self, step_id: str, said: dict[str, Any], once: AskedOnce | None = None) -> StoredRecord:
        """Make an exam of a step that was shown, and of what the operator says beside; return it.

        Raises `UnknownResource` for a step that was not shown since the start, `InvalidRequest` when patient or order
        are none that an exam can have, and `ReusedKey`.
        """
        if once and (kept := self._store.answer_to(once)):
            return kept
        order = self._shown.get(step_id)
        if order is None:
            raise UnknownResource(f"The worklist has shown no step {step_id}.", "Ask for the worklist again.")
        whose = {"kind": "patient", "patient_ref": order.patient_ref, "order_number": order.order_number or None}
        content = exam_content({**said, **whose})
        require_writable(content.model_dump())
        told = asdict(order)
        patient = told.pop("patient")
        outbox = self._store.outbox
        return self._store.exams.make(content, once, lambda db, exam_id: outbox.order(db, exam_id, told, patient))

    def as_record(self) -> dict[str, Any]:
        """Return where archive and worklist are, how many objects are in which state, and what is wrong."""
        said, counts = self._settings, self._store.outbox.counts()
        state = self._sender.state
        return {
            "own_title": said.own_title,
            "archive": _place(said.archive_host, said.archive_port, said.archive_title),
            "worklist": _place(said.worklist_host, said.worklist_port, said.worklist_title),
            "send_phantoms": said.send_phantoms,
            "objects": counts,
            "fault": state.fault.as_record() if state.fault else None,
            "next_try_at": state.next_try_at,
        }

    @cached_property
    def _sender(self) -> Sender:
        days, deliver = (
            self._settings.demographics_days,
            self._delivery if self._settings.archive_host is not None else None,
        )
        return Sender(
            self._store.outbox,
            deliver,
            keep_patients_days=days,
            tell=self._tell,
            is_busy=self._is_busy,
            is_clock_steady=self._is_clock_steady,
        )

    @cached_property
    def _writer(self) -> DicomWriter:
        from device.dicom.objects import DicomWriter

        return DicomWriter(self._store, self._picture_of, self._settings.institution)

    @cached_property
    def _outgoing(self) -> Outgoing:
        from device.dicom.outgoing import Outgoing

        return Outgoing(self._store, self._writer, with_phantoms=self._settings.send_phantoms)

    def _delivery(self) -> Delivery:
        from device.dicom.association import archive_of
        from device.dicom.delivery import Delivery

        archive = archive_of(self._settings)
        assert archive is not None  # or there were no sender
        return Delivery(self._settings, archive, self._store, self._outgoing)


def _told(row: StoredRecord) -> StoredRecord:
    about = row.pop("about")  # what is written again is no answer to anybody
    return {**row, "kind": about["kind"], "study_uid": about["study_uid"]}


def _place(host: str | None, port: int, title: str) -> dict[str, Any] | None:
    return None if host is None else {"host": host, "port": port, "title": title}
