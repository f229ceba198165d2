"""A note that an object at the archive is not to be used: Key Object Selection, TID 2010, as IHE RAD IOCM has it."""

from __future__ import annotations

from typing import Any

from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import UID, ComprehensiveSRStorage, KeyObjectSelectionDocumentStorage, SecondaryCaptureImageStorage

from device.dicom import codes
from device.dicom.content_items import CONTAINS, container, referring, text
from device.dicom.shared_modules import begun, reference
from device.dicom.subject import DicomSubject, ObjectKind

SOP_CLASSES: dict[ObjectKind, UID] = {
    "image": SecondaryCaptureImageStorage,
    "report": ComprehensiveSRStorage,
    "rejection": KeyObjectSelectionDocumentStorage,
}


def rejection_of(subject: DicomSubject, uid: str, rejected: dict[str, Any], why: str) -> Dataset:
    """Return the note with an identifier, and why in words.

    The rejected object is told by its `kind`, `uid`, `series_uid` and `study_uid`. The note is of the same patient: by
    number and issuer always, for an archive knows him by both (PS3.3 C.7.1.1).
    Name, date of birth and sex are as in the object while the probe has them. It does not keep them for a note that may
    never come; then they are empty, which contradicts nothing that the archive has (type 2, PS3.5 section 7.4.3).
    """
    kind: ObjectKind = rejected["kind"]
    data = begun(subject, "rejection", KeyObjectSelectionDocumentStorage, "KO", subject.rejected_at)
    data.SOPInstanceUID = uid
    data.ReferencedPerformedProcedureStepSequence = Sequence()
    series, study = Dataset(), Dataset()
    series.SeriesInstanceUID = rejected["series_uid"]
    series.ReferencedSOPSequence = Sequence([reference(SOP_CLASSES[kind], rejected["uid"])])
    study.StudyInstanceUID, study.ReferencedSeriesSequence = rejected["study_uid"], Sequence([series])
    data.CurrentRequestedProcedureEvidenceSequence = Sequence([study])
    data.update(
        container(
            codes.REJECTED,
            text(CONTAINS, codes.DESCRIPTION, why),
            referring("IMAGE" if kind == "image" else "COMPOSITE", SOP_CLASSES[kind], rejected["uid"]),
            relation="",
            template="2010",
        )
    )
    return data
