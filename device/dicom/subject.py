"""What is written of one measurement: whose it is, of which study, and how it was taken; and its identifiers.

Every identifier is computed from what it names, so that an object that is written twice is the same object. It is
another one as soon as it is said to be of another patient, order or side: an archive never takes a second content
under one identifier. Standard library only.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any, Literal, get_args

from device.errors import InvalidRequest
from device.files.recording_file import RecordingHead
from device.records.exams import LONGEST_EXAM, ExamContent
from device.records.outbox import is_as_ordered

ObjectKind = Literal["image", "report", "rejection"]
WRITTEN: tuple[ObjectKind, ...] = get_args(ObjectKind)[:2]
"""What is written of each measurement, in the order in which it is sent: a report refers to its image."""
NAMESPACE = uuid.UUID("5f0d5a53-6c1c-4c5f-9a8e-5b6a3e2d7c41")
"""Makes identifiers of this program differ from all others' that are computed of the same names. Never changed."""
PATIENT_LENGTH, ACCESSION_LENGTH, STUDY_ID_LENGTH = 64, 16, 16
"""Characters of VR LO, SH and SH, PS3.5 section 6.2."""
CORRECT = "Correct the exam with its reason, then send it again."


def uid_of(*names: object) -> str:
    """Return the identifier that stands for these names: a UUID below 2.25, which needs no registration (PS3.5 B.2)."""
    return f"2.25.{uuid.uuid5(NAMESPACE, json.dumps(names, sort_keys=True)).int}"


IMPLEMENTATION_UID = uid_of("implementation")
IMPLEMENTATION_NAME = "TSIS"


@dataclass(frozen=True)
class OrderedStudy:
    """What the worklist says of an exam: its study, the patient it is ordered for, and who that is.

    `patient`: `name`, `birth_date`, `sex` and `issuer` as DICOM writes them; empty once they were erased.
    """

    study_uid: str
    patient_ref: str
    order_number: str = ""
    procedure_id: str = ""
    step_id: str = ""
    description: str = ""
    patient: dict[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class ToldOfStudy:
    """What all objects of a study say alike beside whose it is: its Study ID, and when it began (RFC 3339)."""

    id: str
    at: str


@dataclass(frozen=True)
class DicomSubject:
    """One measurement of an exam, as it is written: records of both, and what is not in them.

    `rejected_at`: when it was found that its objects are not right, RFC 3339; "" while they are. Other objects say when
    the press was measured, so that they are the same whenever they are written. `generation`: how often objects that
    say the same were taken back before: a correction that was itself corrected is said again under new identifiers.
    `study_at`: when the study began (RFC 3339), the same for all of it: as `begun_at` says, with the exam unless told.
    `study_id`: its Study ID, as `study_id` says, the exam's number unless told.
    """

    measurement: dict[str, Any]
    exam: dict[str, Any]
    head: RecordingHead
    institution: str = ""
    order: OrderedStudy | None = None
    rejected_at: str = ""
    generation: int = 0
    study_at: str = ""
    study_id: str = ""

    def __post_init__(self) -> None:
        if not self.study_at:
            object.__setattr__(self, "study_at", self.exam["made_at"])
        if not self.study_id:
            object.__setattr__(self, "study_id", str(self.exam["seq"]))

    @property
    def is_of_patient(self) -> bool:
        """Whether it is of a patient's tissue, and not of a phantom or of a simulated press."""
        return self.exam["kind"] == "patient" and not self.head.simulated

    @property
    def patient_id(self) -> str:
        """The patient's reference; of a phantom what tells it from all patients, and from those of every other probe.

        By the exam, which a restore brings to another probe: its number there is that of other exams, too.
        """
        return self.exam["patient_ref"] or f"PHANTOM-{self.exam['id']}"

    @property
    def demographics(self) -> dict[str, str]:
        """Who the patient is, if the worklist has said so of this very one."""
        return self.request.patient if self.request else {}

    @property
    def request(self) -> OrderedStudy | None:
        """The order that the exam is done for, also in a study of its own; None when it was corrected to another."""
        return self.order if is_ordered(self.exam, self.order) else None

    @property
    def is_apart(self) -> bool:
        """Whether it is done for an order and yet in a study of its own, as another patient's is in the ordered one."""
        return self.request is not None and self.study_uid != self.request.study_uid

    @property
    def study_uid(self) -> str:
        """The study: that of the order, else the exam's own."""
        return study_uid(self.exam, self.order)

    def uid(self, kind: ObjectKind) -> str:
        """Return the identifier of one of its objects."""
        return object_uid(kind, self.measurement["id"], self.exam, self.order, self.generation)

    def series_uid(self, kind: ObjectKind) -> str:
        """Return the series that an object belongs to: what is said of a whole series is the same in all of it."""
        return uid_of("series", kind, self.study_uid, self.exam["side"], self.exam["operator"], self.head.software)


def begun_at(exam: dict[str, Any], taken_at: Iterable[str]) -> str:
    """Return when a study began whose presses were taken at these times (RFC 3339).

    That is with its exam, unless a press lies long after it: a board without a clock battery may begin an exam in 1970,
    and the first press since its time server has answered then says when it was.
    """
    made_at = datetime.fromisoformat(exam["made_at"])
    late = [one for one in taken_at if datetime.fromisoformat(one) - made_at > LONGEST_EXAM]
    return min(late, default=str(exam["made_at"]))


def is_ordered(exam: dict[str, Any], order: OrderedStudy | None) -> bool:
    """Return whether an exam is still of the patient and order that the worklist had named."""
    if order is None:
        return False
    return is_as_ordered(exam, order.patient_ref, order.order_number)


def study_uid(exam: dict[str, Any], order: OrderedStudy | None) -> str:
    """Return the study of an exam: a patient's own, so that a correction never puts two into one study."""
    if order and is_ordered(exam, order) and not exam.get("own_study"):
        return order.study_uid
    return uid_of("study", exam["id"], exam["patient_ref"], exam["order_number"])


def study_id(exam: dict[str, Any], order: OrderedStudy | None) -> str:
    """Return the Study ID of a study that begins with an exam: the order's Requested Procedure ID, else its number.

    As archives set it when they link a study to its order (dcm4chee-arc-light 1844 and 4016, after IHE RAD); DICOM
    leaves it to the modality (PS3.17 J.2.2). One that a Study ID cannot hold is not cut, for it would be another's.
    """
    said = order.procedure_id if order and study_uid(exam, order) == order.study_uid else ""
    return said if 0 < len(said) <= STUDY_ID_LENGTH and "\\" not in said else str(exam["seq"])


def object_uid(
    kind: ObjectKind, measurement_id: str, exam: dict[str, Any], order: OrderedStudy | None, generation: int = 0
) -> str:
    """Return the identifier of an object: one for a measurement, all that its exam says, and each time of saying so."""
    said = {name: exam[name] for name in ExamContent.model_fields}
    again = (generation,) if generation else ()
    return uid_of(kind, measurement_id, study_uid(exam, order), said, *again)


def require_writable(exam: dict[str, Any]) -> None:
    """Raise `InvalidRequest` when an identifier of an exam cannot be written without being changed."""
    for name, longest in (("patient_ref", PATIENT_LENGTH), ("order_number", ACCESSION_LENGTH)):
        said = exam[name] or ""
        if "\\" in said:
            raise InvalidRequest(f"{name} of the exam has a backslash, which DICOM cannot write.", CORRECT)
        if len(said) > longest:
            cause = f"{name} of the exam has {len(said)} characters, but DICOM takes at most {longest}."
            raise InvalidRequest(cause, CORRECT)
