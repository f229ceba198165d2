"""An exam to rows of the outbox, a row to its object, and rows that are not right any more to what recalls them.

A measurement that is void, or belongs to another exam, or whose exam says something else now, must not stay at the
archive as if it were right: each of its objects there gets a note that it is rejected (IHE IOCM).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, replace
from typing import Any

from pydicom.dataset import Dataset

from device.dicom.objects import DicomWriter
from device.dicom.rejection import rejection_of
from device.dicom.subject import (
    WRITTEN,
    DicomSubject,
    ObjectKind,
    OrderedStudy,
    ToldOfStudy,
    begun_at,
    object_uid,
    require_writable,
    study_id,
    study_uid,
    uid_of,
)
from device.errors import DeletedRecording, InvalidRequest
from device.files.recording_file import RecordingHead
from device.measurement.recording.recording import CameraSettings
from device.records.audit import utc_now
from device.records.outbox import OutboxItem
from device.records.store import Store, StoredRecord

AT_ONCE = 200
"""So many measurements are read of an exam at a time."""


class Outgoing:
    """What a store's exams mean to the archive."""

    def __init__(self, store: Store, writer: DicomWriter, *, with_phantoms: bool) -> None:
        """Take the store, what writes objects, and whether exams of phantoms and simulated presses are sent."""
        self._store, self._writer, self._with_phantoms = store, writer, with_phantoms

    def queue(self, exam_id: str, *, version: int, by: str) -> dict[str, str]:
        """Queue all of an exam that counts, and again what was refused: also notes that recall what does not.

        Return why each measurement that was never sent cannot be any more: a rule has deleted its recording. Raises as
        `Exams.exam`, and `InvalidRequest` when there is nothing of it to send, it is a phantom's or has a simulated
        press, or an identifier of it cannot be written.
        """
        exam = self._store.exams.exam(exam_id, version)
        if exam["kind"] == "phantom" and not self._with_phantoms:
            raise InvalidRequest("Exams of phantoms are not sent.", "Set dicom.send_phantoms if they are to be.")
        require_writable(exam)
        is_note_left = self._store.outbox.has_refused(exam_id)
        counting = counting_measurements(self._store, exam_id, may_be_none=is_note_left)
        order = ordered_study(self._store, exam_id)
        study = told_of_study(self._store, exam, order, counting)
        found = self._writer.writable(counting, exam, order, study)
        subjects = self._real(found.subjects, may_be_none=is_note_left)
        items = [_item(kind, subject) for subject in subjects for kind in WRITTEN]
        sent = {row["uid"] for row in self._store.outbox.of_exam(exam_id) if row["state"] != "withdrawn"}
        missing = {name: why for name, why in found.missing.items() if not self._writer.uids(name, exam, order) <= sent}
        if missing and not items and not is_note_left:
            raise nothing_is_left(exam_id)
        self._store.outbox.add(exam_id, items, by=by, exam_version=version)
        return missing

    def _real(self, subjects: Sequence[DicomSubject], *, may_be_none: bool) -> Sequence[DicomSubject]:
        """Return what may be sent: under a patient's number simulated presses would be read as a patient's.

        Raises `InvalidRequest` for these, unless something else is to go: what recalls a wrong object must not wait.
        """
        simulated = [str(one.measurement["seq"]) for one in subjects if one.head.simulated]
        if self._with_phantoms or not simulated:
            return subjects
        if not may_be_none:
            cause = f"Simulated presses are not sent; in this exam, by their numbers: {', '.join(simulated)}."
            raise InvalidRequest(cause, "Void them, or set dicom.send_phantoms if they are to be sent.")
        return [one for one in subjects if not one.head.simulated]

    def written(self, row: StoredRecord) -> Dataset:
        """Return the object of a row; raises as `DicomWriter.image`, and `UnknownResource`."""
        subject, kind = self._subject(row), row["about"]["kind"]
        if kind == "rejection":
            return rejection_of(subject, row["uid"], row["about"]["rejects"], row["about"]["why"])
        return self._writer.image(subject) if kind == "image" else self._writer.report(subject)

    def _subject(self, row: StoredRecord) -> DicomSubject:
        """Return what a row is written of, as it was when the row was queued."""
        about = row["about"]
        kept = ordered_study(self._store, row["exam_id"])
        patient = kept.patient if kept else {}
        order = OrderedStudy(**about["order"], patient=patient) if about["order"] else None
        head = RecordingHead(**{**about["head"], "camera": CameraSettings(**about["head"]["camera"])})
        measurement = self._store.measurement(row["measurement_id"])
        rejected_at = about.get("rejected_at") or about.get("written_at", "")  # as it was called before
        said = measurement, about["exam"], head, about["institution"], order, rejected_at
        return DicomSubject(*said, about.get("generation", 0), about.get("study_at", ""), about.get("study_id", ""))

    def take_back_what_is_wrong(self) -> int:
        """Withdraw or recall every object that is not right any more; return how many."""
        taken = 0
        for row, exam, filing in self._store.outbox.changed_since():
            if row["about"]["kind"] == "rejection" or not (why := self._wrong(row, exam, filing)):
                versions = {"exam_version": exam["version"], "filing_version": filing["version"]}
                self._store.outbox.hold_on(row["uid"], **versions)
                continue
            about = _about("rejection", replace(self._subject(row), rejected_at=utc_now()))
            about |= {"rejects": {"uid": row["uid"], **row["about"]}, "why": why}
            ids = uid_of("rejection", row["uid"]), row["exam_id"], row["measurement_id"]
            recall = OutboxItem(*ids, exam["version"], filing["version"], about)
            self._store.outbox.take_back(row["uid"], recall, why)
            taken += 1
        return taken

    def _wrong(self, row: StoredRecord, exam: StoredRecord, filing: StoredRecord) -> str:
        """Return why a row is not right any more, "" when it is."""
        if filing["voided"]:
            return f"The measurement does not count: {filing['voided']['reason']}"
        if filing["exam_id"] != row["exam_id"]:
            return "The measurement belongs to another exam."
        order, about = ordered_study(self._store, row["exam_id"]), row["about"]
        uid = object_uid(about["kind"], row["measurement_id"], exam, order, about.get("generation", 0))
        return "" if uid == row["uid"] else "The exam was corrected."


