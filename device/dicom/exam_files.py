"""All of an exam that counts as DICOM files in one .zip, for a PC that fetches them itself."""

from __future__ import annotations

import csv
import io
import zipfile

from device.dicom.objects import DicomWriter, as_file
from device.dicom.outgoing import counting_measurements, nothing_is_left, ordered_study, told_of_study
from device.records.store import Store


def exam_zip(store: Store, writer: DicomWriter, exam_id: str) -> bytes:
    """Return a .zip with the image and the report of every measurement of an exam that is not void.

    Where a rule has deleted recordings `missing.csv` names them. Raises `UnknownResource` for the exam,
    `InvalidRequest` when it has no measurement or cannot be written, and `DeletedRecording` when all are missing.
    """
    exam = store.exams.exam(exam_id)
    order, counting = ordered_study(store, exam_id), counting_measurements(store, exam_id)
    found = writer.writable(counting, exam, order, told_of_study(store, exam, order, counting))
    if not found.subjects:
        raise nothing_is_left(exam_id)
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for subject in found.subjects:
            number = subject.measurement["seq"]
            archive.writestr(f"image-{number}.dcm", as_file(writer.image(subject)))
            archive.writestr(f"report-{number}.dcm", as_file(writer.report(subject)))
        if found.missing:
            archive.writestr("missing.csv", _csv(found.missing))
    return content.getvalue()


def _csv(missing: dict[str, str]) -> str:
    table = io.StringIO()
    csv.writer(table).writerows([("measurement_id", "why"), *missing.items()])
    return table.getvalue()
