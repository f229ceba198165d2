"""Samples fields of a mesh along the rays of the face, in the part of the face that the mesh models."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np

from device.measurement.arrays import Array
from host_tools.forward.face_state import Rays
from host_tools.forward.symmetry import Expression

FaceSector = Literal["axisymmetric", "quarter", "half", "full"]
COPIES: dict[FaceSector, int] = {"axisymmetric": 1, "quarter": 4, "half": 2, "full": 1}
"""How many times the modelled part makes up the whole; an axisymmetric integral already goes round."""

INSET_RATIO = 1e-6
"""A curved rim is a polynomial: a point on the exact circle may miss it by less than this."""
PROBE_SIDE_MM = 1e-9


class FaceSampler:
    """Evaluates fields at the samples of the rays; rays outside the modelled sector are mirrored into it."""

    def __init__(self, mesh: Any, rays: Rays, sector: FaceSector) -> None:
        self.copies, self.shape = COPIES[sector], rays.r_mm.shape
        x, y = (axis.ravel() * (1 - INSET_RATIO) for axis in rays.xy_mm)
        if sector == "axisymmetric":
            self.points = mesh(rays.r_mm.ravel() * (1 - INSET_RATIO), np.full(x.shape, PROBE_SIDE_MM))
            return
        x = np.abs(x) if sector == "quarter" else x
        y = np.abs(y) if sector != "full" else y
        self.points = mesh(x, y, np.full(x.shape, PROBE_SIDE_MM))

    def __call__(self, field: Expression) -> Array:
        """Return the field's values [A, R]."""
        return np.asarray(field(self.points), dtype=float).reshape(self.shape)
