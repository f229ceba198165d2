"""The named numbers of a press and what each means, with its unit: one table for device, toolkit and docs.

All of them are of the contrast against the inclusion-free press at the force of the frame, the flat field; so a number
of contrast has no unit, and one of an integral has that of the area. Source: docs/features.md, generated from here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass


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
"""Of the face's displacement, which the network of mode paper reads; a probe regresses them from `PAPER_FEATURES`."""

PAPER_FEATURES: Mapping[str, Definition] = {
    "centroid_intensity": Definition("1", "Contrast, blurred by 0.5 mm, at the centroid of the bright area."),
    "total_intensity": Definition("mm2", "Integral of the contrast over the window of 9.9 mm."),
    "bright_area_mm2": Definition("mm2", "Area in the window whose blurred contrast is above half of its largest."),
}
"""The image counterparts of the paper's O1, O2 and O3, of one frame (`features`)."""

PROFILE_FEATURES: Mapping[str, Definition] = {
    "contrast": Definition("1", "Mean contrast on a ring of the face: at four forces, on rings 0.9 mm apart."),
    "growth": Definition("1", "Logarithm of the inclusion-free light at a force over that at the largest, on a ring."),
    "offset": Definition("1", "First harmonic of the contrast on a ring, towards the bright side; mean over the ramp."),
}
"""What the names of a press profile's row begin with (`press_profile`)."""

HELD_FEATURES: Mapping[str, Definition] = {
    "contrast": Definition("1", "Mean contrast on a ring of the face, at the force of the hold."),
    "force_n": Definition("N", "Mean force of the hold."),
}
"""What the names of a held press's row begin with (`held_profile`)."""

RAMP_FEATURES: Mapping[str, Definition] = {
    "peak_contrast": Definition("1", "Largest contrast of the ring profile, a cubic spline between the rings."),
    "full_width_half_maximum_mm": Definition("mm", "Twice the radius at which the profile falls to half of its peak."),
    "total_contrast_mm2": Definition("mm2", "Integral of the contrast over the window, which fades from 9 to 9.9 mm."),
    "mean_radius_mm": Definition(
        "mm", "First radial moment: mean distance from the axis, weight the positive contrast."
    ),
    "rms_radius_mm": Definition("mm", "Second radial moment: root mean square distance from the axis, same weight."),
    "gaussian_peak": Definition(
        "1", "Height A of the best A exp(-r^2 / 2 sigma^2) + constant, rings weighted by area."
    ),
    "gaussian_sigma_mm": Definition("mm", "Standard deviation sigma of that Gaussian."),
    "gaussian_residual_ratio": Definition("1", "Root mean square that this Gaussian leaves of the profile, over A."),
    "centroid_offset_mm": Definition(
        "mm", "Shift s off the axis, along its direction over the ramp: the first harmonic is -s dC/dr (least squares)."
    ),
    "ellipticity": Definition(
        "1", "(a - b) / (a + b) of the axes, along theirs: the second harmonic is -e r dC/dr (least squares)."
    ),
}
"""Of the press profile at each of its forces (`shape_features`)."""

PRESS_FEATURES: Mapping[str, Definition] = {
    "mean_centroid_offset_mm": Definition("mm", "The same shift s of the profile's mean over the ramp."),
    "mean_ellipticity": Definition("1", "The same ellipticity of the profile's mean over the ramp."),
    "peak_change_per_n": Definition("1/N", "Slope of the peak contrast over the force, over its mean on the ramp."),
    "total_change_per_n": Definition("1/N", "Slope of the total contrast over the force, over its mean on the ramp."),
    "width_change_mm_per_n": Definition("mm/N", "Slope of the full width at half maximum over the force."),
}
"""Of the press as a whole (`shape_features`)."""


def definition_of(name: str, group: Mapping[str, Definition]) -> Definition:
    """Return the definition of a name of a group, or of one that goes on with a force or a radius; else `KeyError`."""
    for stem, definition in group.items():
        if name == stem or name.startswith(f"{stem}_"):
            return definition
    raise KeyError(name)
