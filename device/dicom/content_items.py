"""Content items of a structured report, one function a value type. Source: DICOM PS3.3 C.17.3."""

from __future__ import annotations

from pydicom.dataset import Dataset
from pydicom.sequence import Sequence

from device.dicom.codes import CodedTerm
from device.dicom.shared_modules import coded, reference

CONTAINS, CONTEXT, MODIFIER, PROPERTY = "CONTAINS", "HAS OBS CONTEXT", "HAS CONCEPT MOD", "HAS PROPERTIES"


def container(concept: CodedTerm, *children: Dataset, relation: str = CONTAINS, template: str = "") -> Dataset:
    """Return a container of items; the root of a report has no relation (an empty one)."""
    item = _item("CONTAINER", concept, relation, *children)
    item.ContinuityOfContent = "SEPARATE"
    if template:
        identified = Dataset()
        identified.MappingResource, identified.TemplateIdentifier = "DCMR", template
        item.ContentTemplateSequence = Sequence([identified])
    return item


def code(relation: str, concept: CodedTerm, value: CodedTerm, *children: Dataset) -> Dataset:
    """Return an item whose value is a code."""
    item = _item("CODE", concept, relation, *children)
    item.ConceptCodeSequence = Sequence([coded(value)])
    return item


def text(relation: str, concept: CodedTerm, value: str) -> Dataset:
    """Return an item whose value is text."""
    item = _item("TEXT", concept, relation)
    item.TextValue = value
    return item


def name(relation: str, concept: CodedTerm, value: str) -> Dataset:
    """Return an item whose value is a person's name."""
    item = _item("PNAME", concept, relation)
    item.PersonName = value
    return item


def identifier(relation: str, concept: CodedTerm, value: str) -> Dataset:
    """Return an item whose value is a UID."""
    item = _item("UIDREF", concept, relation)
    item.UID = value
    return item


def referring(kind: str, sop_class: str, sop_uid: str) -> Dataset:
    """Return an item that refers to an object, of value type IMAGE or COMPOSITE."""
    item = Dataset()
    item.RelationshipType, item.ValueType = CONTAINS, kind
    item.ReferencedSOPSequence = Sequence([reference(sop_class, sop_uid)])
    return item


def number(relation: str, concept: CodedTerm, value: str, unit: CodedTerm, *children: Dataset) -> Dataset:
    """Return an item whose value is a number, with the digits that it is given in, and its unit."""
    item = _item("NUM", concept, relation, *children)
    measured = Dataset()
    measured.NumericValue = value
    measured.MeasurementUnitsCodeSequence = Sequence([coded(unit)])
    item.MeasuredValueSequence = Sequence([measured])
    return item


def no_number(relation: str, concept: CodedTerm, why: CodedTerm, *children: Dataset) -> Dataset:
    """Return an item of a number that is not known, and why."""
    item = _item("NUM", concept, relation, *children)
    item.MeasuredValueSequence = Sequence()
    item.NumericValueQualifierCodeSequence = Sequence([coded(why)])
    return item


def _item(kind: str, concept: CodedTerm, relation: str, *children: Dataset) -> Dataset:
    item = Dataset()
    if relation:
        item.RelationshipType = relation
    item.ValueType = kind
    item.ConceptNameCodeSequence = Sequence([coded(concept)])
    if children:
        item.ContentSequence = Sequence(children)
    return item
