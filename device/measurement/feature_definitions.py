"""What the networks of the modes read: each named number of a press, its unit and its meaning.

Contrast is that against the inclusion-free press at the force of the frame, the flat field, and has no unit.
Source: docs/measurement.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from device.measurement.quantities import unit_of


@dataclass(frozen=True)
class Definition:
    """Unit ("1" for a ratio) and one sentence."""

    unit: str
    sentence: str


INCLUSION_FIELD_FEATURES: Mapping[str, Definition] = {
    "max_deformation_mm": Definition("mm", "O1: largest inclusion field in the central window, r < 0.9 of the face."),
    "central_deformation_mm3": Definition("mm3", "O2: integral of the inclusion field over the central window."),
    "deformation_area_mm2": Definition("mm2", "O3: area in the window where the inclusion field exceeds half of O1."),
}
"""Of the face's displacement, which the network of mode paper reads; a probe regresses them from `features`."""

IMAGE_FEATURES: Mapping[str, Definition] = {
    "centroid_intensity": Definition("1", "O1 on the image: smoothed contrast at the centroid of the bright spot."),
    "total_intensity": Definition("mm2", "O2 on the image: integral of the contrast over the central window."),
    "bright_area_mm2": Definition("mm2", "O3 on the image: area where the contrast exceeds half of its peak."),
}
"""What mode paper reads of the image, and brings to `INCLUSION_FIELD_FEATURES` by the certificate's lines."""

RADIAL_PROFILE_FEATURES: Mapping[str, Definition] = {
    "contrast": Definition("1", "Mean contrast on a ring of the face: at four forces, on rings 0.9 mm apart."),
    "growth": Definition("1", "Logarithm of the inclusion-free light at a force over that at the largest, on a ring."),
    "offset": Definition("1", "First harmonic of the contrast on a ring, towards the bright side; mean over the ramp."),
}
"""What the names of a press profile's row begin with (`press_profile`)."""

QUICK_FEATURES: Mapping[str, Definition] = {
    "contrast": Definition("1", "Mean contrast on a ring of the face, at the force of the hold."),
    "force_n": Definition("N", "Mean force of the hold."),
}
"""What the names of a held press's row begin with (`quick_press`)."""


EVERY_GROUP: tuple[Mapping[str, Definition], ...] = (
    INCLUSION_FIELD_FEATURES, IMAGE_FEATURES, RADIAL_PROFILE_FEATURES, QUICK_FEATURES,
)  # fmt: skip
ENDS_OF = ("critical_", "trained_low_", "trained_high_")
"""What stands before the name of a feature whose critical value or trained range it is."""


def definition_of(name: str, group: Mapping[str, Definition]) -> Definition:
    """Return the definition of a name of a group, or of one that goes on with a force or a radius; else `KeyError`."""
    for stem, definition in group.items():
        if name == stem or name.startswith(f"{stem}_"):
            return definition
    raise KeyError(name)


def units_of(names: Iterable[str], group: Mapping[str, Definition]) -> dict[str, str]:
    """Return the unit of each name, in order: the features of a model; raises `KeyError` as `definition_of`."""
    return {name: definition_of(name, group).unit for name in names}


def unit_of_feature(name: str) -> str:
    """Return the unit of any feature of a measurement: the defined one, else that which its name ends with.

    A defined name may end with the place where it was read: `contrast_0.9_mm` is no length.
    """
    for start in ENDS_OF:
        name = name.removeprefix(start)
    for group in EVERY_GROUP:
        try:
            return definition_of(name, group).unit
        except KeyError:
            continue
    return unit_of(name)
