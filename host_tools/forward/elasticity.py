"""Isotropic linear elasticity in axisymmetry: displacements (u_r, u_z) to strain, stress and work.

Coordinates: x is r, y is z. The hoop strain u_r/r counts, and every integral carries 2 pi r.
Source: Hughes, The Finite Element Method (1987), section 2.12.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ngsolve import dx, grad, pi, x

Expression = Any
"""An NGSolve coefficient function or a number."""


RING = 2 * pi * x
"""What turns dr dz into volume, and dr into area."""


def section(materials: str) -> Any:
    """Return the measure dr dz over some materials; `RING` makes it a volume."""
    return dx(materials, bonus_intorder=2)  # a low order would put a point at r = 0, where u_r/r is 0/0


class Strain(NamedTuple):
    """Axisymmetric small strain: radial, hoop, axial, and the tensor's shear component."""

    rr: Expression
    tt: Expression
    zz: Expression
    rz: Expression

    @property
    def trace(self) -> Expression:
        """Volume change."""
        return self.rr + self.tt + self.zz


class Stress(NamedTuple):
    """Axisymmetric Cauchy stress in kPa."""

    rr: Expression
    tt: Expression
    zz: Expression
    rz: Expression


def strain(u_r: Expression, u_z: Expression) -> Strain:
    """Return the small strain of a displacement in mm."""
    d_r, d_z = grad(u_r), grad(u_z)
    return Strain(d_r[0], u_r / x, d_z[1], (d_r[1] + d_z[0]) / 2)


def stress(e: Strain, youngs_modulus_kpa: Expression, poisson_ratio: Expression) -> Stress:
    """Return Hooke's stress in kPa: sigma = 2 mu e + lambda tr(e) I."""
    E, nu = youngs_modulus_kpa, poisson_ratio
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    mean = lam * e.trace
    return Stress(2 * mu * e.rr + mean, 2 * mu * e.tt + mean, 2 * mu * e.zz + mean, 2 * mu * e.rz)


def work(s: Stress, e: Strain) -> Expression:
    """Return sigma : e, the work density of a stress on a strain."""
    return s.rr * e.rr + s.tt * e.tt + s.zz * e.zz + 2 * s.rz * e.rz
