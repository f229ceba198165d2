"""Displacements to stored energy in finite strain: the compressible neo-Hookean law in axisymmetry.

The deformation gradient has an in-plane part (r, z) and a hoop stretch; a 2-D Det or trace alone would forget the hoop.
Source: Bonet & Wood, Nonlinear Continuum Mechanics for Finite Element Analysis (2008), section 6.5 (decoupled law).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from ngsolve import CF, Det, Id, InnerProduct, grad, x

from host_tools.forward.materials import Elasticity
from host_tools.forward.small_strain.elasticity import bulk_modulus_kpa, shear_modulus_kpa
from host_tools.forward.symmetry import Expression


class DeformationGradient(NamedTuple):
    """F in axisymmetry: `in_plane` [2, 2] over (r, z), and the stretch of a hoop around the axis."""

    in_plane: Expression
    hoop: Expression

    @property
    def volume_ratio(self) -> Expression:
        """J = det F."""
        return Det(self.in_plane) * self.hoop


def deformation_gradient(u_r: Expression, u_z: Expression) -> DeformationGradient:
    """Return I + grad u of a displacement in mm."""
    d_r, d_z = grad(u_r), grad(u_z)
    return DeformationGradient(Id(2) + CF((d_r[0], d_r[1], d_z[0], d_z[1]), dims=(2, 2)), 1 + u_r / x)


class NeoHookean(NamedTuple):
    """W(F) = mu/2 (J^-2/3 tr F^T F - 3) + K/2 (J - 1)^2; mu and K are those of Hooke's law at small strain."""

    mu_kpa: Expression
    bulk_kpa: Expression

    @classmethod
    def of(cls, elasticity: Elasticity, mesh: Any) -> NeoHookean:
        """Return the law of every material of a mesh."""
        E, nu = elasticity.fields(mesh)
        return cls(shear_modulus_kpa(E, nu), bulk_modulus_kpa(E, nu))

    def energy_density_kpa(self, F: DeformationGradient) -> Expression:
        """Return W per undeformed volume, in kPa = uJ/mm3; it is no number where J < 0, so no folded state passes."""
        J = F.volume_ratio
        trace = InnerProduct(F.in_plane, F.in_plane) + F.hoop * F.hoop
        return self.mu_kpa / 2 * (J ** (-2 / 3) * trace - 3) + self.bulk_kpa / 2 * (J - 1) ** 2
