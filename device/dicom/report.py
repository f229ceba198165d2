"""The numbers of a measurement as a structured report that programs read: Comprehensive SR, TID 1500.

Every number has its unit by UCUM and its 90 % interval, with the digits that the interval supports; one that the press
does not determine is none, and says so.
Source: DICOM PS3.16 TID 1500, 1501, 300, 310, 1001, 4019.
"""

from __future__ import annotations

from decimal import Decimal
from typing import Any

from pydicom.dataset import Dataset
from pydicom.sequence import Sequence
from pydicom.uid import ComprehensiveSRStorage, SecondaryCaptureImageStorage

from device.dicom import codes
from device.dicom.codes import CodedTerm
from device.dicom.content_items import (
    CONTAINS,
    CONTEXT,
    MODIFIER,
    PROPERTY,
    code,
    container,
    identifier,
    name,
    no_number,
    number,
    referring,
    text,
)
from device.dicom.shared_modules import MANUFACTURER, MODEL, begun, person_name, reference
from device.dicom.subject import DicomSubject, uid_of
from device.dicom.wording import NOT_A_DIAGNOSIS, is_determined, remarks, spoken_quantity
from device.measurement.confidence_belt import COVERAGE
from device.measurement.shown_quantity import has_open_end, shown_ends, shown_value

CONCEPTS = {
    "size_mm": (codes.DIAMETER, codes.MILLIMETRE, codes.TACTILE_INVERSION),
    "depth_mm": (codes.TOP_DEPTH, codes.MILLIMETRE, codes.TACTILE_INVERSION),
    "youngs_modulus_kpa": (codes.ELASTICITY, codes.KILOPASCAL, codes.YOUNGS_MODULUS),
}
"""Concept, unit and method of each unknown."""


def report_of(subject: DicomSubject) -> Dataset:
    """Return the numbers of a measurement as an object, which refers to its image."""
    data = begun(subject, "report", ComprehensiveSRStorage, "SR", subject.measurement["taken_at"])
    data.CompletionFlag, data.VerificationFlag, data.PreliminaryFlag = "COMPLETE", "UNVERIFIED", "PRELIMINARY"
    data.PerformedProcedureCodeSequence = data.ReferencedPerformedProcedureStepSequence = Sequence()
    data.CurrentRequestedProcedureEvidenceSequence = Sequence([evidence(subject)])
    if subject.exam["order_number"] or subject.is_apart:
        data.ReferencedRequestSequence = Sequence([_request(subject)])
    data.update(_content(subject))
    return data


def evidence(subject: DicomSubject) -> Dataset:
    """Return the reference to a measurement's image by study and series."""
    series, study = Dataset(), Dataset()
    series.SeriesInstanceUID = subject.series_uid("image")
    series.ReferencedSOPSequence = Sequence([reference(SecondaryCaptureImageStorage, subject.uid("image"))])
    study.StudyInstanceUID, study.ReferencedSeriesSequence = subject.study_uid, Sequence([series])
    return study


def _request(subject: DicomSubject) -> Dataset:
    order, request = subject.request, Dataset()
    request.StudyInstanceUID = order.study_uid if order else subject.study_uid
    request.ReferencedStudySequence = Sequence()
    request.AccessionNumber = subject.exam["order_number"] or ""
    request.PlacerOrderNumberImagingServiceRequest = request.FillerOrderNumberImagingServiceRequest = ""
    request.RequestedProcedureID = order.procedure_id if order else ""
    request.RequestedProcedureDescription = order.description if order else ""
    request.RequestedProcedureCodeSequence = Sequence()
    return request


def _content(subject: DicomSubject) -> Dataset:
    library = container(codes.IMAGE_GROUP, referring("IMAGE", SecondaryCaptureImageStorage, subject.uid("image")))
    return container(
        codes.REPORT,
        code(MODIFIER, codes.LANGUAGE, codes.ENGLISH),
        *_observers(subject),
        code(MODIFIER, codes.PROCEDURE, codes.TACTILE_IMAGING),
        container(codes.IMAGE_LIBRARY, library),
        container(codes.MEASUREMENTS, _group(subject)),
        relation="",
        template="1500",
    )


def _observers(subject: DicomSubject) -> list[Dataset]:
    """Return who and what observed: the operator, and the probe."""
    return [
        code(CONTEXT, codes.OBSERVER_TYPE, codes.PERSON),
        name(CONTEXT, codes.PERSON_NAME, person_name(subject.exam["operator"])),
        code(CONTEXT, codes.OBSERVER_TYPE, codes.DEVICE),
        identifier(CONTEXT, codes.DEVICE_UID, uid_of("probe", subject.head.serial)),
        text(CONTEXT, codes.DEVICE_NAME, subject.head.serial),
        text(CONTEXT, codes.DEVICE_MANUFACTURER, MANUFACTURER),
        text(CONTEXT, codes.DEVICE_MODEL, MODEL),
        text(CONTEXT, codes.DEVICE_SERIAL, subject.head.serial),
    ]


