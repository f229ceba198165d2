"""What every object says alike: patient, study, series, equipment, and how its text and times are written.

Source: DICOM PS3.3, modules C.7.1.1, C.7.2.1, C.7.3.1, C.7.5.1, C.12.1.
"""

from __future__ import annotations

from datetime import datetime

from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import UID, ExplicitVRLittleEndian

from device.dicom.codes import BREAST, OWN_SCHEME, PHANTOM, CodedTerm
from device.dicom.subject import IMPLEMENTATION_NAME, IMPLEMENTATION_UID, DicomSubject, ObjectKind

MANUFACTURER, MODEL = "TSIS", "Tactile imaging probe"
SERIES_NUMBER = {"image": 1, "report": 2, "rejection": 3}
IMAGE_LATERALITY = {"left": "L", "right": "R"}
NAME_LENGTH, LINE_LENGTH, SHORT_LENGTH = 64, 64, 16
"""Characters of VR PN, LO and SH, PS3.5 section 6.2."""


def coded(term: CodedTerm) -> Dataset:
    """Return a code as an item of a code sequence."""
    item = Dataset()
    item.CodeValue, item.CodingSchemeDesignator, item.CodeMeaning = term
    return item


def reference(sop_class: str, sop_uid: str) -> Dataset:
    """Return a reference to an object."""
    item = Dataset()
    item.ReferencedSOPClassUID, item.ReferencedSOPInstanceUID = sop_class, sop_uid
    return item


def local_time(subject: DicomSubject, text: str) -> datetime:
    """Return a time of RFC 3339 in this machine's zone as of the exam: many viewers show it as it stands.

    An object names one offset from UTC for all of its times, and every object of a study the same time of the study,
    so what is written after the clocks were put back still has the exam's offset.
    """
    begun_at = datetime.fromisoformat(subject.study_at).astimezone()
    return datetime.fromisoformat(text).astimezone(begun_at.tzinfo)


def set_time(data: Dataset, what: str, moment: datetime) -> None:
    """Set the date and the time of something, as `Study`."""
    setattr(data, f"{what}Date", moment.strftime("%Y%m%d"))
    setattr(data, f"{what}Time", moment.strftime("%H%M%S.%f"))


def person_name(text: str) -> str:
    """Return a name as VR PN, whole as its first component: nobody has said which word is the family name."""
    return f"{line(text.translate(dict.fromkeys(map(ord, '^='), ' ')), NAME_LENGTH - 1)}^"


def line(text: str, longest: int) -> str:
    """Return text as one value of so many characters: a backslash would begin the next value."""
    return " ".join(text.replace("\\", " ").split())[:longest].rstrip()


def begun(subject: DicomSubject, kind: ObjectKind, sop_class: str, modality: str, made_at: str) -> Dataset:
    """Return a new object of a measurement with all modules that objects of any kind share."""
    made = local_time(subject, made_at)
    data = Dataset()
    data.file_meta = FileMetaDataset()
    data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data.file_meta.ImplementationClassUID = UID(IMPLEMENTATION_UID)
    data.file_meta.ImplementationVersionName = IMPLEMENTATION_NAME
    data.SpecificCharacterSet = "ISO_IR 192"
    data.SOPClassUID, data.SOPInstanceUID = sop_class, subject.uid(kind)
    data.TimezoneOffsetFromUTC = made.strftime("%z")[:5]
    set_time(data, "InstanceCreation", made)
    data.CodingSchemeIdentificationSequence = Sequence([_own_scheme()])
    data.InstanceNumber = subject.measurement["seq"]
    set_time(data, "Content", made)
    _set_patient(data, subject)
    _set_study(data, subject)
    _set_series(data, subject, kind, modality)
    _set_equipment(data, subject)
    return data


def _own_scheme() -> Dataset:
    item = Dataset()
    item.CodingSchemeDesignator = OWN_SCHEME
    item.CodingSchemeName = "Terms of the tactile imaging probe TSIS"
    item.CodingSchemeResponsibleOrganization = MANUFACTURER
    return item


def _set_patient(data: Dataset, subject: DicomSubject) -> None:
    said = subject.demographics
    data.PatientName, data.PatientID = said.get("name", ""), subject.patient_id
    data.PatientBirthDate, data.PatientSex = said.get("birth_date", ""), said.get("sex", "")
    if issuer := subject.exam.get("patient_issuer") or said.get("issuer"):  # rows of a release before have no first
        data.IssuerOfPatientID = issuer
    if not subject.is_of_patient:
        data.QualityControlSubject = "YES"


def _set_study(data: Dataset, subject: DicomSubject) -> None:
    data.StudyInstanceUID, data.StudyID = subject.study_uid, subject.study_id
    set_time(data, "Study", local_time(subject, subject.study_at))
    data.AccessionNumber = subject.exam["order_number"] or ""
    data.ReferringPhysicianName = ""
    data.StudyDescription = "Tactile imaging" if subject.is_of_patient else "Tactile imaging, no patient"


def _set_series(data: Dataset, subject: DicomSubject, kind: ObjectKind, modality: str) -> None:
    data.Modality, data.SeriesNumber = modality, SERIES_NUMBER[kind]
    data.SeriesInstanceUID = subject.series_uid(kind)
    data.SeriesDescription = f"Tactile {kind}{', simulated' if subject.head.simulated else ''}"


def set_acquisition(data: Dataset, subject: DicomSubject) -> None:
    """Say of an image who has taken it, and for which scheduled step.

    In a study of its own it also names the study that was ordered, by which an archive can match it (PS3.3 table 10-9).
    """
    data.OperatorsName = person_name(subject.exam["operator"])
    order, request = subject.request, Dataset()
    if order and order.procedure_id:
        request.RequestedProcedureID, request.ScheduledProcedureStepID = order.procedure_id, order.step_id
    if order and subject.is_apart:
        request.StudyInstanceUID, request.AccessionNumber = order.study_uid, order.order_number
    if request:
        data.RequestAttributesSequence = Sequence([request])


def set_body_part(data: Dataset, subject: DicomSubject) -> None:
    """Say of an image which part of the body it shows, and of which side; a phantom has none."""
    is_phantom = subject.exam["kind"] == "phantom"
    data.AnatomicRegionSequence = Sequence([coded(PHANTOM if is_phantom else BREAST)])
    if not is_phantom:
        data.BodyPartExamined = "BREAST"
    if laterality := "U" if is_phantom else IMAGE_LATERALITY.get(subject.exam["side"]):
        data.ImageLaterality = laterality
    else:
        data.Laterality = ""


def _set_equipment(data: Dataset, subject: DicomSubject) -> None:
    data.Manufacturer, data.ManufacturerModelName = MANUFACTURER, MODEL
    data.InstitutionName = subject.institution
    data.DeviceSerialNumber = line(subject.head.serial, LINE_LENGTH)
    data.StationName = line(subject.head.serial, SHORT_LENGTH)
    data.SoftwareVersions = line(subject.head.software, LINE_LENGTH)
