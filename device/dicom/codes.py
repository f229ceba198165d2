"""The coded terms of image and report: public ones, and our own where there is none. docs/dicom.md lists the latter.

Sources: DICOM PS3.16 (annexes B, C, D), as in the dictionaries of pydicom 3; units by UCUM.
"""

from __future__ import annotations

from typing import NamedTuple

OWN_SCHEME = "99TSIS"


class CodedTerm(NamedTuple):
    """A code in its scheme, and what it means in words."""

    value: str
    scheme: str
    meaning: str


def _dcm(value: str, meaning: str) -> CodedTerm:
    return CodedTerm(value, "DCM", meaning)


def _sct(value: str, meaning: str) -> CodedTerm:
    return CodedTerm(value, "SCT", meaning)


def _own(value: str, meaning: str) -> CodedTerm:
    return CodedTerm(value, OWN_SCHEME, meaning)


REPORT = _dcm("126000", "Imaging Measurement Report")
LANGUAGE = _dcm("121049", "Language of Content Item and Descendants")
ENGLISH = CodedTerm("en", "RFC5646", "English")
OBSERVER_TYPE = _dcm("121005", "Observer Type")
PERSON, DEVICE = _dcm("121006", "Person"), _dcm("121007", "Device")
PERSON_NAME = _dcm("121008", "Person Observer Name")
DEVICE_UID = _dcm("121012", "Device Observer UID")
DEVICE_NAME = _dcm("121013", "Device Observer Name")
DEVICE_MANUFACTURER = _dcm("121014", "Device Observer Manufacturer")
DEVICE_MODEL = _dcm("121015", "Device Observer Model Name")
DEVICE_SERIAL = _dcm("121016", "Device Observer Serial Number")
PROCEDURE = _dcm("121058", "Procedure reported")
IMAGE_LIBRARY, IMAGE_GROUP = _dcm("111028", "Image Library"), _dcm("126200", "Image Library Group")
MEASUREMENTS, GROUP = _dcm("126010", "Imaging Measurements"), _dcm("125007", "Measurement Group")
TRACKING_NAME = _dcm("112039", "Tracking Identifier")
TRACKING_UID = _dcm("112040", "Tracking Unique Identifier")
FINDING, SITE = _dcm("121071", "Finding"), _sct("363698007", "Finding Site")
LESION, BREAST, PHANTOM = _sct("52988006", "Lesion"), _sct("76752008", "Breast"), _sct("706342009", "Phantom")
LATERALITY, TOPOGRAPHY = _sct("272741003", "Laterality"), _sct("106233006", "Topographical modifier")
SIDES = {"left": _sct("7771000", "Left"), "right": _sct("24028007", "Right")}
CLOCK = dict(
    zip(
        range(1, 13),
        [
            _sct(f"1297{number}", f"{hour} o'clock position")
            for hour, number in enumerate(
                ("72004", "73009", "74003", "75002", "76001", "77005", "78000", "79008", "80006", "81005", "82003",
                 "83008"), start=1)
        ],
        strict=True,
    )
)  # fmt: skip
"""Clock positions, CID 6018."""
NIPPLE_DISTANCE = _dcm("121242", "Distance from nipple")
DIAMETER, ELASTICITY = _sct("81827009", "Diameter"), _dcm("110830", "Elasticity")
METHOD, DERIVATION, ESTIMATED = (
    _sct("370129005", "Measurement Method"),
    _dcm("121401", "Derivation"),
    _sct("414135002", "Estimated"),
)
ABOVE = _sct("371886008", "+, range of upper measurement uncertainty")
BELOW = _sct("371885007", "-, range of lower measurement uncertainty")
INDETERMINATE, UNKNOWN = _dcm("114011", "Value indeterminate"), _dcm("114010", "Value unknown")
ALGORITHM = _dcm("111001", "Algorithm Name")
ALGORITHM_VERSION = _dcm("111003", "Algorithm Version")
ALGORITHM_PARAMETERS = _dcm("111002", "Algorithm Parameters")
COMMENT = _dcm("121106", "Comment")
REJECTED, DESCRIPTION = _dcm("113037", "Rejected for Patient Safety Reasons"), _dcm("113012", "Key Object Description")

TACTILE_IMAGING = _own("TACTILE-IMAGING", "Tactile imaging")
TACTILE_INVERSION = _own("INVERSION", "Fit of a model of pressed tissue to tactile images")
YOUNGS_MODULUS = _own("YOUNGS-MODULUS", "Young's modulus of the lesion, not its shear modulus")
TOP_DEPTH = _own("TOP-DEPTH", "Depth of the lesion's top below the undeformed skin")
INTERVAL_LEVEL = _own("INTERVAL-LEVEL", "Probability that the interval holds the true value")
OPEN_END = _own("OPEN-END", "Interval ends where the trained range does")
LOW_END, HIGH_END = _own("LOW-END", "Lower end"), _own("HIGH-END", "Upper end")
PHANTOM_INCLUSION = _own("IN-PHANTOM", "Inclusion in a phantom")
OWN_TERMS = (
    TACTILE_IMAGING, TACTILE_INVERSION, YOUNGS_MODULUS, TOP_DEPTH, INTERVAL_LEVEL, OPEN_END, LOW_END, HIGH_END,
    PHANTOM_INCLUSION,
)  # fmt: skip

MILLIMETRE = CodedTerm("mm", "UCUM", "millimeter")
KILOPASCAL = CodedTerm("kPa", "UCUM", "kilopascal")
PERCENT = CodedTerm("%", "UCUM", "percent")
