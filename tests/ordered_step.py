"""A step of a worklist, as a file in the folder of the real one (orthanc.py)."""

from __future__ import annotations

from pathlib import Path

from orthanc import OWN_TITLE
from pydicom.dataset import Dataset, FileMetaDataset
from pydicom.sequence import Sequence
from pydicom.uid import ExplicitVRLittleEndian

ANA = {
    "PatientID": "A-17", "PatientName": "Müller^Ana", "PatientBirthDate": "19700102", "PatientSex": "F",
    "AccessionNumber": "2026/1", "StudyInstanceUID": "1.2.3.4", "RequestedProcedureID": "RP-1",
    "RequestedProcedureDescription": "Palpable lesion", "IssuerOfPatientID": "HOSP",
}  # fmt: skip


def ordered(
    folder: Path,
    name: str,
    *,
    station: str = OWN_TITLE,
    day: str = "20261123",
    charset: str = "ISO_IR 192",
    status: str = "",
    **said: str,
) -> None:
    """Put a step into the worklist's folder."""
    data, step = Dataset(), Dataset()
    data.file_meta = FileMetaDataset()
    data.file_meta.TransferSyntaxUID = ExplicitVRLittleEndian
    data.file_meta.MediaStorageSOPClassUID, data.file_meta.MediaStorageSOPInstanceUID = (
        "1.2.276.0.7230010.3.1.0.1",
        "1.2.9",
    )
    data.SpecificCharacterSet = charset
    for keyword, value in {**ANA, **said}.items():
        setattr(data, keyword, value)
    step.ScheduledStationAETitle, step.Modality = station, "OT"
    step.ScheduledProcedureStepStartDate, step.ScheduledProcedureStepStartTime = day, "101500"
    step.ScheduledProcedureStepID, step.ScheduledProcedureStepDescription = f"SPS-{name}", "Tactile"
    if status:
        step.ScheduledProcedureStepStatus = status
    data.ScheduledProcedureStepSequence = Sequence([step])
    data.save_as(folder / f"{name}.wl", enforce_file_format=True)