def nothing_is_left(exam_id: str) -> DeletedRecording:
    """Return that a rule has deleted every recording of an exam."""
    cause = f"Nothing of the exam {exam_id} can be written any more: a rule has deleted its recordings."
    return DeletedRecording(cause, "Its numbers are in exports and in report.pdf; recordings may be in a backup.")


def _item(kind: ObjectKind, subject: DicomSubject) -> OutboxItem:
    exam, measurement = subject.exam, subject.measurement
    ids = subject.uid(kind), exam["id"], measurement["id"]
    return OutboxItem(*ids, exam["version"], measurement["version"], _about(kind, subject))


def _about(kind: ObjectKind, subject: DicomSubject) -> dict[str, Any]:
    """Return what is needed to write an object again, beside its measurement, and where the archive has it."""
    order = asdict(subject.order) if subject.order else None
    if order:
        del order["patient"]  # kept apart, to be erased
    return {
        "kind": kind,
        "exam": subject.exam,
        "order": order,
        "head": asdict(subject.head),
        "institution": subject.institution,
        "rejected_at": subject.rejected_at,
        "generation": subject.generation,
        "study_at": subject.study_at,
        "study_id": subject.study_id,
        "study_uid": subject.study_uid,
        "series_uid": subject.series_uid(kind),
    }


def ordered_study(store: Store, exam_id: str) -> OrderedStudy | None:
    """Return what the worklist has said of an exam, None when it was not made from it."""
    kept = store.outbox.ordered(exam_id)
    return OrderedStudy(**kept[0], patient=kept[1]) if kept else None


def told_of_study(
    store: Store, exam: StoredRecord, order: OrderedStudy | None, counting: Sequence[StoredRecord]
) -> ToldOfStudy:
    """Return what all objects of an exam's study say: as it was first sent, else as its first exam on this probe says.

    Of exams that a release before has sent under one study, each with a number and time of its own, each keeps these.
    """
    uid = study_uid(exam, order)
    exams = store.outbox.ordered_with(uid) or [exam]
    rows = (row["about"] for one in (exam, *exams) for row in store.outbox.of_exam(one["id"]))
    if sent := next((about for about in rows if about["study_uid"] == uid), None):
        begun = sent["exam"]
        return ToldOfStudy(sent.get("study_id", str(begun["seq"])), sent.get("study_at", begun["made_at"]))
    orders = [ordered_study(store, one["id"]) for one in exams]
    of_study = (pair for pair in zip(exams, orders, strict=True) if study_uid(*pair) == uid)
    first, its_order = next(of_study, (exam, order))  # none: another client corrects it meanwhile
    of_first = counting_measurements(store, first["id"], may_be_none=True) if first["id"] != exam["id"] else ()
    presses = of_first or counting
    return ToldOfStudy(study_id(first, its_order), begun_at(first, (one["taken_at"] for one in presses)))


def counting_measurements(store: Store, exam_id: str, *, may_be_none: bool = False) -> list[dict[str, Any]]:
    """Return the measurements of an exam that are not void; raise `InvalidRequest` when there is and may be none."""
    counting, before_seq = list[dict[str, Any]](), 2**63 - 1
    while found := store.measurements(before_seq=before_seq, limit=AT_ONCE, exam_id=exam_id):
        counting += [one for one in found if not one["voided"]]
        before_seq = found[-1]["seq"]
    if not counting and not may_be_none:
        raise InvalidRequest(f"The exam {exam_id} has no measurement that counts.", "Measure first.")
    return counting