def _group(subject: DicomSubject) -> Dataset:
    measurement = subject.measurement
    return container(
        codes.GROUP,
        text(CONTEXT, codes.TRACKING_NAME, f"Measurement {measurement['seq']} of {subject.head.serial}"),
        identifier(CONTEXT, codes.TRACKING_UID, uid_of("measurement", measurement["id"])),
        *_finding(subject),
        _site(subject.exam),
        *(_measured(subject, unknown) for unknown in CONCEPTS),
        *_distance(subject.exam),
        *(text(CONTAINS, codes.COMMENT, comment) for comment in _comments(subject)),
        template="1501",
    )


def _finding(subject: DicomSubject) -> list[Dataset]:
    """Return what the numbers are of; nothing of a press that has none, which says of no lesion that it is there."""
    estimate = subject.measurement["estimate"]
    if not any(is_determined(estimate[unknown]) for unknown in CONCEPTS):
        return []
    is_phantom = subject.exam["kind"] == "phantom"
    return [code(CONTAINS, codes.FINDING, codes.PHANTOM_INCLUSION if is_phantom else codes.LESION)]


def _site(exam: dict[str, Any]) -> Dataset:
    if exam["kind"] == "phantom":
        return code(MODIFIER, codes.SITE, codes.PHANTOM)
    where = []
    if exam["side"]:
        where.append(code(MODIFIER, codes.LATERALITY, codes.SIDES[exam["side"]]))
    if exam["clock_position"]:
        where.append(code(MODIFIER, codes.TOPOGRAPHY, codes.CLOCK[exam["clock_position"]]))
    return code(MODIFIER, codes.SITE, codes.BREAST, *where)


def _distance(exam: dict[str, Any]) -> list[Dataset]:
    distance_mm = exam["nipple_distance_mm"]
    if distance_mm is None:
        return []
    return [number(CONTAINS, codes.NIPPLE_DISTANCE, f"{distance_mm:.6g}", codes.MILLIMETRE)]


def _measured(subject: DicomSubject, unknown: str) -> Dataset:
    concept, unit, method = CONCEPTS[unknown]
    quantity = subject.measurement["estimate"][unknown]
    about = [code(MODIFIER, codes.METHOD, method), code(MODIFIER, codes.DERIVATION, codes.ESTIMATED)]
    about += _algorithm(subject)
    if not is_determined(quantity):
        why = codes.UNKNOWN if quantity["value"] is None else codes.INDETERMINATE
        return no_number(CONTAINS, concept, why, *about)
    return number(CONTAINS, concept, shown_value(quantity), unit, *about, *_interval(quantity, unit))


def _interval(quantity: dict[str, Any], unit: CodedTerm) -> list[Dataset]:
    """Return how far the ends lie from the value as it is written; an open end lies nowhere, and is said to be open."""
    value, low, high = (Decimal(one) for one in (shown_value(quantity), *shown_ends(quantity["low"], quantity["high"])))
    sides = (
        ("high_is_open", codes.HIGH_END, codes.ABOVE, high - value),
        ("low_is_open", codes.LOW_END, codes.BELOW, value - low),
    )
    ends = [
        code(PROPERTY, codes.OPEN_END, end) if quantity.get(is_open) else number(PROPERTY, side, str(range_), unit)
        for is_open, end, side, range_ in sides
    ]
    return [*ends, number(PROPERTY, codes.INTERVAL_LEVEL, f"{100 * COVERAGE:g}", codes.PERCENT)]


def _algorithm(subject: DicomSubject) -> list[Dataset]:
    estimate = subject.measurement["estimate"]
    parameters = (
        f"mode={estimate['mode']}; model sha256={estimate['model_sha256']}; calibration={estimate['calibration_id']}"
    )
    if card := estimate.get("model_card_sha256"):  # of before, objects stay as they were written
        parameters += f"; card sha256={card}"
    return [
        text(MODIFIER, codes.ALGORITHM, f"TSIS {estimate['model']}"),
        text(MODIFIER, codes.ALGORITHM_VERSION, subject.head.software),
        text(MODIFIER, codes.ALGORITHM_PARAMETERS, parameters),
    ]


def _comments(subject: DicomSubject) -> list[str]:
    """Return open intervals in words, what the numbers alone do not say, and the operator's note."""
    measurement, estimate = subject.measurement, subject.measurement["estimate"]
    told = {name: estimate[name] for name in CONCEPTS if is_determined(estimate[name])}
    opened = [spoken_quantity(name, quantity) for name, quantity in told.items() if has_open_end(quantity)]
    said = [*opened, *remarks(measurement, simulated=subject.head.simulated), subject.exam["note"], NOT_A_DIAGNOSIS]
    return [one for one in said if one]
