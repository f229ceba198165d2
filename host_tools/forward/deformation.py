"""A profile over the face to the paper's three numbers: largest, summed and how wide (O1, O2, O3).

Used on the lump field (press minus the same press without the inclusion) and, for the paper's literal protocol, on the
raw field, which peaks at the rim with or without a lump. Source: Lee & Won 2013, section III; docs/measurement.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Profile = NDArray[np.float64]

HALF_MAXIMUM = 0.5
"""Threshold of O3 as a ratio of O1: unlike a fixed one it does not move when the light or the skin does."""


@dataclass(frozen=True)
class Deformation:
    """O1-O3 of one field. `total` is over the whole face; `central` over the central window only.

    At equal force the whole-face integral of the lump field all but vanishes (force balance: what the centre gains the
    rim loses) and the camera does not see the rim, so the inversion uses the central one.
    """

    max_deformation_mm: float
    total_deformation_mm3: float
    central_deformation_mm3: float
    deformation_area_mm2: float


def deformation(
    r_mm: Profile,
    field_mm: Profile,
    total_mm3: float,
    *,
    central_radius_mm: float,
    threshold_ratio: float = HALF_MAXIMUM,
) -> Deformation:
    """Return O1-O3 of a profile sampled at ascending radii from 0; `total_mm3` is its integral over the whole face."""
    inside = r_mm <= central_radius_mm * (1 + 1e-12)
    r, field = r_mm[inside], field_mm[inside]
    peak = float(field.max())
    return Deformation(
        max_deformation_mm=peak,
        total_deformation_mm3=total_mm3,
        central_deformation_mm3=float(np.trapezoid(2 * np.pi * r * field, r)),
        deformation_area_mm2=area_above(r, field, threshold_ratio * peak) if peak > 0 else 0.0,
    )


def area_above(r_mm: Profile, field_mm: Profile, threshold_mm: float) -> float:
    """Return the projected area (mm2) where a profile exceeds the threshold, linear between samples."""
    left, right = field_mm[:-1] - threshold_mm, field_mm[1:] - threshold_mm
    crossing = (left > 0) != (right > 0)
    fraction = np.divide(left, left - right, out=np.zeros_like(left), where=crossing)
    r_cross = r_mm[:-1] + fraction * np.diff(r_mm)
    start = np.where(left > 0, r_mm[:-1], r_cross)
    stop = np.where(right > 0, r_mm[1:], r_cross)
    inside = (left > 0) | (right > 0)
    return float(np.pi * np.sum((stop**2 - start**2)[inside]))
