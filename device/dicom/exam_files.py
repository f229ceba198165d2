"""All of an exam that counts as DICOM files in one .zip, for a PC that fetches them itself."""

from __future__ import annotations

import io
import zipfile
from datetime import UTC, datetime

from device.dicom.objects import DicomWriter, as_file
from device.dicom.subject import OrderedStudy
from device.errors import InvalidRequest
from device.records.store import Store, StoredRecord

MOST_MEASUREMENTS = 200


def exam_zip(store: Store, writer: DicomWriter, exam_id: str, order: OrderedStudy | None) -> bytes:
    """Return a .zip with the image and the report of every measurement of an exam that is not void.

    Raises `UnknownResource` for the exam, `InvalidRequest` when it has no measurement or cannot be written.
    """
    exam = store.exams.exam(exam_id)
    counting = [one for one in _measurements(store, exam_id) if not one["voided"]]
    if not counting:
        raise InvalidRequest(f"The exam {exam_id} has no measurement that counts.", "Measure first.")
    written_at = datetime.now(UTC).isoformat(timespec="milliseconds")
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for measurement in counting:
            subject = writer.subject(measurement["id"], exam, order, written_at)
            archive.writestr(f"image-{measurement['seq']}.dcm", as_file(writer.image(subject)))
            archive.writestr(f"report-{measurement['seq']}.dcm", as_file(writer.report(subject)))
    return content.getvalue()


def _measurements(store: Store, exam_id: str) -> list[StoredRecord]:
    return store.measurements(before_seq=2**63 - 1, limit=MOST_MEASUREMENTS, exam_id=exam_id)
