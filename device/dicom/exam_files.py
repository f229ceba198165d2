"""All of an exam that counts as DICOM files in one .zip, for a PC that fetches them itself."""

from __future__ import annotations

import io
import zipfile

from device.dicom.objects import DicomWriter, as_file
from device.dicom.outgoing import counting_measurements, ordered_study, study_time
from device.records.store import Store


def exam_zip(store: Store, writer: DicomWriter, exam_id: str) -> bytes:
    """Return a .zip with the image and the report of every measurement of an exam that is not void.

    Raises `UnknownResource` for the exam, `InvalidRequest` when it has no measurement or cannot be written.
    """
    exam = store.exams.exam(exam_id)
    order, counting = ordered_study(store, exam_id), counting_measurements(store, exam_id)
    study_at, content = study_time(store, exam, counting), io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for measurement in counting:
            subject = writer.subject(measurement["id"], exam, order, study_at)
            archive.writestr(f"image-{measurement['seq']}.dcm", as_file(writer.image(subject)))
            archive.writestr(f"report-{measurement['seq']}.dcm", as_file(writer.report(subject)))
    return content.getvalue()
