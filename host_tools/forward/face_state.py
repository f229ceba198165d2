"""What the sensing face does at one load: its deformation and pressure along rays from the middle, and the force.

Rays make one definition serve every symmetry: an axisymmetric face is one ray, any other face as many as are needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from device.measurement.arrays import Array
from host_tools.scenes.scene import Waveguide

RADII = 221
"""Samples of a ray from the middle to the rim; 0.05 mm apart on the default face."""


MN_PER_N = 1e3
"""kPa times mm2 is mN, and kPa times mm3 is uJ."""


@dataclass(frozen=True)
class Rays:
    """Where a face is sampled: `angle_rad` [A], evenly over the full circle, and `r_mm` [A, R] from 0 to the rim."""

    angle_rad: Array
    r_mm: Array

    @classmethod
    def over(cls, waveguide: Waveguide, angles: int = 1) -> Rays:
        """Return rays over a face; a multiple of eight angles meets the corners of a square one."""
        angle = 2 * np.pi * np.arange(angles) / angles
        reach = np.full(angles, waveguide.radius_mm)
        if waveguide.face == "square":
            reach = reach / np.maximum(np.abs(np.cos(angle)), np.abs(np.sin(angle)))
        return cls(angle, np.linspace(0.0, reach, RADII, axis=1))

    @property
    def xy_mm(self) -> tuple[Array, Array]:
        """Coordinates of the samples, two arrays [A, R]."""
        return self.r_mm * np.cos(self.angle_rad)[:, None], self.r_mm * np.sin(self.angle_rad)[:, None]


@dataclass(frozen=True)
class FaceState:
    """The face at one load; profiles are [A, R] at the samples of the `Rays`.

    `w_mm` is the displacement of the face relative to the probe's own undeformed shape, `p_kpa` the axial force on the
    face per undeformed area (positive in compression), `total_mm3` the integral of w over the face, `force_n` the
    reaction of the back and `contact_force_n` the integral of the pressure, which must equal it.
    `outward_mm` is how far a point of the face has moved away from the axis, where the model says it: finite strain
    does, and in small strain the deformed area is the undeformed one.
    """

    indentation_mm: float
    w_mm: Array
    p_kpa: Array
    total_mm3: float
    force_n: float
    contact_force_n: float
    outward_mm: Array | None = None

    def deformed_p_kpa(self, rays: Rays) -> Array:
        """Return the force per *deformed* area [A, R] (kPa), the pressure that acts on the skin where it lies now.

        A frictionless face is pushed along its normal, whose axial part acts on the area seen along the axis: a ring of
        r dr has become (r + m) (dr + dm), with m outwards.
        """
        if self.outward_mm is None:
            return self.p_kpa
        r_mm = rays.r_mm
        hoop = np.divide(self.outward_mm, r_mm, out=np.gradient(self.outward_mm, r_mm[0], axis=-1), where=r_mm > 0)
        stretch = np.gradient(self.outward_mm, r_mm[0], axis=-1)
        return np.asarray(self.p_kpa / ((1 + stretch) * (1 + hoop)))

    def scaled(self, factor: float) -> FaceState:
        """Return the state of a linear body at another load."""
        return FaceState(
            self.indentation_mm * factor,
            self.w_mm * factor,
            self.p_kpa * factor,
            self.total_mm3 * factor,
            self.force_n * factor,
            self.contact_force_n * factor,
            None if self.outward_mm is None else self.outward_mm * factor,
        )
