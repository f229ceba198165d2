"""A field over the face to the paper's three numbers: largest, summed and how wide (O1, O2, O3).

Used on the inclusion field (press minus the same press without the inclusion) and, for the paper's literal protocol, on
the raw field, which peaks at the rim with or without an inclusion. Fields are sampled along rays at even angles; a sum
over the face is the mean over the angles of a ray's. Source: Lee & Won 2013, section III; docs/measurement.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array

HALF_MAXIMUM = 0.5
"""Threshold of O3 as a ratio of O1: unlike a fixed one it does not move when the light or the skin does."""

CENTRAL_RATIO = 0.9
"""The central window over the face: the rim beyond is singular."""


@dataclass(frozen=True)
class Deformation:
    """O1-O3 of one field. `total` is over the whole face; `central` over the central window only.

    At equal force the whole-face integral of the inclusion field all but vanishes (force balance: what the centre gains
    the rim loses) and the camera does not see the rim, so the inversion uses the central one.
    """

    max_deformation_mm: float
    total_deformation_mm3: float
    central_deformation_mm3: float
    deformation_area_mm2: float


def deformation(
    r_mm: Array, field_mm: Array, total_mm3: float, *, threshold_ratio: float = HALF_MAXIMUM
) -> Deformation:
    """Return O1-O3 of a field [..., R] sampled on rays that ascend from 0 to the rim, at even angles if several.

    `total_mm3` is the field's integral over the whole face.
    """
    rays = np.atleast_2d(r_mm)
    window = rays[0] <= CENTRAL_RATIO * rays[0, -1] * (1 + 1e-12)  # the same share of every ray
    r, field = rays[:, window], np.atleast_2d(field_mm)[:, window]
    peak = float(field.max())
    return Deformation(
        max_deformation_mm=peak,
        total_deformation_mm3=total_mm3,
        central_deformation_mm3=float(np.mean(np.trapezoid(2 * np.pi * r * field, r, axis=-1))),
        deformation_area_mm2=area_above(r, field, threshold_ratio * peak) if peak > 0 else 0.0,
    )


def area_above(r_mm: Array, field_mm: Array, threshold_mm: float) -> float:
    """Return the projected area (mm2) where a field [..., R] exceeds the threshold, by a cubic spline along each ray.

    Straight lines between the samples would make the area jitter by 5e-6 as the crossing moves from one to the next.
    """
    rays, fields = np.atleast_2d(r_mm), np.atleast_2d(field_mm)
    return float(np.mean([_area_of_ray(r, field - threshold_mm) for r, field in zip(rays, fields, strict=True)]))


def _area_of_ray(r_mm: Array, excess_mm: Array) -> float:
    """Return the area (mm2) of the rings where the spline through a profile is positive."""
    from scipy.interpolate import InterpolatedUnivariateSpline  # takes longer to load than a scene to solve

    spline = InterpolatedUnivariateSpline(r_mm, excess_mm)  # its roots are ten times faster than CubicSpline's
    edges = np.concatenate([r_mm[:1], spline.roots(), r_mm[-1:]])
    inside = spline((edges[:-1] + edges[1:]) / 2) > 0
    return float(np.pi * np.sum(np.diff(edges**2)[inside]))
