"""A measurement of the store as DICOM objects, and objects as files."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from pydicom import dcmwrite
from pydicom.dataset import Dataset

from device.dicom.image import image_of
from device.dicom.report import report_of
from device.dicom.subject import WRITTEN, DicomSubject, OrderedStudy, ToldOfStudy, object_uid, require_writable
from device.errors import DeletedRecording
from device.files.recording_file import read_head
from device.records.store import Store, StoredRecord

PictureOf = Callable[[Path], bytes]
"""Returns the picture of a recording as PNG, drawn anew where an earlier release kept none."""


@dataclass(frozen=True)
class Writable:
    """What can be written of an exam's measurements, and why each other cannot be, by its id."""

    subjects: tuple[DicomSubject, ...]
    missing: dict[str, str]


class DicomWriter:
    """Writes measurements of a store. Raises as `Store.measurement` and `recording_path`."""

    def __init__(self, store: Store, picture_of: PictureOf, institution: str = "") -> None:
        """Take the store, who draws pictures, and the hospital's name."""
        self._store, self._picture_of, self._institution = store, picture_of, institution

    def subject(
        self, measurement_id: str, exam: dict[str, Any], order: OrderedStudy | None, study: ToldOfStudy
    ) -> DicomSubject:
        """Return what is written of a measurement as it was measured, of an exam as it is given, and of its study.

        Raises `InvalidRequest` when an identifier of the exam cannot be written.
        """
        require_writable(exam)
        measurement = self._store.measurement(measurement_id)
        head = read_head(self._store.recording_path(measurement["recording_id"]))
        said = measurement, exam, head, self._institution, order
        generation = self._generation(measurement_id, exam, order)
        return DicomSubject(*said, generation=generation, study_at=study.at, study_id=study.id)

    def writable(
        self, measurements: Iterable[StoredRecord], exam: StoredRecord, order: OrderedStudy | None, study: ToldOfStudy
    ) -> Writable:
        """Return what can be written of these: all but what a rule has deleted the recording of."""
        subjects, missing = [], {}
        for one in measurements:
            try:
                subjects.append(self.subject(one["id"], exam, order, study))
            except DeletedRecording as error:
                missing[one["id"]] = error.cause
        return Writable(tuple(subjects), missing)

    def uids(self, measurement_id: str, exam: StoredRecord, order: OrderedStudy | None) -> set[str]:
        """Return the identifiers of what is written of a measurement now, whether or not it still can be."""
        generation = self._generation(measurement_id, exam, order)
        return {object_uid(kind, measurement_id, exam, order, generation) for kind in WRITTEN}

    def _generation(self, measurement_id: str, exam: dict[str, Any], order: OrderedStudy | None) -> int:
        """Return how often what an exam says of a measurement was taken back from the archive."""
        for generation in count():
            uids = [object_uid(kind, measurement_id, exam, order, generation) for kind in WRITTEN]
            if not self._store.outbox.is_any_recalled(uids):
                return generation
        raise AssertionError("counting has no end")

    def image(self, subject: DicomSubject) -> Dataset:
        """Return the image of a measurement."""
        return image_of(subject, self._picture_of(self._store.recording_path(subject.measurement["recording_id"])))

    def report(self, subject: DicomSubject) -> Dataset:
        """Return the report of a measurement."""
        return report_of(subject)


def as_file(data: Dataset) -> bytes:
    """Return an object as a file of DICOM part 10."""
    content = io.BytesIO()
    dcmwrite(content, data, enforce_file_format=True)
    return content.getvalue()
