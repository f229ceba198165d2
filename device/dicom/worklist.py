"""The modality worklist: which examinations are ordered, so that nobody has to type whose exam it is (PS3.4 annex K).

What is asked for is matched again here, to the letter: a worklist reads a star or a question mark as a wildcard.
Its statuses are read here, too: a worklist may go on showing what was cancelled, and need not match by a status.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from datetime import date
from typing import Any

from pydicom.dataset import Dataset
from pydicom.multival import MultiValue
from pydicom.sequence import Sequence

from device.config import DicomSection
from device.dicom.association import WORKLIST_FIND, RemoteProgram, associated, status_of, unreachable
from device.dicom.subject import OrderedStudy, uid_of
from device.errors import InvalidRequest

PENDING = (0xFF00, 0xFF01)
MOST_STEPS = 200
ASKED_OF_PATIENT = ("PatientName", "IssuerOfPatientID", "PatientBirthDate", "PatientSex", "StudyInstanceUID",
                    "RequestedProcedureID", "RequestedProcedureDescription")  # fmt: skip
ASKED_OF_STEP = ("ScheduledProcedureStepStartTime", "ScheduledProcedureStepID", "ScheduledProcedureStepDescription",
                 "Modality", "ScheduledProcedureStepStatus")  # fmt: skip
NOT_TO_BE_DONE = ("CANCELED", "CANCELLED", "DISCONTINUED", "COMPLETED")
"""Statuses of steps that are left out. DICOM's own defined terms (PS3.3 C.4.10) are SCHEDULED, ARRIVED, READY, STARTED
and DEPARTED, and none of them says that an order is none any more; these are what worklists in use add, such as
dcm4chee's. A worklist is of what is to be done, so a completed step is none of it: more of it is another order.
"""


@dataclass(frozen=True)
class WorklistQuery:
    """What is asked for: the steps of a day, of a patient or of an order; of what is None any."""

    day: date | None = None
    patient_ref: str | None = None
    order_number: str | None = None

    def is_of(self, order: OrderedStudy) -> bool:
        """Return whether patient and order are, to the letter, those that are asked for."""
        is_patients = self.patient_ref in (None, order.patient_ref)
        return is_patients and self.order_number in (None, order.order_number)

    def ought_to_have(self, order: OrderedStudy, scheduled_at: str) -> bool:
        """Return whether an answer ought to have an order of a time, if the worklist still has it."""
        is_of_day = self.day is None or scheduled_at.startswith(f"{self.day:%Y%m%d}")
        return is_of_day and self.is_of(order)


@dataclass(frozen=True)
class ScheduledStep:
    """An examination that is ordered: `id` stands for it, `scheduled_at` is the hospital's own time, as it says it."""

    id: str
    order: OrderedStudy
    scheduled_at: str

    def as_record(self) -> dict[str, Any]:
        """Return it as JSON object, with the patient's name: for who has to choose."""
        told = asdict(self.order)
        patient = told.pop("patient")
        whose = {f"patient_{name}": value for name, value in patient.items()}
        return {"id": self.id, "scheduled_at": self.scheduled_at, **told, **whose}


def scheduled_steps(remote: RemoteProgram, settings: DicomSection, query: WorklistQuery) -> list[ScheduledStep]:
    """Return what the worklist has for this probe, or for any where the settings say so, by its time.

    Raises `ArchiveUnreachable`, and `InvalidRequest` for more than 200 steps or what cannot be asked for.
    """
    found: list[ScheduledStep] = []
    with associated(remote, settings, [WORKLIST_FIND]) as association:
        for answer, data in association.send_c_find(_asked(settings, query), WORKLIST_FIND):
            status = status_of(answer)
            if status is None:
                raise unreachable(remote, "broke the connection off")
            if status in PENDING and data is not None and (step := _step(data)):
                found.append(step)
            elif status not in (0x0000, *PENDING):
                raise unreachable(remote, f"answers with status {status:#06x}")
            if len(found) > MOST_STEPS:
                association.abort()
                raise InvalidRequest(f"The worklist has more than {MOST_STEPS} steps.", "Ask for a day, or an order.")
    return sorted((step for step in found if query.is_of(step.order)), key=lambda step: step.scheduled_at)


def _asked(settings: DicomSection, query: WorklistQuery) -> Dataset:
    for name, value in (("patient_ref", query.patient_ref), ("order_number", query.order_number)):
        if "\\" in (value or ""):
            raise InvalidRequest(f"{name} has a backslash, which DICOM cannot ask for.", "Correct it.")
    asked, step = Dataset(), Dataset()
    asked.SpecificCharacterSet = "ISO_IR 192"
    for keyword in ASKED_OF_PATIENT:
        setattr(asked, keyword, "")
    for keyword in ASKED_OF_STEP:
        setattr(step, keyword, "")
    asked.PatientID, asked.AccessionNumber = query.patient_ref or "", query.order_number or ""
    step.ScheduledStationAETitle = "" if settings.worklist_of_all else settings.own_title
    step.ScheduledProcedureStepStartDate = query.day.strftime("%Y%m%d") if query.day else ""
    asked.ScheduledProcedureStepSequence = Sequence([step])
    return asked


def _step(data: Dataset) -> ScheduledStep | None:
    """Return a step as the worklist has it; None when it is not to be done, or nobody says whose and of which study."""
    scheduled = (data.get("ScheduledProcedureStepSequence") or [Dataset()])[0]
    study_uid, patient_ref = _text(data, "StudyInstanceUID"), _text(data, "PatientID")
    status = _text(scheduled, "ScheduledProcedureStepStatus").strip().upper()
    if not (study_uid and patient_ref) or status in NOT_TO_BE_DONE:
        return None
    step_id, words = _text(scheduled, "ScheduledProcedureStepID"), _text(data, "RequestedProcedureDescription")
    order = OrderedStudy(
        study_uid=study_uid,
        patient_ref=patient_ref,
        order_number=_text(data, "AccessionNumber"),
        procedure_id=_text(data, "RequestedProcedureID"),
        step_id=step_id,
        description=words or _text(scheduled, "ScheduledProcedureStepDescription"),
        patient={
            "name": _text(data, "PatientName"),
            "birth_date": _text(data, "PatientBirthDate"),
            "sex": _text(data, "PatientSex"),
            "issuer": _text(data, "IssuerOfPatientID"),
        },
    )
    at = f"{_text(scheduled, 'ScheduledProcedureStepStartDate')}{_text(scheduled, 'ScheduledProcedureStepStartTime')}"
    return ScheduledStep(uid_of("step", asdict(order)), order, at)


def _text(data: Dataset, keyword: str) -> str:
    """Return a value as it was sent: one that a backslash makes several is put together again."""
    value = data.get(keyword)
    several = value if isinstance(value, MultiValue) else [value]
    return "\\".join("" if one is None else str(one) for one in several)
